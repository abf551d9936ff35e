"""Data of a run so far, and its state at any time."""

from __future__ import annotations

from bisect import bisect_right, insort
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from hil.view.doing import after
from hil.world.truth import Met, Patch
from onboard.planning.archive import PlanPicture
from onboard.records import F32, F64, Grid
from protocol.tables.modes import Mode

STEP_M = 0.05  # step of the drawn paths
LAST_TURN_S = 0.3  # outside a sweep a turn of the scanner is shown for this time
TOLD = 9  # events shown at once


@dataclass(frozen=True, slots=True)
class TrueGround:
    """True ground of a run.

    grid: grid of heights_m
    heights_m: (rows, columns) float32
    rocks: (n, 3) x, y, diameter
    goal_m: x, y of the goal
    """

    grid: Grid
    heights_m: F32
    rocks: F64
    goal_m: tuple[float, float]


def changed(ground: TrueGround, patches: Sequence[Patch]) -> TrueGround:
    """Ground after these changes. Raises ValueError for a change that does not lie on it."""
    heights_m = ground.heights_m.copy()
    for patch in patches:
        rows, columns = patch.heights_m.shape
        heights_m[patch.row : patch.row + rows, patch.column : patch.column + columns] = patch.heights_m
    return replace(ground, heights_m=heights_m) if patches else ground


class Moment(NamedTuple):
    """True state of the rover.

    time_s: time
    position_m, quaternion_xyzw: pose of base_link, map frame
    rockers_rad: left, right
    steer_rad, wheel_rad: of wheels 1 to 4
    contact: contacts for people, or ''
    """

    time_s: float
    position_m: tuple[float, ...]
    quaternion_xyzw: tuple[float, ...]
    rockers_rad: tuple[float, ...]
    steer_rad: tuple[float, ...]
    wheel_rad: tuple[float, ...]
    contact: str


class StoryEvent(NamedTuple):
    """Event of the rover, or an action of the bench: then `severity` is 'fault'."""

    time_s: float
    severity: str
    name: str
    text: str


@dataclass(frozen=True, slots=True)
class Instant:
    """State of a run at one time.

    time_s: the time
    moment: true state of the rover
    turns: turns of the running sweep, or the last turn
    plan: last plan, or None
    plan_number: its number from 1, 0 for none
    told: newest events
    faults: active faults
    way, believed_way: (k, 3) path so far, true and as estimated by the flight program
    patches: changes of the ground so far
    mode: mode and phase that the flight program reports, '' if unknown
    """

    time_s: float
    moment: Moment
    turns: tuple[Met, ...]
    plan: PlanPicture | None
    plan_number: int
    told: tuple[StoryEvent, ...]
    faults: tuple[str, ...]
    way: F64
    believed_way: F64
    patches: tuple[Patch, ...] = ()
    mode: str = ""


class PathSoFar:
    """Path as points STEP_M or more apart, with their times."""

    def __init__(self) -> None:
        self._times_s: list[float] = []
        self._points_m: list[F64] = []

    def add(self, time_s: float, point_m: Any) -> None:
        """Add a place, (3,)."""
        point = np.asarray(point_m, np.float64)
        if not self._points_m or np.abs(point - self._points_m[-1]).max() >= STEP_M:
            self._times_s.append(time_s)
            self._points_m.append(point)

    def until(self, time_s: float) -> F64:
        """Points up to `time_s`, (k, 3)."""
        return np.array(self._points_m[: bisect_right(self._times_s, time_s)]).reshape(-1, 3)


@dataclass(slots=True)
class Story:
    """All data read so far, each list in the order of time."""

    moments: list[Moment] = field(default_factory=list)
    turns: list[tuple[float, Met]] = field(default_factory=list)
    plans: list[tuple[float, PlanPicture]] = field(default_factory=list)
    told: list[StoryEvent] = field(default_factory=list)
    faults: list[tuple[float, str, bool]] = field(default_factory=list)
    patches: list[tuple[float, Patch]] = field(default_factory=list)
    way: PathSoFar = field(default_factory=PathSoFar)
    believed_way: PathSoFar = field(default_factory=PathSoFar)

    @property
    def end_s(self) -> float:
        """Newest time; 0 if nothing is known."""
        return self.moments[-1].time_s if self.moments else 0.0

    def add_moment(self, moment: Moment) -> None:
        """Add a true state; call in the order of time."""
        self.moments.append(moment)
        self.way.add(moment.time_s, moment.position_m)

    def tell(self, told: StoryEvent) -> None:
        """Add an event of any record, in any order of time."""
        insort(self.told, told, key=lambda row: row.time_s)

    def at(self, time_s: float) -> Instant | None:
        """State at a time; before the first moment the state of that one. None if nothing is known."""
        if not self.moments:
            return None
        moment = self.moments[max(0, _until(self.moments, time_s) - 1)]
        plans, told = _until(self.plans, time_s), _until(self.told, time_s)
        return Instant(
            time_s,
            moment,
            self._turns(time_s),
            self.plans[plans - 1][1] if plans else None,
            plans,
            tuple(self.told[max(0, told - TOLD) : told]),
            self._lasting(time_s),
            self.way.until(time_s),
            self.believed_way.until(time_s),
            tuple(patch for _, patch in self.patches[: _until(self.patches, time_s)]),
            _mode(self.told[:told]),
        )

    def _turns(self, time_s: float) -> tuple[Met, ...]:
        end = _until(self.turns, time_s)
        if end == 0:
            return ()
        last_s, last = self.turns[end - 1]
        if last.sweep == 0:
            return (last,) if time_s - last_s <= LAST_TURN_S else ()
        begin = end
        while begin and self.turns[begin - 1][1].sweep == last.sweep:
            begin -= 1
        return tuple(met for _, met in self.turns[begin:end])

    def _lasting(self, time_s: float) -> tuple[str, ...]:
        lasting: dict[str, None] = {}
        for _, name, begins in self.faults[: _until(self.faults, time_s)]:
            if begins:
                lasting[name] = None
            else:
                lasting.pop(name, None)
        return tuple(lasting)


def _until(rows: list[Any], time_s: float) -> int:
    """Number of rows up to `time_s`; a row's first entry is its time."""
    return bisect_right(rows, time_s, key=lambda row: row[0])


def _mode(told: Sequence[StoryEvent]) -> str:
    """Mode and phase after these events; '' before the first."""
    mode, phase = Mode.STANDBY.name, ""
    for one in told:
        mode, phase = after(mode, phase, one.name, one.text)
    return f"{mode} {phase}".strip() if told else ""
