"""The chapter's local planner (Jarvis' distance transform): cost-to-go over free cells, then steepest descent.

Eight neighbours at 1 and sqrt(2) cells, no diagonal between two obstacle cells. The rover counts as a disc here: a cell
is free only if the rover may stand on it in every orientation, so any heading of travel and any turn on the way is
allowed. That closes ground which the pose field crosses; unreachable is a reported failure, never a straight line.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from onboard.planning.contract import Plan, Problem
from onboard.planning.path import drivable, ground_of
from onboard.planning.poses import Freedom, orientation
from onboard.records import F32, F64, I32, Bool

NEIGHBOURS = ((0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1))  # (dj, di)


def cost_to_go(free: Bool, goals: Bool, cell_m: float, closeness: F32 | None = None) -> F32:
    """Price in metres from each free cell to the nearest goal cell, float32 (rows, columns), inf where there is no way.

    closeness: ratio >= 0; an edge costs its length times 1 + its mean at both ends. Goals that are not free count for
    nothing.
    """
    rows, columns = free.shape
    nodes, index = free.size, np.arange(free.size).reshape(free.shape)
    price = np.ones(free.shape) if closeness is None else 1.0 + closeness.astype(np.float64)
    start, end, weight = [], [], []
    for dj, di in NEIGHBOURS:
        j, i = np.nonzero(_moves(free, dj, di))
        start.append(index[j, i])
        end.append(index[j + dj, i + di])
        weight.append(cell_m * np.hypot(dj, di) * 0.5 * (price[j, i] + price[j + dj, i + di]))
    seeds = index[free & goals]
    if len(seeds) == 0:
        return np.full(free.shape, np.inf, dtype=np.float32)
    graph = csr_matrix((np.concatenate(weight), (np.concatenate(start), np.concatenate(end))), shape=(nodes, nodes))
    cost = dijkstra(graph, indices=seeds, min_only=True)
    return np.asarray(cost.reshape(rows, columns), dtype=np.float32)


def _moves(free: Bool, dj: int, di: int) -> Bool:
    """Cells (j, i) from which the step (dj, di) is allowed: both ends free, not between two obstacles."""
    rows, columns = free.shape
    padded = np.zeros((rows + 2, columns + 2), dtype=bool)
    padded[1:-1, 1:-1] = free

    def at(down: int, right: int) -> Bool:
        return padded[1 + down : 1 + down + rows, 1 + right : 1 + right + columns]

    allowed = free & at(dj, di)
    if dj and di:
        allowed &= at(dj, 0) | at(0, di)
    return np.asarray(allowed)


def descend(cost: F32, free: Bool, start: tuple[int, int]) -> I32:
    """The cells (k, 2) of the steepest descent from `start` to a goal, both included; empty where there is no way.

    Each next cell is the lowest among the allowed neighbours that lie strictly lower, per length of the step.
    """
    j, i = start
    if not np.isfinite(cost[j, i]):
        return np.empty((0, 2), dtype=np.int32)
    cells = [(j, i)]
    while cost[j, i] > 0.0:
        j, i = _lowest(cost, free, j, i)
        cells.append((j, i))
    return np.array(cells, dtype=np.int32)


def _lowest(cost: F32, free: Bool, j: int, i: int) -> tuple[int, int]:
    rows, columns = cost.shape
    best, best_fall = (j, i), 0.0
    for dj, di in NEIGHBOURS:
        a, b = j + dj, i + di
        if not (0 <= a < rows and 0 <= b < columns) or not np.isfinite(cost[a, b]):
            continue
        if dj and di and not (free[a, i] or free[j, b]):
            continue
        fall = float(cost[j, i] - cost[a, b]) / float(np.hypot(dj, di))
        if fall > best_fall:
            best, best_fall = (a, b), fall
    assert best != (j, i), "a finite cost above zero has a lower neighbour"
    return best


def headings(cells: I32) -> F64:
    """Direction of travel out of each cell (k,), radians; the last keeps the one before, a single cell has 0."""
    if len(cells) < 2:
        return np.zeros(len(cells))
    step = np.diff(cells.astype(np.float64), axis=0)
    heading = np.arctan2(step[:, 0], step[:, 1])
    return np.append(heading, heading[-1])


class DistanceTransformPlanner:
    """Plans over cells that are free in every orientation."""

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
