"""Two operator stations at the real core: the control lease, versions that differ, contact windows, key epochs."""

import hashlib
import random
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader

from ground.archive.store import Archive
from ground.cli.operations import show
from ground.link.rover_clock import FarClock
from ground.link.saved_state import SavedLinkState
from ground.link.schedule import Schedule, parse, utc_ns
from ground.link.session import Session
from ground.station.memory import Memory
from onboard import config
from onboard.config import Link
from onboard.config_text import to_toml
from onboard.core.context import Context
from onboard.core.downlink import Downlink
from onboard.core.modes.lease import Lease
from onboard.drivers.link.saved_state import LinkMemory
from onboard.record.writer import Recorder
from protocol.link.contacts import Windows, windows
from protocol.link.datagrams import DatagramKind, Opener
from protocol.link.transactions import Code, Order
from protocol.link.versions import OURS, Versions, dialect, dictionary, digest
from protocol.tables import commands
from protocol.tables.commands import HALTING, RefusedError
from protocol.tables.modes import Mode
from tests.onboard.core_bench import QUICK
from tests.onboard.two_stations import DOWN, LEASE_S, SECRETS, S, World, keys_of

DRIVE = {"vx_mps": 0.1, "vy_mps": 0.0, "yaw_radps": 0.0, "duration_s": 30.0, "distance_m": 3.0}


@pytest.fixture
def world():
    made = World()
    made.station(1)
    made.station(2)
    made.until(lambda: all(session.commanding for session in made.stations.values()))
    return made


# -- the lease ---------------------------------------------------------------------------------------------------


def test_the_first_command_takes_a_free_lease_and_questions_take_none(world):
    assert world.does(2, "status")[0] == "COMPLETED"
    assert (world.bench.rover.executive.lease.holder, world.lease(1)) == (0, 0)
    world.ask(1, "drive", **DRIVE)
    world.until(lambda: world.lease(1) == 1 and world.lease(2) == 1)
    assert world.told(2, "LEASE") == ["station 1 holds it: it was free"]


def test_the_others_goto_is_refused_with_the_holder_named_and_what_is_allowed(world):
    world.ask(1, "drive", **DRIVE)
    world.until(lambda: world.bench.mode is Mode.TELEOP)
    request = world.ask(2, "goto", x_m=1.0, y_m=0.0)
    state, text = world.outcome(2, request)
    assert (state, world.stations[2].requester.requests[request].report.code) == ("FAILED", Code.LEASE)
    assert text == "goto: station 1 holds the lease (heard 0 s ago); allowed: stop, safe, questions, `lease ask`"
    assert world.bench.mode is Mode.TELEOP


@pytest.mark.parametrize(
    ("name", "mode"), [("stop", Mode.STANDBY), ("safe", Mode.SAFE), ("emergency_stop", Mode.ESTOP)]
)
def test_the_others_stop_safe_and_emergency_stop_work(world, name, mode):
    world.ask(1, "drive", **DRIVE)
    world.until(lambda: world.bench.mode is Mode.TELEOP)
    assert world.does(2, name)[0] == "COMPLETED"
    assert world.bench.mode is mode
    world.until(lambda: world.lease(2) == 1)


def test_the_lease_passes_to_who_asked_when_its_holder_releases_it(world):
    assert world.does(1, "lease_ask") == ("COMPLETED", "station 1 holds it")
    asked = world.ask(2, "lease_ask")
    world.until(lambda: "station 2 asks for it, station 1 holds it" in world.told(1, "LEASE"))
    assert world.does(1, "lease_release")[0] == "COMPLETED"
    assert world.outcome(2, asked) == ("COMPLETED", "station 1 released it")
    world.until(lambda: world.lease(1) == 2)
    assert world.does(1, "goto", x_m=1.0, y_m=0.0)[1].startswith("goto: station 2 holds the lease")
    assert world.does(2, "drive", **DRIVE | {"duration_s": 0.2})[0] == "COMPLETED"


