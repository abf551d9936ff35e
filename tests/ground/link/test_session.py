"""The station's session in virtual time, over the lossy link model, against a toy rover."""

import hashlib
from dataclasses import replace

import numpy as np
import pytest

from ground.cli.operations.script import Runner, parse
from ground.link.news import EventHeard, Item, ProductHeard, ReportHeard
from ground.link.session import Session
from hil.link.impairment import Profile, both_directions, load_profile
from protocol.link.datagrams import Opener, bench_keys
from protocol.link.transactions import RequestState
from protocol.products import decode_ldem, encode_ldem
from protocol.tables import commands
from tests.ground.toy_rover import TICK_NS, ToyRover, a_map

KEYS = bench_keys(7)
S = 1_000_000_000


class World:
    """Rover, link and station on one clock; `run` steps them until the script ends."""

    def __init__(self, profile: Profile, seed: int = 1) -> None:
        self.rover = ToyRover(KEYS, rate_bps=profile.down_bps)
        self.session = Session(KEYS, 1, up_bps=profile.up_bps)
        self.down, self.up = both_directions(profile, seed)
        self.now_ns = 0
        self.news: list = []

    def run(self, script: str, limit_s: float) -> Runner:
        runner = Runner(parse(script))
        while runner.result is None and self.now_ns < limit_s * S:
            self.tick(runner)
        return runner

    def tick(self, runner: Runner | None = None) -> None:
        now_ns = self.now_ns
        for datagram in self.up.due(now_ns):
            self.rover.receive(datagram, now_ns)
        for datagram in self.rover.tick(now_ns):
            self.down.offer(datagram, now_ns)
        for datagram in self.down.due(now_ns):
            verdict, news = self.session.receive(datagram, now_ns)
            assert verdict == "ok" or (verdict == "copy" and self.down.counts.duplicated)
            self.news += news
        if runner is not None:
            runner.step(self.session, now_ns)
        for datagram in self.session.send(now_ns):
            self.up.offer(datagram, now_ns)
        self.now_ns += TICK_NS

    def heard(self, kind: type) -> list:
        return [one for one in self.news if isinstance(one, kind)]


@pytest.mark.parametrize("seed", range(5))
def test_goto_completes_and_is_executed_once_at_30_percent_loss(seed):
    world = World(load_profile("stress"), seed)
    runner = world.run("at 2.0: goto 12 3\nwait goto\n", 120.0)
    assert runner.result is True
    assert world.rover.executed == ["goto"]
    reports = world.heard(ReportHeard)
    assert reports[-1].report.state == RequestState.COMPLETED
    assert reports[-1].report.text == "there"


def test_a_failed_goto_fails_the_script_but_what_follows_is_still_fetched():
    world = World(load_profile("ets8-a"))
    world.rover.fails = True
    runner = world.run("goto 12 3\nwait goto\nget ldem\n", 120.0)
    assert runner.result is False
    assert world.rover.executed == ["goto", "get"]
    assert len(world.heard(ProductHeard)) == 1


@pytest.mark.parametrize("name", ["moon", "moon-bad", "ets8-shadow"])
def test_ldem_arrives_with_the_right_sha_256(name):
    world = World(load_profile(name), 3)
    assert world.run("get ldem\n", 400.0).result is True
    (heard,) = world.heard(ProductHeard)
    assert hashlib.sha256(heard.product.data).digest() == hashlib.sha256(world.rover.map).digest()
    got = decode_ldem(heard.product.data)
    assert np.abs(got.heights_m - a_map().heights_m).max() <= 0.001


@pytest.mark.parametrize("names_object", [True, False])
def test_the_same_map_twice_is_two_successes(names_object):
    world = World(load_profile("ets8-c"))
    world.rover.names_object = names_object
    assert world.run("get ldem\nwait 1\nget ldem\n", 30.0).result is True
    assert world.rover.executed == ["get", "get"]


@pytest.mark.parametrize("names_object", [True, False])
def test_a_second_get_waits_for_the_new_map_and_is_not_content_with_the_old(names_object):
    world = World(load_profile("moon"))
    world.rover.names_object = names_object
    assert world.run("get ldem\n", 60.0).result is True
    world.rover.map = encode_ldem(a_map(seed=2))
    runner = world.run("get ldem\n", 120.0)
    assert runner.result is True
    assert world.session.product_of(runner.asked[-1][0]).data == world.rover.map


def test_telemetry_newest_wins_whatever_the_order_of_arrival():
    world = World(replace(load_profile("ets8-a"), reorder=0.5, reorder_s=3.0))
    for _ in range(2000):
        before = world.session.items.get("x_m")
        world.tick()
        if before is not None:
            assert world.session.items["x_m"].onboard_ns >= before.onboard_ns
    assert [i.onboard_ns for i in world.heard(Item)] != sorted(i.onboard_ns for i in world.heard(Item))
    assert world.session.items["x_m"].value == pytest.approx(world.session.items["x_m"].onboard_ns / S, abs=1e-3)


