"""TABLE of the fault injections: fault name -> functions that cause and heal it."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Protocol

from hil.devices.lidar.faults import KINDS
from hil.faults import ground_faults
from hil.faults.can_faults import CAUSES, CanCause
from hil.faults.computer_faults import COMPUTER_FAULTS
from hil.faults.disk_faults import DISK_FAULTS
from hil.faults.node_faults import NODE_FAULTS
from hil.faults.plan import Injection
from hil.faults.wheel_faults import WHEEL_FAULTS
from hil.world.world import World
from onboard.config import ConfigError

NS = 1_000_000_000
LATE_TICKS = 150
WHEELS = (1, 4)  # targets of a wheel's faults


class Processes(Protocol):
    """Control of the processes that run with the bench."""

    def kill(self, name: str) -> None:
        """Kill at once, as `kill -9` does."""

    def restart(self, name: str) -> None:
        """Start a killed process again with the same arguments."""


@dataclass(frozen=True, slots=True)
class Cause:
    """Functions that begin and heal a fault.

    means: description for people
    targets: the first and the last target (wheel, node, CAN id, percent); empty: it needs none
    quick_only: has no effect over sockets, where lock-step waits for late results and the disk is this machine's
    never_quick: has no effect in one process
    """

    means: str
    begin: Callable[[World, Processes, int], None]
    heal: Callable[[World, Processes, int], None]
    targets: tuple[int, ...] = ()
    quick_only: bool = False
    never_quick: bool = False

    def refuses(self, target: int) -> str:
        """Why it cannot have this target; empty if it can."""
        if not self.targets or self.targets[0] <= target <= self.targets[-1]:
            return ""
        return f"should be {self.targets[0]} to {self.targets[-1]}"


def _unplug(bench: World, _p: Processes, _t: int) -> None:
    bench.wires.lidar_plugged = False


def _plug(bench: World, _p: Processes, _t: int) -> None:
    bench.wires.lidar_plugged = True


def _silence_wheel(bench: World, _p: Processes, target: int) -> None:
    bench.nodes.wheels[target - 1].silent = True


def _unsilence_wheel(bench: World, _p: Processes, target: int) -> None:
    bench.nodes.wheels[target - 1].silent = False


def _kill_onboard(bench: World, processes: Processes, _t: int) -> None:
    processes.kill("onboard")
    bench.lose("onboard")


def _be_late(bench: World, _p: Processes, _t: int) -> None:
    bench.wires.jobs_late_ticks = LATE_TICKS


def _be_in_time(bench: World, _p: Processes, _t: int) -> None:
    bench.wires.jobs_late_ticks = 0


def _restart_onboard(bench: World, processes: Processes, _t: int) -> None:
    processes.restart("onboard")
    bench.regain("onboard")


def _nothing(_b: World, _p: Processes, _t: int) -> None:
    """Heal nothing: the effect is permanent."""


def _of_lidar(kind: str) -> Cause:
    """Fault of the emulated scanner, with its default value."""

    def begin(bench: World, _p: Processes, _t: int) -> None:
        bench.lidar.faults.begin(bench.lidar, kind)

    def heal(bench: World, _p: Processes, _t: int) -> None:
        bench.lidar.faults.end(bench.lidar, kind)

    row = KINDS[kind]
    return Cause(f"the LIDAR's {kind}, {row.value}: {row.means}", begin, heal)


def _of_wheels(name: str) -> Cause:
    row = WHEEL_FAULTS[name]
    return Cause(
        row.means,
        lambda bench, _p, target: row.begin(bench, target),
        lambda bench, _p, target: row.heal(bench, target),
        () if row.of_ground else WHEELS,
    )


def _of_node(name: str) -> Cause:
    row = (NODE_FAULTS | COMPUTER_FAULTS)[name]
    return Cause(row.means, lambda bench, _p, _t: row.begin(bench), lambda bench, _p, _t: row.heal(bench))


def _of_disk(name: str) -> Cause:
    refuses, means = DISK_FAULTS[name]

    def begin(bench: World, _p: Processes, _t: int) -> None:
        bench.disk.refuses = refuses

    def heal(bench: World, _p: Processes, _t: int) -> None:
        bench.disk.refuses = 0

    return Cause(means, begin, heal, quick_only=True)


def _of_can(cause: CanCause) -> Cause:
    return Cause(
        cause.means,
        lambda bench, _, target: cause.begin(bench.can, target),
        lambda bench, _, target: cause.heal(bench.can, target),
        cause.targets,
    )


def _of_ground(kind: str) -> Cause:
    """Change of the ground on the route to the goal."""
    put = ground_faults.before_the_goal(kind)
    return Cause(f"a {kind} across the straight way to the goal", lambda bench, _p, _t: put(bench), _nothing)


INJECTIONS: Mapping[str, Cause] = {
    "lidar_unplugged": Cause("the LIDAR's cable is pulled", _unplug, _plug),
    "wheel_silent": Cause("one wheel node sends nothing more", _silence_wheel, _unsilence_wheel, WHEELS),
    "onboard_killed": Cause("the flight program gets SIGKILL", _kill_onboard, _nothing),
    "job_late": Cause("the results of long work come 1.5 s after their tick", _be_late, _be_in_time, quick_only=True),
    "ground_collapse": Cause("the ground under the left wheels gives way", ground_faults.collapse, _nothing),
    "onboard_restarted": Cause("SIGKILL, then a new start", _kill_onboard, _restart_onboard, never_quick=True),
    **{name: _of_wheels(name) for name in WHEEL_FAULTS},
    **{name: _of_node(name) for name in (*NODE_FAULTS, *COMPUTER_FAULTS)},
    **{name: _of_disk(name) for name in DISK_FAULTS},
    **{name: _of_can(cause) for name, cause in CAUSES.items()},
    **{f"ground_{kind}": _of_ground(kind) for kind in ground_faults.KINDS},
    **{f"lidar_{kind}": _of_lidar(kind) for kind in KINDS if kind != "cable"},  # cable is lidar_unplugged
}


def _check(faults: Iterable[Injection]) -> None:
    for fault in faults:
        if fault.fault not in INJECTIONS:
            near = difflib.get_close_matches(fault.fault, INJECTIONS, n=1)
            hint = f"did you mean `{near[0]}`?" if near else f"should be one of {', '.join(INJECTIONS)}"
            raise ConfigError(f"faults.fault = {fault.fault!r}: {hint}")
        if why := INJECTIONS[fault.fault].refuses(fault.target):
            raise ConfigError(f"faults.target = {fault.target} of {fault.fault}: {why}")


def causes(faults: Iterable[Injection]) -> tuple[Cause, ...]:
    """The row of each fault, in order. Raises ConfigError for an unknown one, with the nearest name, or its target."""
    faults = tuple(faults)
    _check(faults)
    return tuple(INJECTIONS[fault.fault] for fault in faults)


class Injector:
    """Runs a scenario's faults in bench time. log: begin and heal of each fault, with its time."""

    def __init__(self, faults: tuple[Injection, ...]) -> None:
        _check(faults)
        self._waiting = list(faults)
        self._running: list[tuple[int, Injection]] = []
        self._first_ns: dict[str, int] = {"time": 0}
        self.log: list[dict[str, object]] = []

    def step(self, bench: World, processes: Processes, now_ns: int) -> None:
        """Begin and heal the faults that are due; call before each tick."""
        for name, holds in (("sweep", bench.progress.sweeping), ("drive", bench.progress.driving)):
            if holds:
                self._first_ns.setdefault(name, now_ns)
        for fault in [f for f in self._waiting if self._due(f, now_ns)]:
            self._waiting.remove(fault)
            INJECTIONS[fault.fault].begin(bench, processes, fault.target)
            self._running.append((now_ns + int(fault.for_s * NS), fault))
            self._note(bench, now_ns, fault, "begin")
        for end_ns, fault in [row for row in self._running if now_ns >= row[0]]:
            self._running.remove((end_ns, fault))
            INJECTIONS[fault.fault].heal(bench, processes, fault.target)
            self._note(bench, now_ns, fault, "heal")

    def _note(self, bench: World, now_ns: int, fault: Injection, what: str) -> None:
        self.log.append({"t_s": now_ns / NS, "fault": fault.fault, "target": fault.target, "what": what})
        bench.truth.add_fault(now_ns, self.log[-1])

    def _due(self, fault: Injection, now_ns: int) -> bool:
        start_ns = self._first_ns.get(fault.when)
        return start_ns is not None and now_ns >= start_ns + int(fault.after_s * NS)
