"""What is known of a run so far, as plain data, and how it stood at any time of it."""

from __future__ import annotations

from bisect import bisect_right, insort
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from hil.bench.truth import Met, Patch
from onboard.planning.archive import PlanPicture
from onboard.records import F32, F64, Grid

STEP_M = 0.05  # of the ways that are drawn
LAST_TURN_S = 0.3  # outside a sweep a turn of the scanner is shown for so long
TOLD = 9  # events shown at once


@dataclass(frozen=True, slots=True)
class TrueGround:
    """The true ground. heights_m: (rows, columns) float32. rocks: (n, 3) x, y, diameter."""

    grid: Grid
    heights_m: F32
    rocks: F64
    goal_m: tuple[float, float]


def changed(ground: TrueGround, patches: Sequence[Patch]) -> TrueGround:
    """The ground after these changes. Raises ValueError for one that does not lie on it."""
    heights_m = ground.heights_m.copy()
    for patch in patches:
        rows, columns = patch.heights_m.shape
        heights_m[patch.row : patch.row + rows, patch.column : patch.column + columns] = patch.heights_m
    return replace(ground, heights_m=heights_m) if patches else ground


class Moment(NamedTuple):
    """Where the rover truly was. rockers_rad: left, right; steer_rad, wheel_rad: of wheels 1 to 4."""

    time_s: float
    position_m: tuple[float, ...]
    quaternion_xyzw: tuple[float, ...]
    rockers_rad: tuple[float, ...]
    steer_rad: tuple[float, ...]
    wheel_rad: tuple[float, ...]
    contact: str


class Told(NamedTuple):
    """An event of the rover, or what the bench did to it: then `severity` is 'fault'."""

    time_s: float
    severity: str
    name: str
    text: str


@dataclass(frozen=True, slots=True)
class Instant:
    """How a run stood. turns: of the running sweep, or the last one. way, believed_way: (k, 3) so far, true and as the
    flight program believes it. plan: the last one, with its number from 1 (0 none). faults: those that last. patches:
    how the ground has changed.
    """

    time_s: float
    moment: Moment
    turns: tuple[Met, ...]
    plan: PlanPicture | None
    plan_number: int
    told: tuple[Told, ...]
    faults: tuple[str, ...]
    way: F64
    believed_way: F64
    patches: tuple[Patch, ...] = ()


class Way:
    """A way as points STEP_M or more apart, with their times."""

    def __init__(self) -> None:
        self._times_s: list[float] = []
        self._points_m: list[F64] = []

    def add(self, time_s: float, point_m: Any) -> None:
        """One place more; (3,)."""
        point = np.asarray(point_m, np.float64)
        if not self._points_m or np.abs(point - self._points_m[-1]).max() >= STEP_M:
            self._times_s.append(time_s)
            self._points_m.append(point)

    def until(self, time_s: float) -> F64:
        """(k, 3)."""
        return np.array(self._points_m[: bisect_right(self._times_s, time_s)]).reshape(-1, 3)


@dataclass(slots=True)
class Story:
    """Everything read so far, each list in the order of time."""

    moments: list[Moment] = field(default_factory=list)
    turns: list[tuple[float, Met]] = field(default_factory=list)
    plans: list[tuple[float, PlanPicture]] = field(default_factory=list)
    told: list[Told] = field(default_factory=list)
    faults: list[tuple[float, str, bool]] = field(default_factory=list)
    patches: list[tuple[float, Patch]] = field(default_factory=list)
    way: Way = field(default_factory=Way)
    believed_way: Way = field(default_factory=Way)

    @property
    def end_s(self) -> float:
        """How far it goes; 0 when nothing is known."""
        return self.moments[-1].time_s if self.moments else 0.0

    def add_moment(self, moment: Moment) -> None:
        """The truth, in order."""
        self.moments.append(moment)
        self.way.add(moment.time_s, moment.position_m)

    def tell(self, told: Told) -> None:
        """An event, from whichever record: they need not come in order."""
        insort(self.told, told, key=lambda row: row.time_s)

    def at(self, time_s: float) -> Instant | None:
        """How it stood; before its first moment as in that one. None when nothing is known."""
        if not self.moments:
            return None
        moment = self.moments[max(0, _until(self.moments, time_s) - 1)]
        plans, told = _until(self.plans, time_s), _until(self.told, time_s)
        return Instant(
            time_s, moment, self._turns(time_s), self.plans[plans - 1][1] if plans else None, plans,
            tuple(self.told[max(0, told - TOLD) : told]), self._lasting(time_s),
            self.way.until(time_s), self.believed_way.until(time_s),
            tuple(patch for _, patch in self.patches[: _until(self.patches, time_s)]),
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
    """How many rows are not after it; a row's first entry is its time."""
    return bisect_right(rows, time_s, key=lambda row: row[0])
