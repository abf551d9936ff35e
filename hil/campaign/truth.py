"""Truth planner: the flight program's own pose rules, costs and planner on the perfect map."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from onboard.config import Config
from onboard.planning.local.contract import Problem
from onboard.planning.local.pose_planner import PoseFieldPlanner
from onboard.planning.local.poses import Freedom, closeness, pose_freedom, pose_index, reachable
from onboard.records import F64, U8, Bool, Path, Pose, Surface


@dataclass(frozen=True)
class TrueWay:
    """Result of planning on a perfect map.

    path: the cheapest path to the pose nearest to the goal; None: unreachable.
    """

    surface: Surface
    freedom: U8
    path: Path | None

    @property
    def reachable(self) -> bool:
        """Return whether a free pose within the goal's tolerance can be reached."""
        return self.path is not None

    @property
    def way_m(self) -> float:
        """Length of the cheapest way, inf without one."""
        return math.inf if self.path is None else self.path.length_m


def true_way(surface: Surface, start: Pose, goal_m: tuple[float, float], config: Config) -> TrueWay:
    """Plan from a start to a goal over a perfect map."""
    freedom = pose_freedom(surface, config.rover, config.planning)
    at = (start.x_m, start.y_m, start.yaw_rad)
    j, i, o = pose_index(surface.grid, *at)
    freedom[o, j, i] = Freedom.FREE  # the rover stands there
    reach = reachable(freedom, j, i, o)
    goals = _goals(surface, reach, goal_m, config.mission.goal_tolerance_m)
    if not goals.any():
        return TrueWay(surface, freedom, None)
    near = closeness(freedom, config.planning, surface.grid.cell_m)
    problem = Problem(freedom, surface.grid, at, goals, config.planning, near)
    return TrueWay(surface, freedom, PoseFieldPlanner().plan(problem).path)


def _goals(surface: Surface, reach: Bool, goal_m: tuple[float, float], tolerance_m: float) -> Bool:
    """Return the reachable poses nearest to the goal; none if they are farther from it than the tolerance."""
    grid = surface.grid
    x: F64 = grid.x0_m + np.arange(grid.columns) * grid.cell_m - goal_m[0]
    y: F64 = grid.y0_m + np.arange(grid.rows) * grid.cell_m - goal_m[1]
    away = np.where(reach.any(axis=0), np.hypot(x[None, :], y[:, None]), np.inf)
    nearest = away.min()
    return reach & (away <= nearest + 1e-6) & bool(nearest <= tolerance_m)