def test_a_holder_that_is_not_heard_loses_it_and_one_that_only_listens_and_acknowledges_keeps_it(world):
    world.does(1, "lease_ask")
    asked = world.ask(2, "lease_ask")
    world.until(lambda: world.stations[1].requester.open == 0)
    for _ in range(2):  # each event is acknowledged, which is a sign of life
        world.run(LEASE_S / 2)
        world.does(2, "lease_show")
        world.ask(1, "status")
        world.run(0.5)
    assert world.lease(2) == 1
    world.deaf.add(1)
    world.run(LEASE_S + 1.5)
    assert world.outcome(2, asked) == ("COMPLETED", "station 1 was not heard for 10 s")
    assert world.bench.rover.executive.lease.holder == 2


def test_asking_again_cancels_the_first_request_and_releasing_what_one_waits_for_leaves_the_line(world):
    world.does(1, "lease_ask")
    first, second = world.ask(2, "lease_ask"), world.ask(2, "lease_ask")
    assert world.outcome(2, first) == ("CANCELLED", "asked for again")
    assert world.does(2, "lease_show") == ("COMPLETED", "station 1 holds it, heard 0 s ago; waiting: 2")
    assert world.does(2, "lease_release") == ("COMPLETED", "no longer asked for")
    assert world.outcome(2, second)[0] == "CANCELLED"
    assert world.does(2, "lease_release")[1].startswith("station 2 does not hold the lease: station 1 holds it")


def test_after_a_restart_nobody_holds_it(world):
    world.does(1, "lease_ask")
    world.boot(2)
    world.until(lambda: world.lease(2) == 0 and world.stations[2].boot_id == 2)
    assert world.does(2, "lease_ask")[0] == "COMPLETED"


EVENTS = st.lists(
    st.tuples(st.sampled_from(["lease_ask", "lease_release", "goto", "silence"]), st.integers(1, 3)), max_size=40
)


@settings(max_examples=200, derandomize=True)
@given(EVENTS)
def test_at_any_time_at_most_one_station_may_command_and_it_was_heard_within_the_bound(events):
    downlink = Downlink(Link())
    lease, now_ns, serial = Lease(LEASE_S, downlink), S, 0
    for name, station in events:
        now_ns += 4 * S if name == "silence" else S // 10
        downlink.now_ns = now_ns
        context = Context(0, now_ns, (), None, None, None, None, {}, held=False)
        if name != "silence":
            serial += 1
            downlink.heard_ns[station] = now_ns
            order = Order(station << 32 | serial, name, {}, station)
            before, passed = lease.holder, True
            try:
                lease.check(order, context)
                if name in lease.orders:
                    lease.orders[name](order, context)
            except RefusedError:
                passed = False
            if name == "goto":
                assert passed == (before in (0, station)) and (lease.holder == station) == passed
        lease.step(context)
        assert lease.holder == 0 or now_ns - downlink.heard_ns[lease.holder] <= LEASE_S * S


# -- versions ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", Versions._fields)
def test_a_dictionary_dbc_or_dialect_of_another_version_is_refused_with_both_named_and_stop_still_goes(
    world, monkeypatch, kind
):
    other = OURS._replace(**{kind: getattr(OURS, kind) ^ 0xFF})
    monkeypatch.setattr("ground.link.session.OURS", other)
    world.ask(1, "drive", **DRIVE)
    state, text = world.outcome(1, next(iter(world.stations[1].requester.requests)))
    assert state == "FAILED"
    assert f"{kind} {getattr(other, kind):08x} here, {getattr(OURS, kind):08x} on the rover" in text
    assert world.stations[1].requester.requests[1].report.code == Code.VERSION
    assert world.bench.mode is Mode.STANDBY
    assert world.does(1, "safe") == ("COMPLETED", "SAFE")
    assert world.bench.mode is Mode.SAFE
    assert not any(commands.decode(p.payload).name == "drive" for p in opened(world))


