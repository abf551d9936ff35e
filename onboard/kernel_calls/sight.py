"""Interface of the line of sight kernel: cost of a straight drive, if it is free."""

from __future__ import annotations

import math

import numpy as np

from onboard.kernel_calls.checks import check_array
from onboard.native.elementary import dist
from onboard.native.variant import kernels
from onboard.records import F32, Bool, Grid

MOST_STATIONS = 10**6  # of a line: more are a mistake, and would take too long


def price_m(
    free: Bool,
    closeness: F32 | None,
    grid: Grid,
    line: tuple[tuple[float, float], tuple[float, float], int],
    spacing_m: float,
) -> float:
    """Cost in metres of a straight drive at a constant body axis, +inf if one of its poses is not free.

    free: bool (orientations, rows, columns) on `grid`.
    closeness: float32, the same shape, or None.
    line: its two ends (x, y) and the orientation.
    spacing_m: largest distance of stations.

    Stations are spaced evenly, both ends included. Each is in its nearest cell; off the grid nothing is free. A piece
    costs its length times 1 + the mean closeness of its ends. Raises ValueError for wrong shapes, dtypes, layout, a
    line that is not finite or has more than MOST_STATIONS, or an orientation out of range.
    """
    check_array("free", free, (None, grid.rows, grid.columns), np.bool_)
    if closeness is not None:
        check_array("closeness", closeness, free.shape, np.float32)
    a, b, orientation = line
    if not (math.isfinite(dist(a, b)) and grid.cell_m > 0.0 and spacing_m > 0.0):
        raise ValueError(f"line: expected finite ends and spacings above 0, given {a} to {b}, {spacing_m}, {grid}")
    if dist(a, b) > MOST_STATIONS * spacing_m:
        raise ValueError(f"line: expected at most {MOST_STATIONS} stations, given {a} to {b} every {spacing_m} m")
    if not 0 <= orientation < free.shape[0]:
        raise ValueError(f"orientation: expected 0 to {free.shape[0] - 1}, given {orientation}")
    layers = free.view(np.uint8)
    return kernels.sight_price_m(layers, closeness, grid.x0_m, grid.y0_m, grid.cell_m, *a, *b, spacing_m, orientation)
