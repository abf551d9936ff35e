"""Default local planner: descent of the pose field over free poses, shortened by line of sight."""

from __future__ import annotations

import math

import numpy as np

from onboard.planning.local.contract import Plan, Problem
from onboard.planning.local.path import drivable, ground_of
from onboard.planning.local.pose_field import cost_to_go, descend
from onboard.planning.local.poses import Freedom, pose_index


class PoseFieldPlanner:
    """Local planner over (cell, 8 orientations): straight, crab, turn on the spot."""

    def plan(self, problem: Problem) -> Plan:
        """See `contract`. Starts from the nearest lattice pose."""
        j, i, o = pose_index(problem.grid, *problem.start)
        if not problem.grid.contains(j, i) or problem.freedom[o, j, i] != Freedom.FREE:
            return Plan(None, math.inf, "the start is not a free pose")
        seeds = np.argwhere(problem.goals)[:, [1, 2, 0]]
        cell_m, near = problem.grid.cell_m, problem.closeness
        cost = cost_to_go(problem.freedom, seeds, problem.planning, cell_m, False, near)
        if not np.isfinite(cost[o, j, i]):
            return Plan(None, math.inf, "no chain of free poses leads to the goal")
        chain = descend(cost, (j, i, o), problem.planning, cell_m, near)
        path = drivable(chain, problem.start, ground_of(problem.freedom, problem.grid, problem.closeness), problem.end)
        return Plan(path, float(cost[o, j, i]), f"{len(chain)} poses, {path.length_m:.2f} m")