def opened(world):
    gate = Opener(keys_of(1, 2).command, boot_id=world.boot_id)
    return [o for o in map(gate.open, world.on_board) if o.kind == DatagramKind.TELECOMMAND]


def test_what_is_asked_before_the_versions_are_known_waits_for_them_and_is_then_refused(monkeypatch):
    monkeypatch.setattr("ground.link.session.OURS", OURS._replace(dbc=1))
    world = World()
    session = world.station(1)
    request = world.ask(1, "goto", x_m=1.0, y_m=0.0)
    state, text = world.outcome(1, request)
    assert state == "FAILED" and text.startswith("not sent: dbc 00000001 here, ")
    assert world.reports(1)[-1].code == Code.VERSION and session.mismatch
    assert opened(world) == []


def test_versions_are_the_same_each_time_and_change_with_the_contract():
    assert (digest(dictionary()), digest(dialect())) == (OURS.dictionary, OURS.dialect)
    assert digest((1, "a")) == int(hashlib.sha256(b"(1, 'a')").hexdigest()[:8], 16)
    assert len({digest(x) for x in ((1,), (2,), ("1",), (1, 1))}) == 4


def test_the_dbc_version_is_of_the_file_itself():
    whole = hashlib.sha256((Path(__file__).parents[3] / "protocol" / "rover.dbc").read_bytes()).digest()
    assert OURS.dbc == int.from_bytes(whole[:4], "big")


# -- contact windows ---------------------------------------------------------------------------------------------

PLAN = parse("4 7\n12 15\n", "windows")


def inside(at_s: float) -> bool:
    return 4.0 <= at_s < 7.0 or 12.0 <= at_s < 15.0 or at_s >= 15.0


def test_nothing_is_sent_outside_a_contact_window_up_or_down():
    world = World()
    world.station(1, schedule=PLAN)
    world.until(lambda: world.stations[1].heard_ns is not None)
    assert world.sent_up == []  # the link is not in contact yet
    world.bench.rover.downlink.windows = PLAN.windows
    world.until(lambda: world.now_ns >= round(1.5 * S))
    first = world.ask(1, "map_clear")
    quiet_from = len(world.sent_down)
    world.until(lambda: world.now_ns >= 9 * S)
    assert world.stations[1].requester.requests[first].state.name == "COMPLETED"
    second = world.ask(1, "status")  # in the gap: it waits
    world.until(lambda: world.now_ns >= round(11.9 * S))
    assert world.stations[1].requester.requests[second].state.name == "REQUESTED"
    world.until(lambda: world.now_ns >= round(14.9 * S))
    assert world.stations[1].requester.requests[second].state.name == "COMPLETED"
    assert world.sent_up and all(inside(at_s) for _, at_s in world.sent_up)
    assert world.sent_down[quiet_from:] and all(inside(at_s) for at_s in world.sent_down[quiet_from:])


def test_windows_in_utc_reach_the_rover_by_command_in_onboard_time():
    world = World()
    zero = utc_ns("2026-11-22T12:00:00Z")
    plan = parse("2026-11-22T12:00:00Z 2026-11-22T12:00:05Z\n2026-11-22T12:00:08Z 2026-11-22T12:00:12Z", "w")
    session = world.station(1, schedule=plan, utc_ns=zero)
    world.until(lambda: session.commanding)
    asked = session.windows_for_rover(world.now_ns)
    assert asked == pytest.approx((0.0, 5.0, 8.0, 12.0), abs=0.05)
    assert world.does(1, "contacts_set", windows_s=asked)[0] == "COMPLETED"
    before = len(world.sent_down)
    world.until(lambda: world.now_ns >= round(11.5 * S))
    gap = [at_s for at_s in world.sent_down[before:] if 5.05 < at_s < 7.95]
    assert gap == [] and any(at_s > 8.0 for at_s in world.sent_down)
    assert world.does(1, "contacts_clear")[0] == "COMPLETED"
    assert world.bench.rover.downlink.windows == Windows()


