"""Path driven from the start of the run, for the return: a pose every 0.05 m, or 6 degrees of a turn on the spot.

A path that comes back to an earlier place and heading closes a loop, and the loop is removed. The buffer has room for
2 km; when it is full, every second pose of it is removed.
"""

from __future__ import annotations

import numpy as np

from onboard.core.mission.driven_trail import SPOT_M, STEP_M, STEP_RAD
from onboard.native import each
from onboard.native.elementary import hypot
from onboard.records import F64, Pose
from protocol.conventions import wrap_rad

_MOST = 40_000
_SAME_M, _SAME_RAD = 0.02, 0.05
_JUST_NOW = 8  # newest poses, which form no loop


class Track:
    """Driven path; call `note` each tick, `correct` after a registration, `back` for the path to the start."""

    def __init__(self) -> None:
        self._poses = np.empty((_MOST, 3))
        self._count = 0
        self._known = 0  # poses up to the last correction
        self._here = (0.0, 0.0, 0.0)

    def __len__(self) -> int:
        return self._count

    def note(self, pose: Pose) -> None:
        """Record the rover's present pose."""
        x, y, yaw = self._here = (pose.x_m, pose.y_m, pose.yaw_rad)
        if self._count:
            last_x, last_y, last_yaw = self._poses[self._count - 1].tolist()
            moved_m = hypot(x - last_x, y - last_y)
            if moved_m < STEP_M and abs(wrap_rad(yaw - last_yaw)) < STEP_RAD:
                return
            if moved_m < SPOT_M:
                x, y = last_x, last_y
            self._forget_loop(x, y, yaw)
        if self._count == _MOST:
            self._poses[: _MOST // 2] = self._poses[::2]
            self._count, self._known = _MOST // 2, self._known // 2
        self._poses[self._count] = x, y, yaw
        self._count += 1

    def _forget_loop(self, x_m: float, y_m: float, yaw_rad: float) -> None:
        old = self._poses[: max(0, self._count - _JUST_NOW)]
        turned = np.abs((old[:, 2] - yaw_rad + np.pi) % (2 * np.pi) - np.pi)
        same = (each.hypot(old[:, 0] - x_m, old[:, 1] - y_m) <= _SAME_M) & (turned <= _SAME_RAD)
        if same.any():
            self._count = int(np.argmax(same))
            self._known = min(self._known, self._count)

    def correct(self, pose: Pose) -> None:
        """Bend the path driven since the last correction so that it ends at the registered pose; the rover stands."""
        shift = np.array([pose.x_m - self._here[0], pose.y_m - self._here[1], wrap_rad(pose.yaw_rad - self._here[2])])
        since = self._count - self._known
        self._poses[self._known : self._count] += np.arange(1, since + 1)[:, None] / max(1, since) * shift
        self._known, self._here = self._count, (pose.x_m, pose.y_m, pose.yaw_rad)

    def back(self) -> F64:
        """(k, 3) x m, y m, yaw rad from here to the start: the poses as driven, the newest first."""
        return self._poses[: self._count][::-1].copy()
