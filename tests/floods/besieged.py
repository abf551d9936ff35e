"""The flight program on the wall clock, driving on a stand, ordered to stop while something floods it."""

from __future__ import annotations

import json
import os
import resource
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from multiprocessing.synchronize import Event
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Self

from ground.archive.store import Archive
from ground.cli.operations.operate import Plan, Teller, operate
from ground.cli.operations.script import parse
from ground.link.session import Session
from ground.station.clock import ClockTurn
from ground.station.settings import StationSettings
from ground.station.station import Station
from onboard.drivers.status_port import StatusError, ask
from protocol.link.transactions import RequestState
from tests.floods import bus_flooders, flooders
from tests.soak.taken import MB, taken

ROOT = Path(__file__).parents[2]
# Carriers of the link, and floods of the rover's other ports.
ENEMIES: dict[str, tuple[str, Callable[..., None] | None]] = {
    "quiet": ("udp", None), "scanner": ("udp", None), "bus": ("udp", None), "datagrams": ("udp", flooders.datagrams),
    "hellos": ("udp", flooders.hellos), "huge": ("udp", flooders.huge), "disk": ("udp", flooders.disk),
    "quota": ("udp", None), "quiet-zenoh": ("tcp", None), "sessions": ("tcp", bus_flooders.sessions),
    "samples": ("tcp", bus_flooders.samples),
}  # fmt: skip
KINDS = tuple(ENEMIES)
SEED = 1
DISK_MB = 64
FELT_S, LIMIT_S, MOVING_RADPS = 1.0, 60.0, 0.05
MACHINE = {"COMPUTER_STRAINED", "TICK_LATE"}  # faults of a busy machine, with which the rover drives
DRIVE = {"vx_mps": 0.1, "vy_mps": 0.0, "yaw_radps": 0.0, "duration_s": 60.0, "distance_m": 10.0}


class Stopped(NamedTuple):
    """One try.

    answered_s: time from the order `stop` to its report COMPLETED.
    stood_s: time from the order to standing wheels; 0: they stood already.
    newcomer_s: then, still flooded, time from the start of another station to the report of its own `stop`.
    drove: True if the wheels turned when the flood began.
    faults: active at the end.
    """

    answered_s: float
    stood_s: float
    newcomer_s: float
    drove: bool
    faults: tuple[str, ...]