def test_events_arrive_once_and_are_acknowledged_at_30_percent_loss():
    world = World(load_profile("stress"), 2)
    world.run("goto 1 1\nwait goto\nwait 60\n", 200.0)
    assert [(e.name, e.text) for e in world.heard(EventHeard)] == [("ARRIVED", "there")]
    assert world.rover.events_waiting == 0


def test_nothing_but_what_halts_is_sent_before_the_rover_was_heard():
    session = Session(KEYS, 1)
    session.request("goto", {"x_m": 1.0, "y_m": 2.0}, 0)
    assert session.send(0) == []
    assert session.next_due_ns(0) is None
    session.request("stop", {}, 0)
    (sent,) = session.send(0)
    opened = Opener(KEYS.command, boot_id=77).open(sent)
    assert (opened.halt, commands.decode(opened.payload).name) == (True, "stop")


def test_forged_and_foreign_datagrams_are_counted_and_change_nothing():
    world = World(load_profile("lan"))
    for _ in range(5):
        world.tick()
    items = dict(world.session.items)
    forged = ToyRover(bench_keys(8), boot_id=99)
    for datagram in [b"", b"noise" * 20, *forged.tick(0)]:
        assert world.session.receive(datagram, world.now_ns)[0] in ("length", "tag")
    assert world.session.counts["length"] == 1
    assert world.session.items == items
    assert world.session.boot_id == 1


def test_after_a_reboot_of_the_rover_requests_carry_its_new_boot_id():
    world = World(load_profile("lan"))
    for _ in range(10):
        world.tick()
    world.rover = ToyRover(KEYS, boot_id=2)
    assert world.run("wait 1\nstop\n", 20.0).result is True
    assert world.session.boot_id == 2
    assert world.rover.executed == ["stop"]


def test_after_a_reboot_nothing_of_the_boot_before_is_shown_and_what_was_under_way_has_its_last_word():
    world = World(load_profile("lan"))
    world.now_ns = 900 * S
    for _ in range(100):
        world.tick()
    reboot = world.session.request("reboot", {}, world.now_ns)
    goto = world.session.request("goto", {"x_m": 1.0, "y_m": 0.0}, world.now_ns)
    world.session.send(world.now_ns)
    onboard_ns = world.session.items["x_m"].onboard_ns
    (first,) = ToyRover(KEYS, boot_id=2).tick(0)
    verdict, news = world.session.receive(first, world.now_ns)
    assert verdict == "ok" and onboard_ns >= 900 * S
    assert {item.onboard_ns for item in world.session.items.values()} == {0}
    told = [(one.report.request_id, one.name, one.report.state) for one in news if isinstance(one, ReportHeard)]
    assert told == [(reboot, "reboot", RequestState.COMPLETED), (goto, "goto", RequestState.FAILED)]


@pytest.mark.parametrize(
    ("text", "onboard_s", "severity"),
    [
        ("boot 1", 2, "info"),
        ("boot 2", 2, "warning"),
        ("boot 1", 40, "warning"),
        ("boot 1, tag 1", 2, "warning"),
        ("tag 1", 2, "warning"),
    ],
)
def test_what_was_on_its_way_from_here_as_the_rover_restarted_is_no_warning_and_any_more_is(text, onboard_s, severity):
    session, old, new = Session(KEYS, 1), ToyRover(KEYS), ToyRover(KEYS, boot_id=2)
    for datagram in old.tick(0):
        session.receive(datagram, 0)
    session.request("goto", {"x_m": 1.0, "y_m": 0.0}, S)
    assert len(session.send(S)) == 1
    encode = new._mavlink.event_encode(onboard_s * 10**6, 1, 4, b"LINK_REFUSED", text.encode())
    new._events.add(encode.pack(new._mavlink), 0)
    news = [one for datagram in new.tick(0) for one in session.receive(datagram, 5 * S)[1]]
    (event,) = (one for one in news if isinstance(one, EventHeard))
    assert event.severity == severity and event.text.startswith(text)


def test_the_far_clock_is_right_within_the_jitter():
    world = World(load_profile("moon"), 1)
    world.run("wait 3\nstatus\n", 30.0)
    assert world.session.far_clock.onboard_ns(world.now_ns) == pytest.approx(world.now_ns, abs=0.2 * S)


def test_a_goto_that_arrives_after_its_lifetime_is_reported_expired():
    world = World(replace(load_profile("moon"), loss=0.0, blackout_first_s=5.0, blackout_length_s=30.0))
    runner = Runner(parse("at 6: goto 1 1\n"), lifetime_s=10.0)
    while runner.result is None and world.now_ns < 80 * S:
        world.tick(runner)
    assert runner.result is False
    assert world.rover.executed == []
    assert world.heard(ReportHeard)[-1].report.state == RequestState.EXPIRED
