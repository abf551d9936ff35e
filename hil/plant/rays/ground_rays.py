"""Rays on soil and rocks: the interface of the native kernel (native/rocks.hpp). Exact to rounding, no limit of rays.

Soil is the field's raster, rocks are their own triangles: the same as the engine's bodies. A turn of the scanner takes
less than half of the engine's time.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hil.native import _heightfield
from hil.plant.rays.check import check_rays
from hil.terrain.field import Field
from hil.terrain.heightfield import HeightField, highest_of_tiles
from hil.terrain.rocks import Rock
from onboard.records import F64, Grid

I32 = NDArray[np.int32]
MARGIN_M = 0.01  # above and below all ground: level ground is no empty layer


class GroundRays:
    """Caster on one field by the native kernel."""

    def __init__(self, field: Field) -> None:
        soil, rocks = HeightField(field.grid, field.soil_z), field.rocks
        corners = [rock.vertices_m[rock.triangles] for rock in rocks]
        a, b, c = np.moveaxis(np.concatenate([np.empty((0, 3, 3)), *corners]), 1, 0)
        boxes = np.array([(rock.vertices_m.min(axis=0), rock.vertices_m.max(axis=0)) for rock in rocks], np.float64)
        boxes = boxes.reshape(-1, 2, 3)
        squares = [_squares(field.grid, box) for box in boxes]
        of, of_from = _by_square(field.grid, squares)
        rim = np.array([n for n, box in enumerate(boxes) if _overhangs(field.grid, box)], np.int32)
        reach_m = soil.top_m.ravel().copy()
        for where, box in zip(squares, boxes):
            reach_m[where] = np.maximum(reach_m[where], np.nextafter(np.float32(box[1, 2]), np.float32(np.inf)))
        heights_m = (*field.soil_z.ravel()[[field.soil_z.argmin(), field.soil_z.argmax()]], *boxes[:, :, 2].ravel())
        self._soil = (soil.heights_m, soil.top_m, soil.tile_top_m, field.grid.x0_m, field.grid.y0_m, field.grid.cell_m)
        tile_reach_m = highest_of_tiles(reach_m.reshape(soil.top_m.shape))
        self._rocks = (
            np.ascontiguousarray(np.stack((a, b - a, c - a), axis=1)),
            _first(rocks),
            boxes,
            of,
            of_from,
            rim,
            reach_m,
            tile_reach_m,
            float(min(heights_m)) - MARGIN_M,
            float(max(heights_m)) + MARGIN_M,
        )

    def cast(self, origins_m: F64, directions: F64, range_m: float) -> F64:
        """Ranges (n,) of rays from origins (n, 3) along unit directions (n, 3); inf where nothing is met in range.

        Raises ValueError unless both have the same shape (n, 3).
        """
        check_rays(origins_m, directions)
        ranges_m = np.empty(len(directions))
        origins, ways = (np.ascontiguousarray(each, np.float64) for each in (origins_m, directions))
        _heightfield.cast_ground_into(*self._soil, *self._rocks, origins, ways, range_m, ranges_m)
        return ranges_m


def _first(rocks: tuple[Rock, ...]) -> I32:
    """First triangle of each rock, (n + 1)."""
    return np.cumsum([0, *(len(rock.triangles) for rock in rocks)]).astype(np.int32)


def _squares(grid: Grid, box: F64) -> I32:
    """Squares of the raster under a box, and one more on each side for rounding, as numbers j * (columns - 1) + i."""
    (i0, j0), (i1, j1) = np.floor((box[:, :2] - (grid.x0_m, grid.y0_m)) / grid.cell_m).astype(int)
    i = np.arange(max(i0 - 1, 0), min(i1 + 2, grid.columns - 1))
    j = np.arange(max(j0 - 1, 0), min(j1 + 2, grid.rows - 1))
    return (j[:, None] * (grid.columns - 1) + i).ravel().astype(np.int32)


def _by_square(grid: Grid, squares: list[I32]) -> tuple[I32, I32]:
    """Rocks by the square that they cover, square after square, and the first entry of each square, (squares + 1)."""
    where = np.concatenate([np.empty(0, np.int32), *squares])
    rocks = np.repeat(np.arange(len(squares), dtype=np.int32), [len(each) for each in squares])
    count = np.bincount(where, minlength=(grid.rows - 1) * (grid.columns - 1))
    return rocks[np.argsort(where, kind="stable")], np.concatenate(([0], np.cumsum(count))).astype(np.int32)


def _overhangs(grid: Grid, box: F64) -> bool:
    """True if a box extends over the raster's rim."""
    far_m = grid.centre(grid.rows - 1, grid.columns - 1)
    return bool((box[0, :2] < (grid.x0_m, grid.y0_m)).any() or (box[1, :2] > far_m).any())
