"""Cost-to-go over poses (cell, 8 orientations): straight, crab, turn on the spot; `10-navigation` section 5.

A move goes to one of the 8 neighbour cells and keeps the orientation; its cost is its length times the crab factor of
the angle between the move and the body's axis, modulo 180 degrees. A turn keeps the cell and goes to the next
orientation. Every pose is checked by itself, so corners need no rule of their own. Edges cost the same both ways: a
field is the cost to go to its seeds and the cost to come from them.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from onboard import config
from onboard.kernel_calls import pose_field as native
from onboard.native.elementary import hypot
from onboard.planning.local.poses import ORIENTATIONS, Freedom
from onboard.records import F32, I32, U8

DIRECTIONS = ((0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1))  # (dj, di) of k * 45 degrees
CRAB_FACTORS = (1.0, 1.2, 1.2, 1.32, 1.44)  # angle between move and body axis: 0, 22.5, 45, 67.5, 90 degrees
ROUNDING = 1e-5  # of float32 costs
LEAST_TURN_M = 1e-3  # a turn costs at least this, so that descent always ends


def cost_to_go(
    freedom: U8,
    seeds: NDArray[np.integer],
    planning: config.Planning,
    cell_m: float,
    optimistic: bool,
    closeness: F32 | None = None,
    seed_costs_m: NDArray[np.floating] | None = None,
) -> F32:
    """Cost in metres from every pose to the nearest seed, float32 (8, rows, columns), inf where there is no way.

    seeds: (k, 3) integers j, i, o; o = -1 stands for all eight orientations; a seed that is not passable is ignored.
    optimistic: unknown poses are passable at the same cost, else free ones only.
    closeness: ratio; the cost of an edge is multiplied by 1 + its mean at both ends.
    seed_costs_m: (k,) finite, the remaining cost from each seed (0 without it).

    Raises ValueError for seeds outside the grid.
    """
    least = Freedom.UNKNOWN if optimistic else Freedom.FREE
    left_m = np.zeros(len(seeds)) if seed_costs_m is None else np.asarray(seed_costs_m, np.float64)
    least_m = float(left_m.min(initial=np.inf)) if len(left_m) else 0.0
    table = _flat(seeds, left_m - least_m, freedom.shape)
    cost = native.cost_to_go(freedom, int(least), table, moves_m(cell_m), _turn_m(planning), closeness)
    cost += np.float32(least_m)
    return cost


def descend(
    cost: F32, start: tuple[int, int, int], planning: config.Planning, cell_m: float, closeness: F32 | None = None
) -> I32:
    """The cheapest way from a pose (j, i, o) to a seed: int32 (k, 3) poses j, i, o, start and seed included.

    Pass planning, cell_m and closeness as for cost_to_go: the way follows the edges of the field. Among equal costs the
    first of the directions wins, turns last. The way ends where no neighbour explains the cost: at a seed. Raises
    ValueError if the cost of the start is inf.
    """
    j, i, o = (int(part) for part in start)
    if not np.isfinite(cost[o, j, i]):
        raise ValueError(f"descend: no way leads from pose (j, i, o) = {(j, i, o)}")
    prices, turn_m, way = moves_m(cell_m).tolist(), _turn_m(planning), [(j, i, o)]
    while True:
        here = float(cost[o, j, i])
        steps = [(j + dj, i + di, o, prices[o][k]) for k, (dj, di) in enumerate(DIRECTIONS)]
        steps += [(j, i, (o + 1) % ORIENTATIONS, turn_m), (j, i, (o - 1) % ORIENTATIONS, turn_m)]
        best = (math.inf, j, i, o)
        for row, column, other, price in steps:
            if not (0 <= row < cost.shape[1] and 0 <= column < cost.shape[2]):
                continue
            if closeness is not None:
                price *= 1.0 + 0.5 * float(closeness[o, j, i] + closeness[other, row, column])
            there = float(cost[other, row, column])
            if there < here and there + price < best[0] - 1e-6:
                best = (there + price, row, column, other)
        if best[0] > here + ROUNDING * (1.0 + abs(here)):
            return np.array(way, np.int32)
        _, j, i, o = best
        way.append((j, i, o))


def moves_m(cell_m: float) -> F32:
    """Cost of a move, float32 (8 orientations, 8 directions): length times crab factor."""
    table = np.empty((ORIENTATIONS, len(DIRECTIONS)), np.float32)
    for o in range(ORIENTATIONS):
        for k, (dj, di) in enumerate(DIRECTIONS):
            apart = (2 * k - o) % ORIENTATIONS  # in steps of 22.5 degrees, modulo 180
            table[o, k] = cell_m * hypot(dj, di) * CRAB_FACTORS[min(apart, ORIENTATIONS - apart)]
    return table


def _turn_m(planning: config.Planning) -> float:
    return max(planning.turn_cost_m, LEAST_TURN_M)


def _flat(
    seeds: NDArray[np.integer], left_m: NDArray[np.float64], shape: tuple[int, ...]
) -> tuple[NDArray[np.int64], F32]:
    table = np.asarray(seeds, np.int64).reshape(-1, 3)
    j, i, o = table.T
    _, rows, columns = shape
    bad = (j < 0) | (j >= rows) | (i < 0) | (i >= columns) | (o < -1) | (o >= ORIENTATIONS)
    if bad.any():
        raise ValueError(f"seeds: expected (j, i, o) in {rows} rows, {columns} columns, o -1..7, given {table[bad][0]}")
    every = o < 0
    cells = np.concatenate([j[~every] * columns + i[~every], np.repeat(j[every] * columns + i[every], ORIENTATIONS)])
    layers = np.concatenate([o[~every], np.tile(np.arange(ORIENTATIONS), int(every.sum()))])
    left = np.concatenate([left_m[~every], np.repeat(left_m[every], ORIENTATIONS)])
    return np.ascontiguousarray(layers * (rows * columns) + cells), left.astype(np.float32)
