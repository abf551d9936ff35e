"""Rays on a raster of heights: the interface of the native kernel (native/heightfield.hpp).

For worlds without physics: the kinematic missions, and ground without engine bodies. Exact to rounding on the
triangulation described in `hil.terrain.field`; no engine, no limit of rays.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hil.native import _heightfield
from onboard.records import F32, F64, Grid


class HeightField:
    """Heights (rows, columns) on the corners of squares, cut from (i + 1, j) to (i, j + 1) like the engine's ground."""

    def __init__(self, grid: Grid, heights_m: F32) -> None:
        if heights_m.shape != (grid.rows, grid.columns) or min(heights_m.shape) < 2:
            wanted = f"{(grid.rows, grid.columns)}, at least (2, 2)"
            raise ValueError(f"heights_m: expected {wanted}, given {heights_m.shape}")
        if not np.isfinite(heights_m).all():
            raise ValueError("heights_m: expected finite heights, given some that are not")
        self.grid = grid
        self.heights_m: F32 = np.ascontiguousarray(heights_m, np.float32)
        z = self.heights_m
        corners = (z[:-1, :-1], z[:-1, 1:], z[1:, :-1], z[1:, 1:])
        self.top_m: F32 = np.ascontiguousarray(np.maximum.reduce(corners))
        self.tile_top_m = highest_of_tiles(self.top_m)

    def cast(self, origin_m: NDArray[np.floating], directions: F64, range_m: float) -> F64:
        """Ranges (n,) of rays from one origin (3,) along unit `directions` (n, 3); inf where nothing is met in range.

        A ray that begins under the ground hits at once. Raises ValueError for wrong shapes or an origin that is not
        finite.
        """
        origin = np.ascontiguousarray(origin_m, np.float64)
        if origin.shape != (3,) or not np.isfinite(origin).all():
            raise ValueError(f"origin_m: expected 3 finite coordinates, given {origin_m!r}")
        ways = np.ascontiguousarray(directions, np.float64)
        if ways.ndim != 2 or ways.shape[1] != 3:
            raise ValueError(f"directions: expected (n, 3), given {ways.shape}")
        ranges_m = np.empty(len(ways))
        grid = self.grid
        _heightfield.cast_into(
            self.heights_m,
            self.top_m,
            self.tile_top_m,
            grid.x0_m,
            grid.y0_m,
            grid.cell_m,
            origin,
            ways,
            range_m,
            ranges_m,
        )
        return ranges_m


def highest_of_tiles(top_m: F32) -> F32:
    """Highest value of each tile of squares, with the kernel's tiles: TILE x TILE, less at the last row and column."""
    along_j = np.maximum.reduceat(top_m, np.arange(0, top_m.shape[0], _heightfield.TILE), axis=0)
    return np.ascontiguousarray(np.maximum.reduceat(along_j, np.arange(0, top_m.shape[1], _heightfield.TILE), axis=1))
