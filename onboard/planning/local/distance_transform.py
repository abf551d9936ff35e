"""Local planner of the chapter (Jarvis' distance transform): cost-to-go over free cells, then steepest descent.

Eight neighbours at 1 and sqrt(2) cells, no diagonal between two obstacle cells. The rover counts as a disc: a cell is
free only if the rover may stand on it in every orientation, so any heading of travel and any turn on the way is
allowed. That closes ground which the pose field crosses. An unreachable goal is a reported failure, never a straight
line.
"""

from __future__ import annotations

import math

import numpy as np

from onboard.kernel_calls import distance as native
from onboard.native import each
from onboard.native.elementary import hypot
from onboard.planning.local.contract import Plan, Problem
from onboard.planning.local.path import drivable, ground_of
from onboard.planning.local.poses import Freedom, orientation
from onboard.records import F32, F64, I32, Bool

NEIGHBOURS = ((0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1))  # (dj, di)


def cost_to_go(free: Bool, goals: Bool, cell_m: float, closeness: F32 | None = None) -> F64:
    """Cost in metres from each free cell to the nearest goal cell, float64 (rows, columns), inf where there is no way.

    closeness: float32 ratio >= 0; an edge costs its length times 1 + its mean at both ends.

    Goals that are not free are ignored. Raises ValueError for wrong shapes, dtypes or ratios.
    """
    return native.cost_to_go(free, goals, cell_m, closeness)


def descend(cost: F64, free: Bool, start: tuple[int, int]) -> I32:
    """The cells (k, 2) of the steepest descent from `start` to a goal, both included; empty where there is no way.

    Each next cell is the one with the steepest fall, per length of the step, among the allowed neighbours that are
    strictly lower.
    """
    j, i = start
    if not np.isfinite(cost[j, i]):
        return np.empty((0, 2), dtype=np.int32)
    cells = [(j, i)]
    while cost[j, i] > 0.0:
        j, i = _lowest(cost, free, j, i)
        cells.append((j, i))
    return np.array(cells, dtype=np.int32)


def _lowest(cost: F64, free: Bool, j: int, i: int) -> tuple[int, int]:
    rows, columns = cost.shape
    best, best_fall = (j, i), 0.0
    for dj, di in NEIGHBOURS:
        a, b = j + dj, i + di
        if not (0 <= a < rows and 0 <= b < columns) or not np.isfinite(cost[a, b]):
            continue
        if dj and di and not (free[a, i] or free[j, b]):
            continue
        fall = float(cost[j, i] - cost[a, b]) / hypot(dj, di)
        if fall > best_fall:
            best, best_fall = (a, b), fall
    assert best != (j, i), "a finite cost above zero has a lower neighbour"
    return best


def headings(cells: I32) -> F64:
    """Direction of travel out of each cell (k,), radians; the last repeats the one before, a single cell has 0."""
    if len(cells) < 2:
        return np.zeros(len(cells))
    step = np.diff(cells.astype(np.float64), axis=0)
    heading = each.atan2(step[:, 0], step[:, 1])
    return np.append(heading, heading[-1])


class DistanceTransformPlanner:
    """Local planner over cells that are free in every orientation."""

    def plan(self, problem: Problem) -> Plan:
        """See `contract`."""
        free = np.all(problem.freedom == Freedom.FREE, axis=0)
        start = problem.grid.cell(problem.start[0], problem.start[1])
        if not problem.grid.contains(*start) or not free[start]:
            return Plan(None, math.inf, "the start is not free in every orientation")
        near = None if problem.closeness is None else problem.closeness.max(axis=0)
        cost = cost_to_go(free, np.asarray(problem.goals.any(axis=0)), problem.grid.cell_m, near)
        cells = descend(cost, free, start)
        if len(cells) == 0:
            return Plan(None, math.inf, "no chain of cells free in every orientation leads to the goal")
        axes = [orientation(heading) for heading in headings(cells)]
        chain = np.column_stack([cells, np.array(axes, dtype=np.int32)]).astype(np.int32)
        path = drivable(chain, problem.start, ground_of(problem.freedom, problem.grid, problem.closeness), problem.end)
        return Plan(path, float(cost[start]), f"{len(cells)} cells, {path.length_m:.2f} m")
