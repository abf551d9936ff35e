"""Slow plain twins of the searches over cells: a heap, and a line walked station by station."""

from __future__ import annotations

import heapq
import math
from itertools import pairwise

import numpy as np

from onboard.records import Grid

WAYS = [(dj, di) for dj in (-1, 0, 1) for di in (-1, 0, 1) if (dj, di) != (0, 0)]


def steps(free: np.ndarray, j: int, i: int) -> list[tuple[int, int]]:
    """The cells that a step leads to: free, and not diagonally between two that are not."""

    def is_free(row: int, column: int) -> bool:
        return 0 <= row < free.shape[0] and 0 <= column < free.shape[1] and bool(free[row, column])

    return [
        (j + dj, i + di)
        for dj, di in WAYS
        if is_free(j + dj, i + di) and (dj == 0 or di == 0 or is_free(j + dj, i) or is_free(j, i + di))
    ]


def distance(free: np.ndarray, goals: np.ndarray, cell_m: float, closeness: np.ndarray | None = None) -> np.ndarray:
    """Dijkstra with a heap, in metres."""
    cost = np.full(free.shape, np.inf)
    heap = [(0.0, int(j), int(i)) for j, i in np.argwhere(free & goals)]
    for _, j, i in heap:
        cost[j, i] = 0.0
    while heap:
        here, j, i = heapq.heappop(heap)
        if here > cost[j, i]:
            continue
        for a, b in steps(free, j, i):
            near = 0.0 if closeness is None else (float(closeness[j, i]) + float(closeness[a, b])) / 2
            there = here + cell_m * math.hypot(a - j, b - i) * (1 + near)
            if there < cost[a, b]:
                cost[a, b] = there
                heapq.heappush(heap, (there, a, b))
    return cost


def sight_price(free: np.ndarray, closeness: np.ndarray | None, grid: Grid, line: tuple, spacing_m: float) -> float:
    """Price of a straight drive, inf where a station's pose is not free."""
    a, b, o = line
    pieces = max(1, math.ceil(math.dist(a, b) / spacing_m - 1e-9))
    stations = np.column_stack([np.linspace(a[0], b[0], pieces + 1), np.linspace(a[1], b[1], pieces + 1)])
    near = []
    for x, y in stations:
        i, j = round((x - grid.x0_m) / grid.cell_m), round((y - grid.y0_m) / grid.cell_m)
        if not grid.contains(j, i) or not free[o, j, i]:
            return math.inf
        near.append(0.0 if closeness is None else float(closeness[o, j, i]))
    lengths = [math.dist(p, q) for p, q in pairwise(stations)]
    return sum(m * (1 + (p + q) / 2) for m, p, q in zip(lengths, near, near[1:]))
