"""The truth planner: the flight program's own pose rules, costs and planner on the perfect map."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from onboard.config import Config
from onboard.planning.contract import Problem
from onboard.planning.pose_planner import PoseFieldPlanner
from onboard.planning.poses import Freedom, closeness, pose_freedom, pose_index, reachable
from onboard.records import F64, U8, Bool, Path, Surface
from tests.missions.world import World, true_surface


@dataclass(frozen=True)
class Truth:
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


def truth(world: World, config: Config) -> Truth:
    """Return the perfect map of a world, and the path over it."""
    surface = true_surface(world, config.mapping.cell_m)
    freedom = pose_freedom(surface, config.rover, config.planning)
    start = (world.start.x_m, world.start.y_m, world.start.yaw_rad)
    j, i, o = pose_index(surface.grid, *start)
    freedom[o, j, i] = Freedom.FREE  # the rover stands there
    reach = reachable(freedom, j, i, o)
    goals = _goals(surface, reach, world.goal_m, config.mission.goal_tolerance_m)
    if not goals.any():
        return Truth(surface, freedom, None)
    near = closeness(freedom, config.planning, surface.grid.cell_m)
    problem = Problem(freedom, surface.grid, start, goals, config.planning, near)
    return Truth(surface, freedom, PoseFieldPlanner().plan(problem).path)


def _goals(surface: Surface, reach: Bool, goal_m: tuple[float, float], tolerance_m: float) -> Bool:
    """Return the reachable poses nearest to the goal; none if they are farther from it than the tolerance."""
    grid = surface.grid
    x: F64 = grid.x0_m + np.arange(grid.columns) * grid.cell_m - goal_m[0]
    y: F64 = grid.y0_m + np.arange(grid.rows) * grid.cell_m - goal_m[1]
    away = np.where(reach.any(axis=0), np.hypot(x[None, :], y[:, None]), np.inf)
    nearest = away.min()
    return reach & (away <= nearest + 1e-6) & bool(nearest <= tolerance_m)
