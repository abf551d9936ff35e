"""The way over the orbiter's map (Eq. 21 to 26, corrected): layers, directed edge costs, Dijkstra from the goal.

A cell of the GDEM (10 m) is far larger than the rover, so roughness and inclination come from the 3 x 3 window about
each node. Eq. 25 of an edge, in metres:

    cost = len * (1 + (W_B B/B_max + W_x |roll|/theta_max + W_y |pitch|/theta_max) / W_L)

that is Eq. 25 divided by W_L / l_grid, with the penalties counted by length (by node, as printed, a diagonal would pay
less per metre). It is never below 1 per metre, so the field continues the LDEM's cost-to-go, which is in metres too.
Roll and pitch are those of a body that heads along the edge: the cost of an edge depends on its direction's axis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from onboard.config import Planning
from onboard.records import F32, F64, I32, Gdem, Grid

NEIGHBOURS = ((0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1))  # (dj, di), 45 degrees apart
ROUGHNESS_FLOOR_M = 0.05  # B_max is at least this: the noise of a smooth map is no roughness
NEAREST = 8


@dataclass(frozen=True, slots=True)
class Layers:
    """What Eq. 21 to 24 need of each node, all (rows, columns) float64; NaN where the GDEM has no data.

    roughness_m: standard deviation in the window (Eq. 21). slope_x, slope_y: gradient of the fitted plane.
    """

    roughness_m: F64
    slope_x: F64
    slope_y: F64


@dataclass(frozen=True, slots=True)
class GlobalField:
    """Cost-to-go over the GDEM. cost_m: (rows, columns) float32, metres, inf where the goal cannot be reached.

    next_node: (rows, columns) int32, flat index of the next node on the way (itself: straight to the goal), -1 none.
    """

    grid: Grid
    goal_m: tuple[float, float]
    cost_m: F32
    next_node: I32


def layers(gdem: Gdem, raw_roughness: bool = False) -> Layers:
    """Roughness about the 3 x 3 window's plane and the plane's gradient (Eq. 21, 23, 24).

    A missing neighbour is replaced by the reflection of the one opposite (linear), both missing by the node itself.
    `raw_roughness`: the standard deviation as printed in Eq. 21, which counts the slope as roughness.
    """
    z = gdem.heights_m.astype(np.float64)
    window = _window(z)
    u = np.array([di for _, di in NEIGHBOURS])
    v = np.array([dj for dj, _ in NEIGHBOURS])
    cell = gdem.grid.cell_m
    slope_x = np.tensordot(u, window, 1) / (6.0 * cell)
    slope_y = np.tensordot(v, window, 1) / (6.0 * cell)
    mean = window.sum(axis=0) / 9.0  # heights relative to the node's own, whose share is 0
    residual = window - mean
    own = -mean
    if not raw_roughness:
        residual = residual - cell * (u[:, None, None] * slope_x + v[:, None, None] * slope_y)
    roughness = np.sqrt((np.sum(residual**2, axis=0) + own**2) / 9.0)
    return Layers(roughness, slope_x, slope_y)


def _window(z: F64) -> F64:
    """Heights of the eight neighbours relative to the node's own, (8, rows, columns)."""
    rows, columns = z.shape
    padded = np.pad(z, 1, mode="reflect", reflect_type="odd")  # the border goes on as a straight line
    relative = np.stack([padded[1 + dj : 1 + dj + rows, 1 + di : 1 + di + columns] - z for dj, di in NEIGHBOURS])
    opposite = np.roll(relative, 4, axis=0)
    relative = np.where(np.isnan(relative), -opposite, relative)
    return np.where(np.isnan(relative) & np.isfinite(z), 0.0, relative)


def edge_costs(gdem: Gdem, planning: Planning) -> F64:
    """Cost of leaving each node towards each of NEIGHBOURS, (8, rows, columns) metres, inf where impassable (Eq. 25).

    Penalties are the mean of both ends; steeper than `slope_limit_rad` about either axis at either end is impassable,
    and so is an edge to or from a node without data.
    """
    ground = layers(gdem)
    z = gdem.heights_m.astype(np.float64)
    rough_max = max(float(np.nanmax(ground.roughness_m, initial=0.0)), ROUGHNESS_FLOOR_M)
    return np.stack([_edges(k, z, ground, rough_max, gdem.grid.cell_m, planning) for k in range(len(NEIGHBOURS))])


def _edges(k: int, z: F64, ground: Layers, rough_max: float, cell_m: float, planning: Planning) -> F64:
    dj, di = NEIGHBOURS[k]
    run = cell_m * np.hypot(dj, di)
    along, left = (di * cell_m / run, dj * cell_m / run), (-dj * cell_m / run, di * cell_m / run)
    limit = planning.slope_limit_rad
    pitch = np.abs(np.arctan(ground.slope_x * along[0] + ground.slope_y * along[1]))
    roll = np.abs(np.arctan(ground.slope_x * left[0] + ground.slope_y * left[1]))
    price = (
        planning.weight_roughness * ground.roughness_m / rough_max
        + planning.weight_roll * roll / limit
        + planning.weight_pitch * pitch / limit
    ) / planning.weight_length
    price = np.where((pitch > limit) | (roll > limit), np.inf, price)
    length = np.hypot(run, _shifted(z, dj, di) - z)
    cost = length * (1.0 + 0.5 * (price + _shifted(price, dj, di)))
    return np.where(np.isfinite(cost), cost, np.inf)