def test_a_rover_whose_windows_are_over_or_wrong_is_not_mute():
    downlink = Downlink(Link())
    downlink.windows = windows([(100 * S, 200 * S), (5000 * S, 5100 * S)])
    assert [downlink._may_speak(t * S) for t in (99, 100, 199, 200, 5099, 5100)] == [
        False,
        True,
        True,
        False,
        True,
        True,
    ]


def test_a_rover_answers_who_is_heard_far_from_any_window():
    world = World()
    world.station(1)
    world.until(lambda: world.stations[1].commanding)
    world.bench.rover.downlink.windows = windows([(5000 * S, 5100 * S)])
    before = len(world.sent_down)
    world.run(2.0)
    assert len(world.sent_down) == before
    assert world.does(1, "stop") == ("COMPLETED", "stopped")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "no window in it"),
        ("1", "w:1: `1` should be"),
        ("# c\n2 1", "2 to 1 s ends before it begins"),
        ("1 5\n4 6", "begins at 4 s should begin after 5 s"),
        ("1 2\n2026-11-22T12:00:00Z 3", "w:2:"),
        ("2026-11-22T12:00:00 2026-11-22T13:00:00", "w:1:"),
    ],
)
def test_a_schedule_that_cannot_be_read_names_file_and_line(text, says):
    with pytest.raises(ValueError, match=r"^w:") as refused:
        parse(text, "w")
    assert says in str(refused.value)


def test_windows_that_are_all_over_are_refused_on_board(world):
    world.run(3.0)
    state, text = world.does(1, "contacts_set", windows_s=(0.5, 1.0))
    assert state == "FAILED" and text.startswith("all of these windows are over: it is ")


def test_a_start_in_utc_is_onboard_time_within_its_error(world):
    session = Session(keys_of(1), 1, utc_ns=utc_ns("2026-11-22T12:00:00Z"))
    world.stations[1] = session
    world.news[1] = []
    world.until(lambda: session.commanding)
    at = session.onboard_of_utc_ns(utc_ns("2026-11-22T12:00:09Z"), world.now_ns)
    assert at == pytest.approx(9 * S, abs=0.02 * S)
    assert Schedule().here(0, session.far_clock, 0) == Windows()


