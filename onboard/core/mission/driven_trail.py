"""Driven path of a mission: the trail (R2), and at finer steps the part since the last scan, for backing off.

o----o----o----o---R    0.05 m apart, or 6 degrees of a turn on the spot; from R (the rover) back is the retreat
"""

from __future__ import annotations

import math

import numpy as np

from onboard.native.elementary import dist
from onboard.records import F64, Path, Pose
from protocol.conventions import wrap_rad

TRAIL_M, TRAIL_POSES = 0.1, 400
STEP_M, STEP_RAD = 0.05, math.radians(6.0)
SPOT_M = 0.01  # a turn within this distance is one on the spot, and is turned back at one place


class DrivenTrail:
    """Driven path; call `note` each tick, `begin` when a scan begins. since_look_m: distance since the last look."""

    def __init__(self, since_look_m: float) -> None:
        self.since_look_m = since_look_m
        self._trail: list[tuple[float, float, float]] = []
        self._known = 0  # poses of the trail up to the last correction
        self._fine: list[tuple[float, float, float]] = []
        self._here = (0.0, 0.0, 0.0)

    @property
    def trail(self) -> F64:
        """The newest 400 poses driven in this mission, (k, 3) x m, y m, yaw rad."""
        return np.array(self._trail[-TRAIL_POSES:]).reshape(-1, 3)

    def begin(self) -> None:
        """Begin at this place: the rover stands and scans, and will not back off farther than to here."""
        self._fine.clear()

    def note(self, pose: Pose) -> None:
        """Record the rover's present pose."""
        here = self._here = (pose.x_m, pose.y_m, pose.yaw_rad)
        way_m = dist(here[:2], self._trail[-1][:2]) if self._trail else 0.0
        if way_m >= TRAIL_M or not self._trail:
            self._trail.append(here)
            self.since_look_m += way_m
        last = self._fine[-1] if self._fine else None
        if last is None or dist(here[:2], last[:2]) >= STEP_M:
            self._fine.append(here)
        elif abs(wrap_rad(here[2] - last[2])) >= STEP_RAD:
            place = last if dist(here[:2], last[:2]) < SPOT_M else here
            self._fine.append((*place[:2], here[2]))

    def correct(self, pose: Pose) -> None:
        """Bend the path driven since the last correction so that it ends at the registered pose; the rover stands.

        The error grows along the path, so each pose gets its share of the shift in proportion to the distance.
        """
        shift = (pose.x_m - self._here[0], pose.y_m - self._here[1], wrap_rad(pose.yaw_rad - self._here[2]))
        since = len(self._trail) - self._known
        for k in range(since):
            share = (k + 1) / since
            x_m, y_m, yaw_rad = self._trail[self._known + k]
            bent = (x_m + share * shift[0], y_m + share * shift[1], wrap_rad(yaw_rad + share * shift[2]))
            self._trail[self._known + k] = bent
        self._known = len(self._trail)
        self._here = (pose.x_m, pose.y_m, pose.yaw_rad)
        self._fine.clear()
        self.since_look_m = 0.0

    def back(self, way_m: float) -> Path:
        """Path back as driven since `begin`, at most `way_m`; without stations if the rover only turned."""
        poses, left_m = [self._here], way_m
        for before in reversed(self._fine):
            at, step_m = poses[-1], dist(before[:2], poses[-1][:2])
            if step_m > left_m:
                share = left_m / step_m
                turn_rad = share * wrap_rad(before[2] - at[2])
                x_m, y_m = (a + share * (b - a) for a, b in zip(at[:2], before[:2]))
                poses.append((x_m, y_m, at[2] + turn_rad))
                break
            poses.append(before)
            left_m -= step_m
        while len(poses) > 1 and poses[-1][:2] == poses[-2][:2]:  # a turn at the end is not needed
            poses.pop()
        return Path(np.array(poses if len(poses) > 1 else []).reshape(-1, 3))
