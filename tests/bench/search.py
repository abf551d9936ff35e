"""Rows of the distance transform: distance-200, distance-2000, distance-maze, distance-mcp."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from onboard.planning.local.distance_transform import NEIGHBOURS, cost_to_go
from tests.bench.goals import Measured, against, seconds

CELL_M = 0.1
DENSITY = 0.108  # share of obstacle cells


def rock_field(side: int) -> np.ndarray:
    """Return the free cells among discs of 1 to 5 cells radius, (side, side) bool; the goal's corner is free."""
    rng, free = np.random.default_rng(3), np.ones((side, side), bool)
    y, x = np.mgrid[-5:6, -5:6]
    for _ in range(side * side):
        if side * side - np.count_nonzero(free) >= DENSITY * side * side:
            break
        (j, i), radius = rng.integers(5, side - 5, 2), rng.uniform(1, 5)
        free[j - 5 : j + 6, i - 5 : i + 6] &= np.hypot(x, y) >= radius
    free[:3, :3] = True
    return free


def serpentine(side: int, corridor: int) -> np.ndarray:
    """Return a single path from corner to corner: walls of one cell between corridors, open at alternating ends."""
    free = np.ones((side, side), bool)
    for wall, j in enumerate(range(corridor, side, corridor + 1)):
        free[j] = False
        free[j, 0 if wall % 2 else -1] = True
    return free


def goal(free: np.ndarray) -> np.ndarray:
    """Return the goal mask: the first cell."""
    goals = np.zeros_like(free)
    goals[0, 0] = True
    return goals


def graph(free: np.ndarray) -> sparse.csr_array:
    """Return the steps between free cells, not between two obstacles, with costs in metres."""
    rows, columns = free.shape
    padded = np.pad(free, 1)
    index = np.arange(free.size, dtype=np.int32).reshape(free.shape)
    here, there, price = [], [], []
    for dj, di in NEIGHBOURS:

        def at(down: int, right: int) -> np.ndarray:
            return padded[1 + down : 1 + down + rows, 1 + right : 1 + right + columns]

        start = index[free & at(dj, di) & (at(dj, 0) | at(0, di))]
        here.append(start)
        there.append(start + np.int32(dj * columns + di))
        price.append(np.full(len(start), CELL_M * np.hypot(dj, di)))
    edges = (np.concatenate(here), np.concatenate(there))
    return sparse.csr_array((np.concatenate(price), edges), shape=(free.size, free.size))


def against_scipy(side: int, repeats: int, inner: int) -> Measured:
    """Measure the whole field from one goal cell."""
    free = rock_field(side)
    goals, edges = goal(free), graph(free)

    def ours() -> np.ndarray:
        return cost_to_go(free, goals, CELL_M)

    def theirs() -> np.ndarray:
        return csgraph.dijkstra(edges, indices=[0], min_only=True)

    equal = np.allclose(ours()[free], theirs().reshape(free.shape)[free], rtol=1e-6, atol=0.0)
    made = against(ours, theirs, "scipy dijkstra, graph given", repeats, inner)
    note = f"{made.ours_s / free.sum() * 1e9:.1f} ns a free cell; {'equal' if equal else 'NOT EQUAL'}"
    return replace(made, note=note, also=bool(equal))


def maze(repeats: int) -> Measured:
    """Measure the time per free cell, serpentine over rock field: the largest of corridors 1, 3, 9 wide, both sizes."""

    def per_cell_s(free: np.ndarray, inner: int) -> float:
        goals = goal(free)
        return seconds(lambda: cost_to_go(free, goals, CELL_M), repeats, inner) / float(free.sum())

    found = []
    for side, inner in ((200, 20), (2000, 1)):
        rock_s = per_cell_s(rock_field(side), inner)
        for corridor in (1, 3, 9):
            way_s = per_cell_s(serpentine(side, corridor), inner)
            found.append((way_s / rock_s, way_s, rock_s, f"{side}/{corridor}: {way_s / rock_s:.2f}"))
    worst = max(found)
    note = "side/corridor " + ", ".join(text for *_, text in found)
    return Measured(worst[0], worst[1], worst[2], "our rock field, per free cell", note)


def against_mcp(repeats: int) -> Measured:
    """Measure a 2000 x 2000 rock field against scikit-image's MCP_Geometric (it cuts corners: same work)."""
    from skimage.graph import MCP_Geometric

    free = rock_field(2000)
    goals, prices = goal(free), np.where(free, 1.0, -1.0)
    made = against(
        lambda: cost_to_go(free, goals, CELL_M),
        lambda: MCP_Geometric(prices).find_costs([(0, 0)]),
        "skimage MCP_Geometric",
        repeats,
    )
    return replace(made, note=f"{made.ours_s / free.sum() * 1e9:.1f} ns a free cell")


ROWS = {
    "distance-200": lambda repeats: against_scipy(200, repeats, 10),
    "distance-2000": lambda repeats: against_scipy(2000, repeats, 1),
    "distance-maze": maze,
    "distance-mcp": against_mcp,
}