class Besieged(NamedTuple):
    """The tries under one flood. Ticks are the flight program's own counts, since its start.

    refused: datagrams that failed a check.
    slips: causes of missed ticks, the most frequent first.
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
        """All faults reported in the tries."""
        return tuple(sorted({name for each in self.tries for name in each.faults}))


def free_port(kind: int) -> int:
    """Return a port that is free now."""
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Siege:
    """Rover, surroundings and station, for one flood; use it inside `with`. folder: of the files."""

    def __init__(self, folder: Path, kind: str) -> None:
        self._folder, self._kind, self._stack = folder, kind, ExitStack()
        self._ends, self._flood, self._calm = (flooders.SPAWN.Event() for _ in range(3))
        self.fastest_radps = flooders.SPAWN.Value("d", 0.0)
        self._start_ns = time.monotonic_ns()
        self.session: Session
        self.disk = folder / "disk"  # everything that rover and station write
        self.record = self.disk / "onboard.mcap"

    def __enter__(self) -> Self:
        try:
            self._begin()
        except BaseException:
            self._stack.close()
            raise
        return self

    def _begin(self) -> None:
        self.disk.mkdir()
        if self._kind == "disk":
            self._mount()
        self._stack.callback(self._ends.set)
        carrier, _ = ENEMIES[self._kind]
        can, lidar = free_port(socket.SOCK_STREAM), free_port(socket.SOCK_STREAM)
        self._start(flooders.bus, can, self._flood_of("bus"), self._ends, self.fastest_radps)
        self._start(flooders.scanner, lidar, self._flood_of("scanner"), self._ends)
        link = ground = free_port(socket.SOCK_DGRAM)
        if carrier == "tcp":
            link, ground = free_port(socket.SOCK_STREAM), free_port(socket.SOCK_STREAM)
            self._start(bus_flooders.node, (link, ground), self._ends)
        self._fly(can, lidar, f"{carrier}/127.0.0.1:{link}")
        files = {"state": str(self.disk / "station"), "archive": str(self.disk / "archive.sqlite")}
        self._settings = StationSettings(
            endpoint=f"{carrier}/127.0.0.1:{ground}", bench_seed=SEED, up_bps=1e6, one_way_s=0.05, **files
        )
        self._begin_enemy(carrier, link, ground)

    def _mount(self) -> None:
        """Mount a file system of its own. Raises PermissionError if this user may not mount one."""
        words = ["mount", "-t", "tmpfs", "-o", f"size={DISK_MB}m", "none", str(self.disk)]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        if done.returncode:
            raise PermissionError(f"no disk of its own to fill: {done.stderr.strip()}; `quota` needs none")
        self._stack.callback(subprocess.run, ["umount", str(self.disk)], check=True)

    def _flood_of(self, surroundings: str) -> Event:
        """Return the flag of a surrounding: bus and scanner always exist, and flood in their own row."""
        return self._flood if surroundings == self._kind else self._calm

    def _start(self, run: Callable[..., None], *given: object) -> None:
        process = flooders.SPAWN.Process(target=run, args=given)
        process.start()
        self._stack.callback(process.join)
        self._stack.callback(self._ends.set)

    def _begin_enemy(self, carrier: str, link: int, ground: int) -> None:
        _, enemy = ENEMIES[self._kind]
        if enemy is not None:
            where = self.disk if self._kind == "disk" else (link, ground) if carrier == "tcp" else link
            self._start(enemy, where, self._flood, self._ends)

    @contextmanager
    def _stationed(self) -> Iterator[None]:
        """Run with a new station that drives the rover; another station's stop may bind an earlier one."""
        with Archive(self._settings.archive, time.time_ns()) as archive, Station(self._settings, archive) as station:
            self._station, self.session = station, station.session
            station.wait_open(LIMIT_S, LIMIT_S)
            if not self.until(lambda: station.session.commanding):
                raise RuntimeError(f"the rover was not heard: {station.session.mismatch or self._log()}")
            try:
                yield
            finally:
                self._set_flood(False)

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._flood.clear()
        self._stack.__exit__(kind, error, at)

    def _fly(self, can: int, lidar: int, link: str) -> None:
        settings = {
            "clock.mode": "wall",
            "can.uri": f"socketcand:127.0.0.1:{can}/rover",
            "lidar.address": f"tcp:127.0.0.1:{lidar}",
            "link.endpoint": link,
            "link.bench_seed": SEED,
            "record.path": self.record,
            "record.spare_bytes": 0,
            "state.folder": self.disk / "state",
            "status.socket": self._folder / "status",
        }
        words = [sys.executable, "-m", "onboard", "run", *(f"--set={name}={value}" for name, value in settings.items())]
        log = self._stack.enter_context((self.disk / "onboard.log").open("w"))
        self.flight = subprocess.Popen(
            words,
            cwd=ROOT,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
        )
        self._stack.callback(self.flight.wait)
        self._stack.callback(self.flight.terminate)

    def _set_flood(self, on: bool) -> None:
        """Switch the flood. quota: no file of the flight program may grow."""
        if on:
            self._flood.set()
        else:
            self._flood.clear()
        if self._kind == "disk" and not on:
            self.until(lambda: shutil.disk_usage(self.disk).free > DISK_MB << 19)
        if self._kind == "quota":
            hard = resource.prlimit(self.flight.pid, resource.RLIMIT_FSIZE)[1]
            resource.prlimit(self.flight.pid, resource.RLIMIT_FSIZE, (0 if on else hard, hard))

    @property
    def now_ns(self) -> int:
        """Time since the siege began, ns."""
        return time.monotonic_ns() - self._start_ns

    def until(self, done: Callable[[], bool], limit_s: float = LIMIT_S) -> bool:
        """Run the station until `done`; returns whether it was within the limit."""
        end_ns = self.now_ns + round(limit_s * 1e9)
        while not done():
            if self.now_ns > end_ns:
                return False
            self._station.turn(ClockTurn(self.now_ns, None))
            self._station.flush(self.now_ns)
            time.sleep(0.001)
        return True

    def order(self, name: str, **arguments: Any) -> Callable[[], bool]:
        """Send an order. The returned function reports whether it has ended or, if it moves the rover, begun."""
        request = self.session.request(name, arguments, self.now_ns)
        return lambda: self.session.requester.requests[request].state in (RequestState.COMPLETED, RequestState.FAILED)

    def status(self) -> dict[str, Any]:
        """Return the flight program's own status."""
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
        return (self.disk / "onboard.log").read_text()[-500:]

    def _refused(self) -> int:
        """Return the count in the rover's telemetry; on a strained computer it is sent ten times less often."""
        items = self.session.items
        if not self.until(lambda: "link_refused" in items):
            raise RuntimeError(f"no word of refused datagrams within {LIMIT_S:g} s: {self._log()}")
        return int(items["link_refused"].value)

    def attempt(self) -> Stopped:
        """Drive, flood, stop; then restore the initial state."""
        self.order("drive", **DRIVE)
        drove = self.until(lambda: self.fastest_radps.value > MOVING_RADPS, 10.0)
        self._set_flood(True)
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
            raise RuntimeError(f"under {self._kind} the rover did not stop within {LIMIT_S:g} s")
        ended_ns = self.now_ns
        newcomer_s, faults = self._newcomer(), tuple(self.status()["faults"])
        return Stopped((ended_ns - begun_ns) / 1e9, (standing_ns[0] - begun_ns) / 1e9, newcomer_s, drove, faults)

    def _newcomer(self) -> float:
        """Run `ground stop`, without the start of its process."""
        plan = Plan(tuple(parse("stop", "floods")), contact_s=LIMIT_S, limit_s=LIMIT_S)
        begun_ns = self.now_ns
        code, _ = operate(self._settings, plan, Teller(lambda _: None, False, 1e9))
        if code:
            raise RuntimeError(f"under {self._kind} another station could not stop the rover: exit code {code}")
        return (self.now_ns - begun_ns) / 1e9

    def _make_ready(self) -> None:
        """Wait for STANDBY without a fault that prevents driving; the flood before has drained by then."""

        def ready() -> bool:
            told = self.status()
            well = {*told["faults"]} <= MACHINE
            if told["mode"] == "SAFE" and well:
                self.until(self.order("resume"), 5.0)
            return bool(told["mode"] == "STANDBY" and well)

        if not self.until(ready):
            raise RuntimeError(f"not ready within {LIMIT_S:g} s: {self.status()['mode']}, {self.status()['faults']}")

    def keep(self, record: Path) -> None:
        """End the flight program and copy its record, before its disk is unmounted."""
        self.flight.terminate()
        self.flight.wait()
        shutil.copy(self.record, record)

    def besiege(self, tries: int) -> Besieged:
        """Run the tries."""
        with self._stationed():
            self._make_ready()
            before, rss_before = self.status()["ticks"], taken(self.flight.pid, 0.0).rss_bytes
        got, rss_after = list[Stopped](), rss_before
        for _ in range(tries):
            with self._stationed():
                self._make_ready()
                got.append(self.attempt())
                rss_after = max(rss_after, taken(self.flight.pid, 0.0).rss_bytes)
                after, refused = self.status()["ticks"], self._refused()
        return Besieged(
            self._kind,
            tuple(got),
            rss_before / MB,
            rss_after / MB,
            before["worst_ms"],
            after["worst_ms"],
            before["slipped"],
            after["slipped"],
            refused,
            tuple(f"{slip['cause']} {slip['ticks']}, {slip['worst_ms']:.0f} ms" for slip in after["slips"]),
        )
