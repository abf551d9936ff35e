"""Carrier B over real UDP sockets of the loopback, under people who have no key: they hold nothing and stop nobody."""

import socket
from contextlib import ExitStack, contextmanager

import numpy as np
import pytest

from ground.archive.store import Archive
from ground.station.clock import ClockTurn
from ground.station.settings import StationSettings
from ground.station.station import Station
from hil.processes import free_ports
from onboard.config import ConfigError, Link
from onboard.core.downlink import Downlink
from onboard.core.telemetry import TelemetryInputs
from onboard.drivers.link.port import LinkPort, LinkPortError
from protocol.link.datagrams import MAX_DATAGRAM, bench_keys
from protocol.link.transactions import RequestState
from protocol.tables.modes import Mode

KEYS = bench_keys(7)
TICK_NS = 10_000_000
MOST_TURNS = 5000
# What a zenoh 1.10 end sends first and 120 times never finishes: 25 B that kept a listener of zenoh shut for 7 s.
OPENING = bytes.fromhex("c109f108a8cf041c793302c5d4c806371ede9f0ab004812701")


class Rover:
    """Port and downlink of the flight program, turned by the test."""

    def __init__(self, endpoint: str, now_ns: int) -> None:
        self.port = LinkPort(endpoint, KEYS, 1)
        self.port._end.clock_ns = lambda: self.now_ns
        self.core = Downlink(Link(rate_bps=256e3))
        self.done: list[str] = []
        self.now_ns = now_ns

    def turn(self) -> None:
        self.now_ns += TICK_NS
        for order in self.core.receive(self.port.read(self.now_ns), self.now_ns):
            self.done.append(order.name)
            self.core.report(order.request_id, RequestState.COMPLETED)
        self.core.sample(TelemetryInputs(mode=Mode.STANDBY), self.now_ns)
        self.port.write(self.core.send(self.now_ns))


class World:
    def __init__(self, stack: ExitStack) -> None:
        self.stack, self.number = stack, free_ports(1)[0]
        self.rover = Rover(f"udp/127.0.0.1:{self.number}", 0)
        stack.callback(lambda: self.rover.port.close())

    def enemy(self, count: int) -> list[socket.socket]:
        """Sockets of somebody without a key, each of another port, all towards the rover."""
        made = [self.stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) for _ in range(count)]
        for each in made:
            each.connect(("127.0.0.1", self.number))
        return made

    def station(self, number: int = 1) -> Station:
        settings = StationSettings(endpoint=f"udp/127.0.0.1:{self.number}", station=number, bench_seed=7, one_way_s=0.0)
        made = self.stack.enter_context(Station(settings, self.stack.enter_context(Archive(":memory:"))))
        made._end.clock_ns = lambda: self.rover.now_ns
        return made

    def until(self, condition, *stations: Station) -> None:
        for _ in range(MOST_TURNS):
            if condition():
                return
            self.turn(*stations)
        raise AssertionError(f"not within {MOST_TURNS} turns: {self.rover.core.refused}")

    def turn(self, *stations: Station) -> None:
        self.rover.turn()
        for one in stations:
            one._end.knock()
            one.turn(ClockTurn(self.rover.now_ns, None))
            one.flush(self.rover.now_ns)

    def asks(self, station: Station, name: str) -> None:
        """A command of this station is done and confirmed."""
        self.until(lambda: station.session.boot_id, station)
        request = station.session.request(name, {}, self.rover.now_ns)
        self.until(lambda: station.session.requester.requests[request].state is RequestState.COMPLETED, station)


@contextmanager
def world():
    with ExitStack() as stack:
        yield World(stack)


def test_a_hundred_and_twenty_openings_that_nobody_finishes_keep_no_station_out():
    with world() as here:
        for each in here.enemy(120):
            each.send(OPENING)
        here.turn()
        here.asks(here.station(), "stop")
        assert here.rover.done == ["stop"]


