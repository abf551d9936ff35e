"""Heights on a grid: slope, mean, and the one triangulation for physics, soil, scanner and truth maps.

Heights are on the centres of a grid; each square of four centres is two triangles, cut from (x + 1, y) to (x, y + 1).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onboard.native import each
from onboard.records import F32, F64, I32, Grid


def slopes_deg(heights: F64 | F32, cell_m: float) -> F64:
    """Slope of the ground over two cells, degrees, (rows - 2, columns - 2)."""
    z = heights.astype(np.float64)
    dy, dx = (z[2:, 1:-1] - z[:-2, 1:-1]) / (2 * cell_m), (z[1:-1, 2:] - z[1:-1, :-2]) / (2 * cell_m)
    return np.degrees(each.atan2(np.sqrt(dx * dx + dy * dy), 1.0))


def block_mean(heights: F64, factor: int) -> F64:
    """Mean over squares of factor x factor cells."""
    rows, columns = heights.shape[0] // factor, heights.shape[1] // factor
    return heights[: rows * factor, : columns * factor].reshape(rows, factor, columns, factor).mean(axis=(1, 3))


def soil_height(grid: Grid, soil_z: F32, x_m: F64, y_m: F64) -> F64:
    """Height of the triangulated soil at points (n,); a point off the mesh gets the height of the nearest edge."""
    u = np.clip((np.asarray(x_m) - grid.x0_m) / grid.cell_m, 0, grid.columns - 1)
    v = np.clip((np.asarray(y_m) - grid.y0_m) / grid.cell_m, 0, grid.rows - 1)
    i = np.minimum(u.astype(np.int64), grid.columns - 2)
    j = np.minimum(v.astype(np.int64), grid.rows - 2)
    u, v, z = u - i, v - j, soil_z.astype(np.float64, copy=False)
    z00, z10, z01, z11 = z[j, i], z[j, i + 1], z[j + 1, i], z[j + 1, i + 1]
    lower = z00 + u * (z10 - z00) + v * (z01 - z00)
    upper = z11 + (1 - u) * (z01 - z11) + (1 - v) * (z10 - z11)
    return np.where(u + v <= 1, lower, upper)


def squares(rows: int, columns: int) -> I32:
    """Triangles of a (rows, columns) grid of vertices, cut from (x + 1, y) to (x, y + 1), facing up: (n, 3) int32."""
    first = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)[None, :]).ravel()
    lower = np.column_stack((first, first + 1, first + columns))
    upper = np.column_stack((first + 1, first + columns + 1, first + columns))
    return np.concatenate((lower, upper)).astype(np.int32)


def field_triangles(grid: Grid, soil_z: F32, bodies: Sequence[F64]) -> F64:
    """Corners (n, 3, 3) of all triangles: of the soil, then of bodies (t, 3, 3) on it; third axis x, y, z in m."""
    x = grid.x0_m + np.arange(grid.columns) * grid.cell_m
    y = grid.y0_m + np.arange(grid.rows) * grid.cell_m
    points = np.dstack((*np.meshgrid(x, y), soil_z)).reshape(-1, 3)
    return np.concatenate([points[squares(grid.rows, grid.columns)], *bodies])
