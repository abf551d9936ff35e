"""Mission that returns to the start of the run along the driven path, with the headings as driven: mostly backwards.

It scans and registers before each leg of at most `mission.leg_m`. It uses no planner: the ground has been driven. The
drive guard is off: it would look the other way. A keep-out fence across the path ends the mission.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from onboard.config import Config
from onboard.core.context import Context
from onboard.core.mission.mission import Mission
from onboard.native import each
from onboard.native.elementary import dist
from onboard.planning.fences import entered
from onboard.records import F64, Gdem, Path, Pose, Twist
from protocol.tables.modes import Phase

if TYPE_CHECKING:
    from onboard.perception.map.stop_map import StopMap

_SEARCH_M = 1.5  # how far along the path back the rover may already be, after an interrupted leg


class GoBack(Mission):
    """Return mission. way: (k, 3) poses to the start (x m, y m, yaw rad), the nearest first."""

    done, plans = "returned", False

    def __init__(self, config: Config, gdem: Gdem | None, way: F64, memory: StopMap | None) -> None:
        start = (float(way[-1, 0]), float(way[-1, 1]))
        super().__init__(config, gdem, start, memory)
        self._way_back, self._back_leg = way, Path(way[:1])

    def _begin(self, ctx: Context) -> None:
        self._behind_wanted = False
        self._scan()

    def _plan(self, ctx: Context) -> None:
        pose = ctx.localisation.pose
        steps = each.hypot(*np.diff(self._way_back[:, :2], axis=0).T)
        along_m = np.concatenate([[0.0], np.cumsum(steps)])
        near = self._way_back[along_m <= self._config.mission.leg_m + _SEARCH_M]
        first = int(np.argmin(each.hypot(near[:, 0] - pose.x_m, near[:, 1] - pose.y_m)))
        self._way_back, along_m = self._way_back[first:], along_m[first:] - along_m[first]
        last = int(np.searchsorted(along_m, self._config.mission.leg_m, side="right"))
        leg = self._way_back[:last]
        for x_m, y_m, yaw_rad in leg.tolist():
            name = entered(ctx.fences, Pose(x_m, y_m, yaw_rad=yaw_rad), self._config.rover)
            if name:
                self._end(Phase.FAILED, False, f"keep-out `{name}` lies across the way back at {x_m:.1f} {y_m:.1f}")
                return
        self._back_leg, self.phase = Path(leg), Phase.DRIVING
        self.stop += 1
        self.progress.append(f"{along_m[-1]:.1f} m of the way back are left")

    def _driving(self, ctx: Context) -> Twist:
        if ctx.held:
            return Twist()
        pose = ctx.localisation.pose
        twist = self._follower.twist(self._back_leg, pose, ctx.now_ns, ctx.wheels)
        if self._follower.done:
            if len(self._back_leg.stations) == len(self._way_back):
                self._arrive(f"{dist(self.goal, (pose.x_m, pose.y_m)):.2f} m from the start")
            else:
                self._scan()
        return twist