@settings(max_examples=60, derandomize=True)
@given(st.integers(0, 2**32), st.floats(-90.0, 90.0), st.floats(0.0, 2.6))
def test_the_error_bound_of_onboard_time_holds_for_any_delay_and_drift(seed, ppm, least_s):
    rng, far = random.Random(seed), FarClock()
    offset_ns, rate = rng.randrange(-(10**15), 10**15), 1.0 + ppm * 1e-6

    def onboard(at_ns: int) -> int:
        return offset_ns + round(at_ns * rate)

    far.measure(round((least_s + rng.uniform(0.05, 2.6)) * S))
    for sent_ns in range(S, 900 * S, S):
        delay_s = least_s + rng.expovariate(2.0)
        far.hear(onboard(sent_ns) // 1_000_000 * 1_000_000, sent_ns + round(delay_s * S))
    for now_ns in (903 * S, 960 * S):
        found = far.at(now_ns)
        assert abs(found.onboard_ns - onboard(now_ns)) <= found.error_ns
        assert found.error_ns < far.rtt_ns // 2 + 0.1 * S


# -- key epochs --------------------------------------------------------------------------------------------------


def test_every_station_follows_a_rotation_and_what_was_sealed_before_it_is_refused(tmp_path):
    world = World(str(tmp_path))
    one, two = world.station(1), world.station(2)
    world.until(lambda: one.commanding and two.commanding)
    world.does(1, "lease_ask")
    before = one.sealer.seal(4, one.requester.requests[1].payload)
    assert world.does(1, "keys_rotate", epoch=2.0) == ("COMPLETED", "key epoch 2 is in force")
    world.until(lambda: two.sealer.epoch == 2)
    assert (one.sealer.epoch, one.kept.epoch, world.memory.epoch) == (2, 2, 2)
    assert world.gate.receive(before, world.now_ns)[0].verdict == "epoch"
    assert world.does(1, "lease_show")[0] == "COMPLETED"
    assert world.does(1, "keys_rotate", epoch=1.0) == ("FAILED", "key epoch 2 is in force: only a later one can follow")
    world.boot(2)
    world.until(lambda: one.boot_id == 2)
    assert world.does(2, "stop")[0] == "COMPLETED" and world.sealer.epoch == 2
    late = Session(keys_of(1), 1, kept=SavedLinkState(boot_id=2, epoch=2))
    assert late.receive(world.wire[0], 0)[0] == "epoch"


def test_an_epoch_that_the_rover_has_not_loaded_is_refused_in_its_words(world):
    state, text = world.does(1, "keys_rotate", epoch=7.0)
    assert (state, text) == ("FAILED", "epoch 7 is not loaded in both of the rover's key files; loaded: 0 1 2 3")


def test_stop_sent_while_the_rover_reboots_stops_the_new_start(tmp_path):
    world = World(str(tmp_path))
    session = world.station(1)
    world.until(lambda: session.commanding)
    request = world.ask(1, "safe")
    (stop,) = [d for d in session.send(world.now_ns) if session.requester.requests[request]]
    world.boot(2)
    world.deliver(stop)
    world.step()
    assert world.bench.mode is Mode.SAFE
    world.boot(3)
    assert world.gate.receive(stop, 0)[0].verdict == "replay"


# -- nothing tells a key -----------------------------------------------------------------------------------------


def test_no_key_in_anything_that_a_run_writes(tmp_path, capsys):
    settings = replace(
        QUICK,
        record=replace(config.Record(), path=str(tmp_path / "run.mcap")),
        link=config.Link(command_keys="command.keys", downlink_key="downlink.key"),
    )
    world = World(str(tmp_path / "state"))
    session = world.station(1)
    with Recorder(settings, None, (), {"epoch": b"0"}) as recorder, Archive(tmp_path / "archive.db") as archive:
        for n in range(400):
            world.step()
            recorder.write(world.bench.inputs, world.bench.outputs)
            if n == 150:
                world.ask(1, "keys_rotate", epoch=1.0)
            if n == 250:
                world.ask(1, "stop")
        for datagram in (*world.wire, *world.on_board):
            archive.add("datagrams", 0, "down", "ok", datagram)
        recorder.end(None)
    Memory(str(tmp_path / "ground"), 1).note(session.kept)
    said = (
        "\n".join(filter(None, map(show.news_line, world.news[1])))
        + to_toml(settings)
        + repr((session.kept, keys_of(1, 2), world.memory.marks))
        + str(show.status(session, world.now_ns))
    )
    written = {path.name: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    with open(tmp_path / "run.mcap", "rb") as file:  # its chunks are compressed
        record = make_reader(file)
        parts = [message.data for _, _, message in record.iter_messages()]
        written["run.mcap"] += b"".join(parts + [each.data for each in record.iter_attachments()])
    assert sum(map(len, parts)) > 50_000
    assert {"run.mcap", "archive.db", "halts.json", "epoch.json", "station-1.json"} <= set(written)
    ring = keys_of(1, 2)
    needles = [*SECRETS.values(), DOWN]
    needles += [ring.command.key(n, e) for n in SECRETS for e in range(4)] + [ring.downlink.key(0, e) for e in range(4)]
    for needle in needles:
        for where, data in {**written, "said": said.encode()}.items():
            assert needle[:8] not in data, where
            assert needle.hex()[:16].encode() not in data.lower(), where
    assert LinkMemory(str(tmp_path / "state"), ring).epoch == 1


def test_what_halts_the_rover_is_free_and_known_by_its_bytes():
    for row in commands.TABLE:
        if row.arguments:
            continue
        payload = commands.encode(commands.Telecommand(1, 0, 0, row.name, {}))
        assert commands.halts(payload) == (row.name in HALTING)
    assert all(commands.command(name).free for name in HALTING)
