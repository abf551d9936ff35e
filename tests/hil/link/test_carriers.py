"""The link's promises in small on the wall clock: over zenoh through the emulator node, and over plain UDP."""

import time
from collections import Counter
from contextlib import ExitStack
from threading import Event as Flag
from threading import Thread

import numpy as np
import pytest
import zenoh

from ground.link.news import EventHeard, Item, ProductHeard
from ground.link.session import Session
from ground.station.clock import first_nonce
from hil.link.emulator import LinkEmulator
from hil.link.impairment import Impairment, Profile
from hil.link.udp_relay import UdpRelay
from hil.processes import free_ports
from onboard.config import Link
from onboard.core.downlink import Downlink
from onboard.core.telemetry import TelemetryInputs
from onboard.drivers.link.port import LinkPort
from onboard.records import Event
from protocol.link import carrier
from protocol.link.datagrams import KEY_DOWN, KEY_UP, bench_keys
from protocol.link.transactions import RequestState
from protocol.tables.modes import Mode
from transport.link_end import LinkEnd
from transport.udp_end import UdpGroundEnd
from transport.zenoh_end import ZenohEnd

KEYS = bench_keys(7)
TICK_NS = 10_000_000
S = 1_000_000_000
LIMIT_S = 90.0
ONE_WAY_S = 0.05
CARRIERS = ("tcp", "udp")


def line(**changes: object) -> Profile:
    return Profile(down_bps=256e3, up_bps=256e3, one_way_s=ONE_WAY_S, jitter_s=0.01, **changes)


def ground_end(endpoint: str) -> LinkEnd:
    if endpoint.startswith(carrier.DIRECT):
        return UdpGroundEnd(endpoint, KEYS, 1, ONE_WAY_S, first_nonce())
    return ZenohEnd(carrier.GROUND, endpoint, hear=KEY_DOWN, say=KEY_UP)


class Ends:
    """Rover's port and core, link, station's end and session, turned by one thread; time is the wall's."""

    def __init__(self, stack: ExitStack, kind: str, link: Profile, seed: int = 3) -> None:
        rover_port, ground_port = free_ports(2)
        rover, ground = f"{kind}/127.0.0.1:{rover_port}", f"{kind}/127.0.0.1:{ground_port}"
        if kind == "tcp":
            self.link = stack.enter_context(LinkEmulator(link, seed, rover, ground))
        else:
            self.link = stack.enter_context(
                UdpRelay(link, seed, ("127.0.0.1", rover_port), ("127.0.0.1", ground_port), None)
            )
        self.port = stack.enter_context(LinkPort(rover, KEYS, 1))
        self.core = Downlink(Link(rate_bps=link.down_bps))
        self._stack, self._ground = stack, ground
        self.end = self._open_ground()
        self.session = Session(KEYS, 1, up_bps=link.up_bps)
        self.executed: Counter[float] = Counter()
        self.news: list = []
        self._start_ns, self._tick = time.monotonic_ns(), 0
        self.view = TelemetryInputs(mode=Mode.STANDBY)

    def _open_ground(self) -> LinkEnd:
        end = ground_end(self._ground)
        self._stack.callback(end.close)
        return end

    def restart_ground(self) -> None:
        self.end.close()
        old, self.end = self.session, self._open_ground()
        self.session = Session(KEYS, 1, kept=old.kept)
        self.session.sealer.counter, self.session.requester.next_id = old.sealer.counter + 640, old.requester.next_id

    @property
    def now_ns(self) -> int:
        return time.monotonic_ns() - self._start_ns

    def until(self, done) -> None:
        while not done():
            assert self.now_ns < LIMIT_S * S, f"not within {LIMIT_S} s: {self.link.report()}"
            self.turn()

    def turn(self) -> None:
        self.link.turn(self.now_ns)
        if self.now_ns // TICK_NS > self._tick:
            self._tick = self.now_ns // TICK_NS
            self._rover(self._tick * TICK_NS)
        self.end.knock()
        for datagram in self.end.take(1000):
            self.news += self.session.receive(datagram, self.now_ns)[1]
        for datagram in self.session.send(self.now_ns):
            self.end.put(datagram)

    def _rover(self, now_ns: int) -> None:
        for order in self.core.receive(self.port.read(now_ns), now_ns):
            self.executed[order.arguments["x_m"]] += 1
            self.core.report(order.request_id, RequestState.COMPLETED)
        self.core.sample(self.view, now_ns)
        self.port.write(self.core.send(now_ns))

    def heard(self, kind: type) -> list:
        return [one for one in self.news if isinstance(one, kind)]


def lose(model: Impairment, numbers: set[int]) -> None:
    """These datagrams of a direction, counted from 1; two of each open the session."""
    model.dark = lambda _: model.counts.offered in numbers


