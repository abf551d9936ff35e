"""Global path over the orbiter's map (Eq. 21 to 26, corrected): layers, directed edge costs, cost-to-go from the goal.

A cell of the GDEM (10 m) is far larger than the rover, so roughness and inclination come from the 3 x 3 window about
each node. Eq. 25 of an edge, in metres:

    cost = len * (1 + (W_B B/B_max + W_x |roll|/theta_max + W_y |pitch|/theta_max) / W_L)

This is Eq. 25 divided by W_L / l_grid, with the penalties counted by length (counted by node, as printed, a diagonal
would pay less per metre). It is never below 1 per metre, so the field continues the LDEM's cost-to-go, which is in
metres too. Roll and pitch are those of a body that heads along the edge: the cost of an edge depends on its direction.
As the law takes magnitudes, the way back costs the same.

`kernel_calls.global_field` does the work. A caller watches and cancels long plans through its own `Workspace`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.config import Planning
from onboard.kernel_calls import global_field
from onboard.kernel_calls.global_field import Workspace, workspace
from onboard.native import each
from onboard.records import F32, F64, I32, Gdem, Grid

NEIGHBOURS = ((0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1))  # (dj, di), 45 degrees apart
ROUGHNESS_FLOOR_M = 0.05  # B_max is at least this, so that noise of a smooth map does not count as roughness
NEAREST = 8


@dataclass(frozen=True, slots=True)
class Layers:
    """Terms of Eq. 21 to 24 for each node, all (rows, columns) float32; NaN where the GDEM has no data.

    roughness_m: standard deviation in the window (Eq. 21).
    slope_x, slope_y: gradient of the fitted plane.
    """

    roughness_m: F32
    slope_x: F32
    slope_y: F32


@dataclass(frozen=True, slots=True)
class GlobalField:
    """Cost-to-go over the GDEM.

    grid: the GDEM's grid.
    goal_m: x, y of the goal.
    cost_m: (rows, columns) float32, metres, inf where the goal cannot be reached.
    next_node: (rows, columns) int32, flat index of the next node on the way (itself: straight to the goal), -1 none.
    """

    grid: Grid
    goal_m: tuple[float, float]
    cost_m: F32
    next_node: I32


def layers(gdem: Gdem, raw_roughness: bool = False) -> Layers:
    """Roughness about the 3 x 3 window's plane and the plane's gradient (Eq. 21, 23, 24).

    Beyond the border the ground is extrapolated linearly. A missing neighbour is replaced by the reflection of the
    opposite one (linear); if both are missing, by the node itself. Raises ValueError for an empty map or heights that
    are not contiguous float32 of the grid's shape.

    raw_roughness: the standard deviation as Eq. 21 prints it, which counts the slope as roughness.
    """
    work = _room(gdem)
    return Layers(*global_field.make_layers(gdem.heights_m, gdem.grid.cell_m, raw_roughness, work))


def edge_costs(gdem: Gdem, planning: Planning) -> F32:
    """Cost of leaving each node towards each of NEIGHBOURS, (8, rows, columns) metres, inf where impassable (Eq. 25).

    Penalties are the mean of both ends. An edge is impassable if either end is steeper than `slope_limit_rad` about
    either axis, or has no data. Raises as `layers` does.
    """
    work = _room(gdem)
    make_edges(gdem, planning, work)
    rows, columns = gdem.grid.rows, gdem.grid.columns
    costs = np.full((len(NEIGHBOURS), rows, columns), np.inf, np.float32)
    costs[:4] = np.moveaxis(work.edges_m[columns + 1 :].reshape(rows, columns, 4), 2, 0)
    for ahead, back, (dj, di) in zip(costs[:4], costs[4:], NEIGHBOURS):
        back[dj:, max(0, di) : columns + min(0, di)] = ahead[: rows - dj, max(0, -di) : columns - max(0, di)]
    return costs


def solve(gdem: Gdem, goal_m: tuple[float, float], planning: Planning, work: Workspace | None = None) -> GlobalField:
    """The whole cost-to-go field of a goal (Eq. 26 for every start at once).

    The goal is joined to its 8 nearest nodes by straight lines; a goal off the map to none, so that no node reaches it.
    Raises as `layers` does, ValueError for a goal that is not finite, CancelledError.

    work: workspace of the map's size, for repeated use; its `progress` rises to 3 * rows * columns and can be cancelled
        from another thread.
    """
    if not np.isfinite(goal_m).all():
        raise ValueError(f"goal_m: expected finite coordinates, given {goal_m}")
    room = _room(gdem, work)
    make_edges(gdem, planning, room)
    cost_m, next_node = global_field.cost_to_go(_joined(gdem, goal_m), room)
    return GlobalField(gdem.grid, goal_m, cost_m, next_node)


def _room(gdem: Gdem, work: Workspace | None = None) -> Workspace:
    room = workspace(gdem.grid.rows, gdem.grid.columns) if work is None else work
    room.progress.done[0] = 0
    return room


def make_edges(gdem: Gdem, planning: Planning, work: Workspace) -> None:
    """`edge_costs` in a workspace, for `kernel_calls.global_field.cost_to_go`. Raises as they do."""
    limit, per_length = planning.slope_limit_rad, 1.0 / planning.weight_length
    prices = global_field.Prices(
        planning.weight_roughness * per_length,
        ROUGHNESS_FLOOR_M,
        planning.weight_roll * per_length / limit,
        planning.weight_pitch * per_length / limit,
        limit,
    )
    global_field.make_edges(gdem.heights_m, gdem.grid.cell_m, prices, work)


def _joined(gdem: Gdem, goal_m: tuple[float, float]) -> tuple[NDArray[np.int64], F64]:
    """Nodes with data around the goal and their straight distances to it; none if the goal is off the map."""
    if not gdem.grid.contains(*gdem.grid.cell(*goal_m)):
        return np.empty(0, np.int64), np.empty(0)
    near, way = _nearest(gdem.grid, np.array([goal_m]))
    heights_m = gdem.heights_m.ravel()[near[0]]
    joined = (np.abs(heights_m) <= global_field.HIGHEST_M) & np.isfinite(way[0])
    return near[0][joined], way[0][joined]


def _nearest(grid: Grid, points_m: F64) -> tuple[NDArray[np.int64], F64]:
    """Flat indices (k, 8) of the nodes nearest to each point, and their distances (k, 8).

    A point outside the map is moved to the nearest border point; the distance to it is added.
    """
    high = (grid.x0_m + (grid.columns - 1) * grid.cell_m, grid.y0_m + (grid.rows - 1) * grid.cell_m)
    inside = np.clip(points_m, (grid.x0_m, grid.y0_m), high)
    beyond = each.hypot(*(points_m - inside).T)
    corner_i = np.floor((inside[:, 0] - grid.x0_m) / grid.cell_m).astype(np.int64)
    corner_j = np.floor((inside[:, 1] - grid.y0_m) / grid.cell_m).astype(np.int64)
    span = np.arange(-1, 3)
    i = (corner_i[:, None, None] + span[None, None, :]) + 0 * span[None, :, None]
    j = (corner_j[:, None, None] + span[None, :, None]) + 0 * span[None, None, :]
    on_map = (i >= 0) & (i < grid.columns) & (j >= 0) & (j < grid.rows)
    dx = grid.x0_m + i * grid.cell_m - inside[:, 0, None, None]
    dy = grid.y0_m + j * grid.cell_m - inside[:, 1, None, None]
    way = np.where(on_map, each.hypot(dx, dy), np.inf).reshape(len(points_m), -1)
    flat = np.where(on_map, j * grid.columns + i, 0).reshape(len(points_m), -1)
    order = np.argsort(way, axis=1, kind="stable")[:, :NEAREST]
    return np.take_along_axis(flat, order, 1), np.take_along_axis(way, order, 1) + beyond[:, None]


def values_at(field: GlobalField, points_m: F64) -> F64:
    """Cost-to-go at points (k, 2) in metres, (k,) float64, inf where there is no way.

    The value at a point is the minimum over its 8 nearest nodes of field + distance, so L is continuous. Within one and
    a half cells of the goal the straight line to it counts too, so the value at the goal is 0. On even ground L is
    continuous to a twentieth of a cell. Where a node leaves the set of eight next to rough ground, L may jump by that
    node's penalty; a field seeded with these values smooths the jump (its own ways are shorter).
    """
    near, way = _nearest(field.grid, points_m)
    value = np.min(field.cost_m.ravel()[near].astype(np.float64) + way, axis=1)
    straight = each.hypot(*(points_m - np.array(field.goal_m)).T)
    return np.asarray(np.where(straight <= 1.5 * field.grid.cell_m, np.minimum(value, straight), value))


def value_at(field: GlobalField, x_m: float, y_m: float) -> float:
    """`values_at` for one point."""
    return float(values_at(field, np.array([[x_m, y_m]]))[0])


def path(field: GlobalField, start_m: tuple[float, float]) -> F64:
    """The candidate path (k, 2): start, nodes, goal. Empty (0, 2) if the goal cannot be reached (Eq. 26)."""
    start, goal = np.array(start_m, dtype=np.float64), np.array(field.goal_m)
    value = value_at(field, *start_m)
    if not np.isfinite(value):
        return np.empty((0, 2))
    near, way = _nearest(field.grid, start[None])
    sums = field.cost_m.ravel()[near[0]] + way[0]
    points = [start]
    if sums.min() <= value:
        node, following = int(near[0][np.argmin(sums)]), field.next_node.ravel()
        while True:
            points.append(np.array(field.grid.centre(*divmod(node, field.grid.columns))))
            if following[node] == node:
                break
            node = int(following[node])
    return np.array([*points, goal])
