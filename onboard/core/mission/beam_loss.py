"""Loss of scanner beams in a mission, and the measures against it by level: a table and a small state machine.

    level  from the share lost      measure
    0                               one sweep, as configured
    1      lost_beams.slow_ratio    a sweep at half the rate
    2      lost_beams.second_ratio  and a second one from the same place
    3      lost_beams.short_ratio   and shorter legs over a shorter trusted range
    4      lost_beams.stop_ratio    in the last sweep of the stop, by the window or the scanner itself: the mission
                                    ends, LIDAR_DIRTY

The level rises at once to that of the newest sweep's share and falls by one with each sweep under it. The share is
that of the ground within 4 m, all directions together (`perception.scan.lost_beams`). Single directions matter when the
mission rule gives up: if the scanner saw too little of that side, this is the reported reason, after
`lost_beams.looks` further looks.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from onboard.config import Config, Scanning
from onboard.config import LostBeams as Limits
from onboard.native.elementary import dist
from onboard.perception.scan.loss_cause import Cause, SweepLoss, cause, direction
from onboard.perception.scan.lost_beams import BANDS_M, LostBeams
from onboard.perception.scan.sweep import TiltSegment, segments
from onboard.planning.plan_records import PlanResult
from onboard.records import Decision, Path, Pose
from protocol.conventions import wrap_rad

Point = tuple[float, float]
VIEWS = 8  # newest sweeps that are stored
HERE_M = 1.0  # sweeps within this distance judge a far goal
SLOWER = 2  # factor on the number of lines
LOOK_LEVEL = 2  # least level of a further look before the end
ITS_OWN = frozenset({Cause.BLIND, Cause.WINDOW})  # causes that move with the scanner


class Level(NamedTuple):
    """One row. from_ratio: name of its share lost in the configuration."""

    from_ratio: str
    slow: bool = False
    sweeps: int = 1
    short: bool = False
    stop: bool = False


LEVELS = (
    Level(""),
    Level("slow_ratio", slow=True),
    Level("second_ratio", slow=True, sweeps=2),
    Level("short_ratio", slow=True, sweeps=2, short=True),
    Level("stop_ratio", slow=True, sweeps=2, short=True, stop=True),
)


def next_level(level: int, lost_ratio: float, limits: Limits) -> int:
    """Return the level after a sweep that lost this share."""
    reached: int = sum(lost_ratio > getattr(limits, row.from_ratio) for row in LEVELS[1:])
    return max(reached, level - 1)


class Seeing:
    """State of one mission's beam loss. dirty: reason if the mission ended for beam loss, else ''."""

    def __init__(self, config: Config) -> None:
        self._config, self._limits = config, config.lost_beams
        self.level = 0
        self.dirty = ""
        self.looks = 0
        self._views: tuple[SweepLoss, ...] = ()
        self._taken = 0  # sweeps from this place
        self._least = 0  # least level during a further look
        self._nods: dict[bool, tuple[TiltSegment, ...]] = {}

    @property
    def row(self) -> Level:
        """The row of the present level."""
        return LEVELS[self.level]

    @property
    def nod(self) -> tuple[TiltSegment, ...]:
        """Segments of the next sweep; the first call takes half a tick."""
        slow = self.row.slow
        if slow not in self._nods:
            self._nods[slow] = segments(
                slower(self._config) if slow else self._config.scanning, self._config.rover.lidar_z_m
            )
        return self._nods[slow]

    @property
    def config(self) -> Config:
        """Configuration for map and plan at this level."""
        whole, limits = self._config, self._limits
        if not self.row.short:
            return whole
        scanning = replace(whole.scanning, range_m=min(whole.scanning.range_m, limits.short_range_m))
        return replace(
            whole, scanning=scanning, mission=replace(whole.mission, leg_m=min(whole.mission.leg_m, limits.short_leg_m))
        )

    def note(self, lost: LostBeams, pose: Pose) -> str:
        """Add a sweep that is in the map. Returns the text to report, '' if the level stays."""
        self._views = (*self._views[1 - VIEWS :], SweepLoss(lost, pose))
        self._taken += 1
        before, self.level = self.level, max(self._least, next_level(self.level, lost.ratio, self._limits))
        if self.level == before:
            return ""
        return f"level {self.level}: {self._loss()}"

    def sweep_again(self) -> bool:
        """Return whether this place needs another sweep; if not, reset the count."""
        again = self._taken < self.row.sweeps
        if not again:
            self._taken = self._least = 0
        return again

    def ended(self) -> str:
        """Return the reason to end the mission after the last sweep of a place, '' if it goes on.

        It goes on if dark ground or sunlight takes the beams, or may take them: elsewhere the scanner sees more.
        """
        if self.row.stop and self._why() in ITS_OWN:
            self.dirty = f"the scanner sees too little: {self._loss()}"
        return self.dirty

    def judged(self, result: PlanResult, pose: Pose) -> PlanResult:
        """Return the plan's result with the true reason if the rule gives up and the scanner did not see that side.

        Up to `looks` times, a look towards that side replaces the end; marks and tries are cleared.
        """
        decision, state = result.decision, result.state
        if decision.kind != "unreachable":
            return result
        side = self._unseen((result.goal_m, *state.marked, *state.targets), pose)
        if side is None:
            return result
        bearing_rad, share = side
        words = (
            f"the scanner saw too little of this side: {100 * share:.0f} % lost towards "
            f"{math.degrees(bearing_rad):+.0f} degrees ({self._why().value})"
        )
        if self.looks < self._limits.looks and state.number <= self._config.mission.stop_limit:
            self.looks += 1
            self._least = LOOK_LEVEL
            self.level = max(self.level, LOOK_LEVEL)
            stay = Path(np.array([[pose.x_m, pose.y_m, pose.yaw_rad]]))
            look = Decision(
                "drive", "R11", f"{words}; look {self.looks} of {self._limits.looks} again", stay, bearing_rad
            )
            return replace(result, decision=look, state=replace(state, marked=(), tried=(), targets=()))
        self.dirty = words
        nearest = decision.reason.partition("; ")[2]
        limit = f"; {self._config.mission.stop_limit} stops are the limit (mission.stop_limit)"
        over = limit if state.number > self._config.mission.stop_limit else ""
        return replace(result, decision=replace(decision, reason=f"{words}{over}; {nearest}"))

    def digest_items(self) -> tuple[float, ...]:
        """Values of this state that go into the state digest."""
        newest = self._views[-1].lost.ratio if self._views else 0.0
        return self.level, self.looks, self._taken, self._least, bool(self.dirty), len(self._views), newest

    def _unseen(self, points: Sequence[Point], pose: Pose) -> tuple[float, float] | None:
        """Return (bearing in the map from here, share lost) of the point seen worst; None: all were seen.

        Of the looks at one point the best counts.
        """
        worst: tuple[float, float] | None = None
        for x_m, y_m in points:
            azimuth_rad, _ = direction(pose, x_m, y_m)
            shares = [share for view in self._views if math.isfinite(share := _share(view, (x_m, y_m), pose))]
            if shares and min(shares) > self._limits.side_ratio and (worst is None or min(shares) > worst[1]):
                worst = wrap_rad(azimuth_rad + pose.yaw_rad), min(shares)
        if worst is None and self._views and self._views[-1].lost.ratio > self._limits.side_ratio:
            return pose.yaw_rad, self._views[-1].lost.ratio
        return worst

    def _why(self) -> Cause:
        return cause(self._views, self._limits.slow_ratio)

    def _loss(self) -> str:
        lost = self._views[-1].lost
        words = f"{100 * lost.ratio:.0f} % of near beams lost"
        if np.isfinite(lost.sectors).any():
            worst = int(np.nanargmax(lost.sectors))
            words += f", {100 * lost.sectors[worst]:.0f} % at {math.degrees(lost.azimuth_rad(worst)):+.0f} degrees"
        return f"{words} ({self._why().value})"


def slower(config: Config) -> Scanning:
    """Return the settings of a sweep at half the rate: twice the lines."""
    whole = config.scanning
    return replace(
        whole, spacing_m=whole.spacing_m / SLOWER, floor_rad=whole.floor_rad / SLOWER, cap_rad=whole.cap_rad / SLOWER
    )


def _share(view: SweepLoss, point: Point, pose: Pose) -> float:
    """Share lost towards a point; NaN if the view does not cover it: outside its sector, or taken too far away."""
    azimuth_rad, range_m = direction(view.pose, *point)
    near = dist((pose.x_m, pose.y_m), (view.pose.x_m, view.pose.y_m)) <= HERE_M
    if range_m > BANDS_M[-1] and not near:
        return math.nan
    return view.lost.towards(azimuth_rad, range_m)