def _shifted(a: F64, dj: int, di: int) -> F64:
    """a[j + dj, i + di] at [j, i], NaN outside."""
    out = np.full_like(a, np.nan)
    rows, columns = a.shape
    to_j, to_i = slice(max(0, -dj), rows - max(0, dj)), slice(max(0, -di), columns - max(0, di))
    from_j, from_i = slice(max(0, dj), rows + min(0, dj)), slice(max(0, di), columns + min(0, di))
    out[to_j, to_i] = a[from_j, from_i]
    return out


def solve(gdem: Gdem, goal_m: tuple[float, float], planning: Planning) -> GlobalField:
    """The whole cost-to-go field of a goal (Eq. 26 for every start at once).

    The goal is joined to its 8 nearest nodes by straight lines, a goal outside the map to the border's.
    """
    grid, costs = gdem.grid, edge_costs(gdem, planning)
    nodes = grid.rows * grid.columns
    index = np.arange(nodes).reshape(grid.rows, grid.columns)
    start, end, weight = [], [], []
    for k, (dj, di) in enumerate(NEIGHBOURS):
        ok = np.isfinite(costs[k])
        j, i = np.nonzero(ok)
        start.append(index[j + dj, i + di])  # reversed: the search runs from the goal backwards along the edges
        end.append(index[j, i])
        weight.append(costs[k][ok])
    near, way = _nearest(grid, np.array([goal_m]))
    has_data = np.isfinite(gdem.heights_m.ravel()[near[0]])
    start.append(np.full(int(has_data.sum()), nodes))
    end.append(near[0][has_data])
    weight.append(np.maximum(way[0][has_data], 1e-9))
    graph = csr_matrix(
        (np.concatenate(weight), (np.concatenate(start), np.concatenate(end))), shape=(nodes + 1, nodes + 1)
    )
    every_cost, every_before = dijkstra(graph, indices=np.array([nodes]), return_predecessors=True)
    cost, before = every_cost[0], every_before[0]
    following = np.where(before[:nodes] == nodes, np.arange(nodes), np.where(before[:nodes] < 0, -1, before[:nodes]))
    shape = (grid.rows, grid.columns)
    return GlobalField(
        grid, goal_m, cost[:nodes].reshape(shape).astype(np.float32), following.reshape(shape).astype(np.int32)
    )


def _nearest(grid: Grid, points_m: F64) -> tuple[NDArray[np.int64], F64]:
    """Flat indices (k, 8) of the nodes nearest to each point and the ways to them (k, 8).

    A point outside the map counts from the border point nearest to it, plus the straight way there.
    """
    high = (grid.x0_m + (grid.columns - 1) * grid.cell_m, grid.y0_m + (grid.rows - 1) * grid.cell_m)
    inside = np.clip(points_m, (grid.x0_m, grid.y0_m), high)
    beyond = np.hypot(*(points_m - inside).T)
    corner_i = np.floor((inside[:, 0] - grid.x0_m) / grid.cell_m).astype(np.int64)
    corner_j = np.floor((inside[:, 1] - grid.y0_m) / grid.cell_m).astype(np.int64)
    span = np.arange(-1, 3)
    i = (corner_i[:, None, None] + span[None, None, :]) + 0 * span[None, :, None]
    j = (corner_j[:, None, None] + span[None, :, None]) + 0 * span[None, None, :]
    on_map = (i >= 0) & (i < grid.columns) & (j >= 0) & (j < grid.rows)
    dx = grid.x0_m + i * grid.cell_m - inside[:, 0, None, None]
    dy = grid.y0_m + j * grid.cell_m - inside[:, 1, None, None]
    way = np.where(on_map, np.hypot(dx, dy), np.inf).reshape(len(points_m), -1)
    flat = np.where(on_map, j * grid.columns + i, 0).reshape(len(points_m), -1)
    order = np.argsort(way, axis=1, kind="stable")[:, :NEAREST]
    return np.take_along_axis(flat, order, 1), np.take_along_axis(way, order, 1) + beyond[:, None]


def values_at(field: GlobalField, points_m: F64) -> F64:
    """Cost-to-go at points (k, 2) in metres, (k,) float64: least of field + way over the 8 nearest nodes.

    Within one and a half cells of the goal the straight line to it counts too, so the value at the goal is 0. On even
    ground it is continuous to a twentieth of a cell; where a node leaves the eight beside rough ground it may jump by
    that node's penalty, which a field that is seeded with these values smooths again (its own ways are shorter).
    """
    near, way = _nearest(field.grid, points_m)
    value = np.min(field.cost_m.ravel()[near].astype(np.float64) + way, axis=1)
    straight = np.hypot(*(points_m - np.array(field.goal_m)).T)
    return np.asarray(np.where(straight <= 1.5 * field.grid.cell_m, np.minimum(value, straight), value))


def value_at(field: GlobalField, x_m: float, y_m: float) -> float:
    """`values_at` for one point."""
    return float(values_at(field, np.array([[x_m, y_m]]))[0])


def path(field: GlobalField, start_m: tuple[float, float]) -> F64:
    """The candidate path (k, 2): start, nodes, goal. Empty (0, 2) where the goal cannot be reached (Eq. 26)."""
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