def test_what_comes_without_a_key_gets_no_answer_no_place_and_is_counted_as_refused():
    rng = np.random.default_rng(1)
    with world() as here:
        senders = here.enemy(50)
        here.rover.now_ns = 20_000_000_000
        for n, each in enumerate(senders):
            each.send(bytes([0x80 + n % 4, n % 5]) + rng.bytes(40))  # as long as a hello
            each.send(rng.bytes(int(rng.integers(1, 1400))))
        here.until(lambda: sum(here.rover.core.refused.values()) == 100)
        for each in senders:
            each.setblocking(False)
            with pytest.raises(BlockingIOError):
                each.recv(2000)
        assert not here.rover.port._end.linked
        assert set(here.rover.core.refused) <= {"length", "tag"}
        assert [(event.name, event.text.split()[0]) for event in here.rover.core.notices] == [
            ("LINK_REFUSED", "length")
        ]


def test_hellos_that_were_recorded_give_nobody_else_a_place():
    with world() as here:
        tap = here.stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        tap.bind(("127.0.0.1", 0))
        tap.settimeout(20.0)
        victim = here.station()
        victim._end._rover = tap.getsockname()
        victim._end.knock()
        hello = tap.recv(2000)
        for each in here.enemy(30):
            each.send(hello)
        here.turn()
        here.turn()
        assert not here.rover.port._end.linked


def test_a_flood_from_elsewhere_fills_no_queue_of_a_station_that_listens():
    """More than the system keeps for one socket lies there before the rover looks; the station's stop is not lost."""
    with world() as here:
        station = here.station()
        here.until(lambda: station.session.boot_id, station)
        here.until(lambda: here.rover.port._end._own, station)
        flood = here.enemy(1)[0]
        for _ in range(30_000):
            flood.send(bytes(MAX_DATAGRAM))
        request = station.session.request("stop", {}, here.rover.now_ns)
        station.flush(here.rover.now_ns)
        here.rover.turn()
        assert here.rover.done == ["stop"]
        here.until(lambda: station.session.requester.requests[request].state is RequestState.COMPLETED, station)


def test_two_programs_of_one_station_a_second_station_and_a_viewer_all_hear_the_rover():
    with world() as here:
        stations = [here.station(), here.station(), here.station(2)]
        here.until(lambda: all(one.session.boot_id for one in stations), *stations)


def test_a_station_that_ends_gives_up_its_place():
    with world() as here:
        with ExitStack() as alone:
            here.stack, outer = alone, here.stack
            station = here.station()
            here.until(lambda: here.rover.port._end.linked, station)
            here.until(lambda: station._end._caller._listening, station)
        here.stack = outer
        here.until(lambda: not here.rover.port._end.linked)


def test_a_rover_that_starts_anew_on_the_same_port_is_found_again():
    with world() as here:
        station = here.station()
        here.until(lambda: station._end._caller._listening, station)
        here.rover.port.close()
        here.rover = Rover(f"udp/127.0.0.1:{here.number}", here.rover.now_ns)
        here.until(lambda: here.rover.port._end.linked, station)


def test_a_stop_needs_no_place_at_the_rover():
    with world() as here:
        station = here.station()
        station.session.request("stop", {}, 0)
        station.flush(0)
        here.until(lambda: here.rover.done)
        assert here.rover.done == ["stop"]


def test_a_port_that_is_taken_is_an_error_also_while_stations_listen():
    with world() as here:
        station = here.station()
        here.until(lambda: here.rover.port._end._own, station)
        with pytest.raises(LinkPortError, match="in use"):
            LinkPort(f"udp/127.0.0.1:{here.number}", KEYS, 1)


@pytest.mark.parametrize("endpoint", ["udp/127.0.0.1", "udp/:7450", "udp/127.0.0.1:70000", "udp/[::1:7450"])
def test_an_endpoint_that_is_no_address_is_a_configuration_error(endpoint):
    with pytest.raises(ConfigError, match=r"link\.endpoint"):
        LinkPort(endpoint, KEYS, 1)
