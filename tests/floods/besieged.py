"""The flight program on the wall clock, driving on a stand, ordered to stop while something floods it."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NamedTuple, Self

from ground.session.session import Session
from ground.station.clock import first_nonce
from onboard.drivers.status_port import StatusError, ask
from onboard.drivers.udp_end import UdpGroundEnd
from protocol.link import bench_keys
from protocol.transactions import State
from tests.floods import flooders
from tests.soak.taken import MB, taken

ROOT = Path(__file__).parents[2]
KINDS = ("quiet", "scanner", "bus", "datagrams")
SEED, ONE_WAY_S = 1, 0.05
FELT_S, LIMIT_S, MOVING_RADPS = 1.0, 60.0, 0.05
MACHINE = {"COMPUTER_STRAINED", "TICK_LATE"}  # faults of a busy machine, with which the rover drives
DRIVE = {"vx_mps": 0.1, "vy_mps": 0.0, "yaw_radps": 0.0, "duration_s": 60.0, "distance_m": 10.0}


class Stopped(NamedTuple):
    """One try. answered_s, stood_s: from the order `stop` to its report COMPLETED, and to wheels that stand (0: they
    stood). drove: whether the wheels turned when the flood began. faults: active when it was over."""

    answered_s: float
    stood_s: float
    drove: bool
    faults: tuple[str, ...]


class Besieged(NamedTuple):
    """The tries under one flood. Ticks are of the flight program's own account, since its start.

    refused: datagrams that failed a check. slips: what ticks were left out for, the most frequent first.
    """

    kind: str
    tries: tuple[Stopped, ...]
    rss_before_mb: float
    rss_after_mb: float
    worst_tick_before_ms: float
    worst_tick_ms: float
    left_out_before: int
    left_out: int
    refused: int
    slips: tuple[str, ...]

    @property
    def faults(self) -> tuple[str, ...]:
        """All that were told in the tries."""
        return tuple(sorted({name for each in self.tries for name in each.faults}))


def free_port(kind: int) -> int:
    """A port that nobody has now."""
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Siege:
    """Rover, surroundings and station; use it inside `with`. folder: of the rover's files."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._stack = folder, ExitStack()
        self._ends = flooders.SPAWN.Event()
        self._floods = {kind: flooders.SPAWN.Event() for kind in KINDS}
        self.fastest_radps = flooders.SPAWN.Value("d", 0.0)
        self.session = Session(bench_keys(SEED), 1, up_bps=1e6)
        self._start_ns = time.monotonic_ns()

    def __enter__(self) -> Self:
        try:
            self._begin()
        except BaseException:
            self._stack.close()
            raise
        return self

    def _begin(self) -> None:
        can, lidar, link = free_port(socket.SOCK_STREAM), free_port(socket.SOCK_STREAM), free_port(socket.SOCK_DGRAM)
        surroundings = ((flooders.bus, can, "bus", (self.fastest_radps,)), (flooders.scanner, lidar, "scanner", ()),
                        (flooders.datagrams, link, "datagrams", ()))  # fmt: skip
        for run, port, kind, more in surroundings:
            process = flooders.SPAWN.Process(target=run, args=(port, self._floods[kind], self._ends, *more))
            process.start()
            self._stack.callback(process.join)
        self._stack.callback(self._ends.set)
        self._fly(can, lidar, link)
        self._end = UdpGroundEnd(f"udp/127.0.0.1:{link}", bench_keys(SEED), 1, ONE_WAY_S, first_nonce())
        self._stack.callback(self._end.close)
        if not self.until(lambda: self.session.commanding):
            raise RuntimeError(f"the rover was not heard: {self.session.mismatch or self._log()}")

    def __exit__(self, *caught: object) -> None:
        self._stack.close()

    def _fly(self, can: int, lidar: int, link: int) -> None:
        settings = {
            "clock.mode": "wall", "can.uri": f"socketcand:127.0.0.1:{can}/rover",
            "lidar.address": f"tcp:127.0.0.1:{lidar}", "link.endpoint": f"udp/127.0.0.1:{link}",
            "link.bench_seed": SEED, "record.path": self._folder / "onboard.mcap",
            "status.socket": self._folder / "status",
        }  # fmt: skip
        words = [sys.executable, "-m", "onboard", "run", *(f"--set={name}={value}" for name, value in settings.items())]
        log = self._stack.enter_context((self._folder / "onboard.log").open("w"))
        self.flight = subprocess.Popen(words, cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT)},
                                       stdin=subprocess.DEVNULL, stdout=log, stderr=log)  # fmt: skip
        self._stack.callback(self.flight.wait)
        self._stack.callback(self.flight.terminate)

    @property
    def now_ns(self) -> int:
        """Since the siege began."""
        return time.monotonic_ns() - self._start_ns

    def until(self, done: Callable[[], bool], limit_s: float = LIMIT_S) -> bool:
        """Keeps the station going until `done`; whether it was within the limit."""
        end_ns = self.now_ns + round(limit_s * 1e9)
        while not done():
            if self.now_ns > end_ns:
                return False
            self._end.knock()
            for datagram in self._end.take(1000):
                self.session.receive(datagram, self.now_ns)
            for datagram in self.session.send(self.now_ns):
                self._end.put(datagram)
            time.sleep(0.001)
        return True

    def order(self, name: str, **arguments: Any) -> Callable[[], bool]:
        """Sends it; the function says whether it has ended or, what moves, begun."""
        request = self.session.request(name, arguments, self.now_ns)
        return lambda: self.session.requester.requests[request].state in (State.COMPLETED, State.FAILED)

    def status(self) -> dict[str, Any]:
        """What the flight program says of itself."""
        found: list[dict[str, Any]] = []

        def asked() -> bool:
            try:
                found.append(json.loads(ask((self._folder / "status",))))
            except StatusError:
                return False
            return True

        if not self.until(asked):
            raise RuntimeError(f"no status: {self._log()}")
        return found[0]

    def _log(self) -> str:
        return (self._folder / "onboard.log").read_text()[-500:]

    def _refused(self) -> int:
        """So many as the rover's telemetry says."""
        item = self.session.items.get("link_refused")
        return int(item.value) if item else 0

    def attempt(self, kind: str) -> Stopped:
        """Drive, flood, stop; then all is as before."""
        self._make_ready()
        self.order("drive", **DRIVE)
        drove = self.until(lambda: self.fastest_radps.value > MOVING_RADPS, 10.0)
        self._floods[kind].set()
        self.until(lambda: False, FELT_S)
        begun_ns, standing_ns = self.now_ns, list[int]()
        if self.fastest_radps.value < MOVING_RADPS:
            standing_ns.append(begun_ns)
        answered = self.order("stop")

        def stands() -> bool:
            if not standing_ns and self.fastest_radps.value < MOVING_RADPS:
                standing_ns.append(self.now_ns)
            return answered() and bool(standing_ns)

        if not self.until(stands):
            raise RuntimeError(f"under {kind} the rover did not stop within {LIMIT_S:g} s")
        ended_ns = self.now_ns
        faults = tuple(self.status()["faults"])
        self._floods[kind].clear()
        return Stopped((ended_ns - begun_ns) / 1e9, (standing_ns[0] - begun_ns) / 1e9, drove, faults)

    def _make_ready(self) -> None:
        """In STANDBY without a fault that keeps it from driving; the flood before has drained by then."""

        def ready() -> bool:
            told = self.status()
            well = {*told["faults"]} <= MACHINE
            if told["mode"] == "SAFE" and well:
                self.until(self.order("resume"), 5.0)
            return bool(told["mode"] == "STANDBY" and well)

        if not self.until(ready):
            raise RuntimeError(f"not ready within {LIMIT_S:g} s: {self.status()['mode']}, {self.status()['faults']}")

    def besiege(self, kind: str, tries: int) -> Besieged:
        """So many tries under this flood."""
        self._make_ready()
        before, rss_before = self.status()["ticks"], taken(self.flight.pid, 0.0).rss_bytes
        got, rss_after = list[Stopped](), rss_before
        for _ in range(tries):
            got.append(self.attempt(kind))
            rss_after = max(rss_after, taken(self.flight.pid, 0.0).rss_bytes)
        after = self.status()["ticks"]
        return Besieged(
            kind, tuple(got), rss_before / MB, rss_after / MB, before["worst_ms"], after["worst_ms"],
            before["slipped"], after["slipped"], self._refused(),
            tuple(f"{slip['cause']} {slip['ticks']}, {slip['worst_ms']:.0f} ms" for slip in after["slips"]),
        )  # fmt: skip
