"""Grids as coloured triangles, and lines laid on the ground."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hil.terrain.mesh import soil_height
from hil.view.story import TrueGround
from onboard.planning.archive import PlanPicture
from onboard.records import F32, F64, I32, U8, Bool, Grid, NodeSet
from pictures.rim import rim

LARGEST = 400_000  # nodes of the ground; of a larger field every second node is shown, and so on
ABOVE_M = 0.03  # height of drawn objects above the ground
SOIL_LOW, SOIL_HIGH, ROCK = (150, 138, 120), (205, 196, 180), (120, 86, 66)
SETS = {  # as in the report's pictures
    NodeSet.OUTSIDE: (247, 247, 247), NodeSet.OCCLUDED: (120, 120, 150), NodeSet.OBSTACLE: (222, 110, 40),
    NodeSet.FREE: (90, 190, 150),
}  # fmt: skip
RIM = (235, 222, 150)


class Surface(NamedTuple):
    """Coloured triangles.

    vertices_m: (v, 3) float32
    triangles: (t, 3) int32, seen from above
    colours: (v, 3) uint8
    texture: the same colours, (rows, columns, 3) uint8, row along +y
    uv: (v, 2) place in the texture across columns and rows, 0 to 1
    """

    vertices_m: F32
    triangles: I32
    colours: U8
    texture: U8
    uv: F32


def ground_surface(ground: TrueGround) -> Surface:
    """Surface of the ground: soil lighter where it is higher, rocks brown."""
    step = 1
    while ground.heights_m[::step, ::step].size > LARGEST:
        step += 1
    heights_m = ground.heights_m[::step, ::step]
    x_m, y_m = (axis[::step] for axis in _axes(ground.grid))
    low, high = np.percentile(heights_m, (2, 98))
    share = np.clip((heights_m - low) / max(high - low, 1e-6), 0, 1)[..., None]
    colours = (1 - share) * SOIL_LOW + share * SOIL_HIGH
    colours[_under_rocks(ground, x_m, y_m)] = ROCK
    return _surface(x_m, y_m, heights_m, np.ones(heights_m.shape, bool), colours.astype(np.uint8))


def map_surface(plan: PlanPicture) -> Surface:
    """Flight program's map at a stop: cells with a known height, in the colours of the node sets."""
    known = np.isfinite(plan.heights_m) & (plan.node_sets != NodeSet.OUTSIDE)
    colours = np.zeros((*known.shape, 3), np.uint8)
    for node_set, colour in SETS.items():
        colours[plan.node_sets == node_set] = colour
    colours[rim(plan.node_sets, plan.heights_m, plan.grid.cell_m)] = RIM
    return _surface(*_axes(plan.grid), np.where(known, plan.heights_m + ABOVE_M, 0.0), known, colours)


def on_ground(ground: TrueGround, way: F64) -> F64:
    """Path (k, 2 or more) as points (k, 3) a little above the ground."""
    heights_m = soil_height(ground.grid, ground.heights_m, way[:, 0], way[:, 1])
    return np.column_stack((way[:, :2], heights_m + 2 * ABOVE_M))


def lifted(points_m: F32) -> F32:
    """Points (n, 3) raised so that neither the ground nor the map on it hides them."""
    return points_m + np.float32((0.0, 0.0, 1.5 * ABOVE_M))


def segments(points_m: F64) -> F64:
    """Segments (k - 1, 2, 3) of a polyline (k, 3)."""
    return np.stack((points_m[:-1], points_m[1:]), axis=1)


def dashes(points_m: F64, dash_m: float = 0.15) -> F64:
    """Dashes (n, 2, 3) of a polyline (k, 3), with gaps of the same length."""
    lengths_m = np.linalg.norm(np.diff(points_m, axis=0), axis=1)
    at_m = np.concatenate(([0.0], np.cumsum(lengths_m)))
    starts_m = np.arange(0.0, at_m[-1], 2 * dash_m)
    ends = (np.minimum(starts_m + part, at_m[-1]) for part in (0.0, dash_m))
    return np.stack([np.column_stack([np.interp(m, at_m, axis) for axis in points_m.T]) for m in ends], axis=1)


def _axes(grid: Grid) -> tuple[F64, F64]:
    return grid.x0_m + grid.cell_m * np.arange(grid.columns), grid.y0_m + grid.cell_m * np.arange(grid.rows)


def _under_rocks(ground: TrueGround, x_m: F64, y_m: F64) -> Bool:
    """True for nodes in the disc of a rock, (rows, columns)."""
    under: NDArray[np.bool_] = np.zeros((len(y_m), len(x_m)), bool)
    for x, y, diameter in ground.rocks:
        i = slice(*np.searchsorted(x_m, (x - diameter / 2, x + diameter / 2)))
        j = slice(*np.searchsorted(y_m, (y - diameter / 2, y + diameter / 2)))
        under[j, i] |= np.hypot(x_m[i] - x, y_m[j, None] - y) <= diameter / 2
    return under


def _surface(x_m: F64, y_m: F64, heights_m: F32, known: Bool, colours: NDArray[np.uint8]) -> Surface:
    """Surface of the squares whose four corners are known, each cut as in the physics (hil.terrain.mesh)."""
    number = np.arange(known.size).reshape(known.shape)
    whole = known[:-1, :-1] & known[:-1, 1:] & known[1:, :-1] & known[1:, 1:]
    a, b, c, d = (corner[whole] for corner in (number[:-1, :-1], number[:-1, 1:], number[1:, :-1], number[1:, 1:]))
    triangles = np.concatenate((np.column_stack((a, b, c)), np.column_stack((b, d, c)))).astype(np.int32)
    vertices = np.dstack((*np.meshgrid(x_m, y_m), heights_m)).reshape(-1, 3).astype(np.float32)
    used, triangles = np.unique(triangles, return_inverse=True)
    rows, columns = known.shape
    uv = np.column_stack((used % columns + 0.5, used // columns + 0.5)) / (columns, rows)
    triangles = triangles.reshape(-1, 3).astype(np.int32)
    return Surface(vertices[used], triangles, colours.reshape(-1, 3)[used], colours, uv.astype(np.float32))