@pytest.mark.parametrize(("kind", "loss"), [("tcp", 0.3), ("udp", 0.1)])
def test_commands_events_and_a_product_pass_and_a_blackout_of_the_line_costs_no_session(kind, loss):
    data = np.random.default_rng(1).bytes(25_000)
    link = line(loss=loss, blackout_first_s=1e6, blackout_length_s=1.0)
    with ExitStack() as stack:
        ends = Ends(stack, kind, link)
        ends.until(lambda: ends.session.boot_id)
        assert ends.end.linked
        for model in (ends.link.down, ends.link.up):
            dark_ns = ends.now_ns + S
            model.dark = lambda at_ns, dark_ns=dark_ns: dark_ns <= at_ns < dark_ns + 2 * S
        ends.core.offer("ldem", data, "raw")
        for n in range(30):
            ends.core.event(Event(ends.now_ns, "info", "NOTE", str(n)))
            ends.session.request("goto", {"x_m": float(n), "y_m": 0.0}, ends.now_ns)
        ends.until(lambda: not (ends.session.requester.open or ends.core.events_waiting) and ends.heard(ProductHeard))
        assert ends.executed == {float(n): 1 for n in range(30)}
        assert {r.state for r in ends.session.requester.requests.values()} == {RequestState.COMPLETED}
        assert [p.product.data for p in ends.heard(ProductHeard)] == [data]
        assert sorted(int(e.text) for e in ends.heard(EventHeard)) == list(range(30))
        end_ns = dark_ns + 2 * S
        ends.until(lambda: any(i.onboard_ns > end_ns for i in ends.heard(Item)))
        assert all(model.counts.blackout for model in (ends.link.down, ends.link.up))
        assert ends.end.linked


@pytest.mark.parametrize("kind", CARRIERS)
def test_a_station_that_starts_anew_is_heard_and_hears_and_nothing_is_done_twice(kind):
    with ExitStack() as stack:
        ends = Ends(stack, kind, line(loss=0.05))
        ends.until(lambda: ends.session.boot_id)
        first = ends.session
        first.request("goto", {"x_m": 1.0, "y_m": 0.0}, ends.now_ns)
        ends.until(lambda: not first.requester.open)
        ends.restart_ground()
        ends.session.request("goto", {"x_m": 2.0, "y_m": 0.0}, ends.now_ns)
        ends.until(lambda: not ends.session.requester.open)
        assert ends.executed == {1.0: 1, 2.0: 1}


@pytest.mark.parametrize("lost", [set(), {1}], ids=["nothing lost", "the first datagram lost"])
def test_a_station_waits_for_the_trips_that_its_settings_allow_however_short_its_own_patience(lost):
    """Found over the Moon's delay: 3 s of patience, trips of 1.35 s, `nobody is there` each time."""
    rover_port, ground_port = free_ports(2)
    rover, ground = f"udp/127.0.0.1:{rover_port}", f"udp/127.0.0.1:{ground_port}"
    relay = UdpRelay(line(), 3, ("127.0.0.1", rover_port), ("127.0.0.1", ground_port), None)
    with ExitStack() as stack:
        stack.enter_context(relay)
        lose(relay.up, lost)
        port = stack.enter_context(LinkPort(rover, KEYS, 1))
        turn_in_background(stack, relay, port)
        end = ground_end(ground)
        stack.callback(end.close)
        assert end.wait_open(0.01, 0.01)


def turn_in_background(stack: ExitStack, relay: UdpRelay, port: LinkPort) -> None:
    over, start_ns = Flag(), time.monotonic_ns()

    def turns() -> None:
        while not over.wait(0.001):
            relay.turn(time.monotonic_ns() - start_ns)
            port.read(time.monotonic_ns() - start_ns)

    thread = Thread(target=turns)
    thread.start()
    stack.callback(lambda: (over.set(), thread.join()))


def test_a_session_that_zenoh_cannot_close_in_time_ends_in_peace():
    end = ZenohEnd(carrier.GROUND, "tcp/127.0.0.1:1", hear=KEY_DOWN, say=KEY_UP)

    def too_late() -> None:
        raise zenoh.ZError("close operation timed out!")

    end._stack.callback(too_late)
    end.close()
    assert end.failed


def test_a_sample_of_40_mb_on_the_bus_is_dropped_before_it_is_kept_and_what_follows_it_passes():
    with ExitStack() as stack:
        ends = Ends(stack, "tcp", line())
        ends.until(lambda: ends.session.boot_id)
        ends.end._data.put(bytes(40_000_000))  # never becomes a sample
        ends.end._data.put(bytes(3000))  # becomes one, and is cut to what is refused for its length
        ends.session.request("goto", {"x_m": 5.0, "y_m": 0.0}, ends.now_ns)
        ends.until(lambda: not ends.session.requester.open)
        assert ends.executed == {5.0: 1}
        assert ends.core.refused == {"length": 1} and ends.link.ground.taken.size < 10_000
