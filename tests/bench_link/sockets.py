"""Row `hostile-udp`: the companion of `hostile` on real UDP sockets and the wall clock.

An enemy without a key, in a process of its own, sends from many ports: zenoh openings that it never finishes, words as
long as a hello, recorded hellos of the station, the frames of `hostile`. In each try a new station opens and stops the
rover.
"""

from __future__ import annotations

import time
from contextlib import ExitStack, suppress
from multiprocessing import get_context
from tempfile import TemporaryDirectory

from ground.archive.store import Archive
from ground.station.clock import ClockTurn
from ground.station.settings import StationSettings
from ground.station.station import Station
from onboard.config import Link
from onboard.core.downlink import Downlink
from onboard.core.telemetry import TelemetryInputs
from onboard.drivers.link.port import LinkPort
from protocol.link.datagrams import bench_keys
from protocol.link.transactions import RequestState
from protocol.tables.modes import Mode
from tests.bench_link import socket_enemy
from tests.bench_link.day import resident_bytes
from tests.bench_link.figures import Figure, Told, count, quantile

SEED = socket_enemy.SEED
TRIES, LIMIT_S, MEMORY_MB = 20, 30.0, 20.0
_TURN_S = 0.01
_SPAWN = get_context("spawn")


class Siege:
    """Rover and stations, turned by one thread every 10 ms of the wall clock, and the enemy. Use it inside `with`.

    fires: set while the enemy sends.
    thrown: its datagrams so far.
    """

    def __init__(self) -> None:
        self._stack = ExitStack()
        self._keys = bench_keys(SEED)
        self._start_s = time.monotonic()
        self.fires, self._ends = _SPAWN.Event(), _SPAWN.Event()
        self._thrown = _SPAWN.Value("q", 0)
        self.done = self.places = 0

    def __enter__(self) -> Siege:
        self._folder = self._stack.enter_context(TemporaryDirectory())  # the stations' counters, which only rise
        self.port = self._stack.enter_context(LinkPort("udp/127.0.0.1:0", self._keys, 1))
        self.core = Downlink(Link(rate_bps=256e3))
        self._number = self.port._end.port
        self._lips, ear = _SPAWN.Pipe()
        given = (self._number, ear, self.fires, self._ends, self._thrown)
        enemy = _SPAWN.Process(target=socket_enemy.run, args=given)
        enemy.start()
        self._stack.callback(enemy.join)
        self._stack.callback(self._ends.set)
        self._own = set(self._lips.recv())
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    @property
    def thrown(self) -> int:
        """Datagrams of the enemy."""
        return int(self._thrown.value)

    @property
    def now_ns(self) -> int:
        return round(1e9 * (time.monotonic() - self._start_s))

    def stop_s(self) -> float | None:
        """Return the time from a new station's start to the confirmation of its stop; None: not in 30 s."""
        settings = StationSettings(
            endpoint=f"udp/127.0.0.1:{self._number}", bench_seed=SEED, one_way_s=0.0, state=self._folder
        )
        began_s = time.monotonic()
        with Archive(":memory:") as archive, Station(settings, archive) as station:
            self._listen_in(station)
            request = station.session.request("stop", {}, self.now_ns)
            while station.session.requester.requests[request].state is not RequestState.COMPLETED:
                if time.monotonic() - began_s > LIMIT_S:
                    return None
                self._turn(station)
            return time.monotonic() - began_s

    def _listen_in(self, station: Station) -> None:
        send = station._end._send

        def heard(data: bytes) -> None:
            with suppress(OSError):  # of an enemy that has ended
                self._lips.send_bytes(data)
            send(data)

        station._end._send = heard

    def _turn(self, station: Station) -> None:
        due_s = time.monotonic() + _TURN_S
        for order in self.core.receive(self.port.read(self.now_ns), self.now_ns):
            self.done += 1
            self.core.report(order.request_id, RequestState.COMPLETED)
        self.core.sample(TelemetryInputs(mode=Mode.STANDBY), self.now_ns)
        self.port.write(self.core.send(self.now_ns))
        station.turn(ClockTurn(self.now_ns, None))
        station.flush(self.now_ns)
        held = self.port._end._listeners.addresses(self.port._end.clock_ns())
        self.places = max(self.places, len(self._own & set(held)))
        time.sleep(max(0.0, due_s - time.monotonic()))


def row(quick: bool, told: Told) -> list[Figure]:
    """Measure a stop by a new station, in peace and under fire; the enemy's places at the rover; memory."""
    tries = 5 if quick else TRIES
    with Siege() as siege:
        told(f"{tries} stops in peace")
        quiet_s = [siege.stop_s() or LIMIT_S for _ in range(tries)]
        before_b, siege.done = resident_bytes(), 0
        siege.fires.set()
        told(f"{tries} stops besieged")
        began_s = time.monotonic()
        waits_s = [siege.stop_s() for _ in range(tries)]
        rate_hz = siege.thrown / (time.monotonic() - began_s)
        grown_b = resident_bytes() - before_b
        limit_s, what = 2 * max(quiet_s) + 1.0, f"udp, {rate_hz:.0f}/s"
        drawn_s = [[LIMIT_S if each is None else each for each in waits_s]]
        return [
            count("hostile-udp", what, "stations kept out", waits_s.count(None), 0, tries),
            count("hostile-udp", what, "stops not done once", abs(siege.done - tries), 0, tries),
            count("hostile-udp", what, "places of the enemy", siege.places, 0, siege.thrown),
            quantile("hostile-udp", what, "stop confirmed, worst", drawn_s, 1.0, limit_s, "s"),
            quantile("hostile-udp", what, "memory grown", [[max(0.0, grown_b / 1e6)]], 1.0, MEMORY_MB, "MB"),
        ]
