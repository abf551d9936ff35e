"""Interface of the distance transform kernel: least costs over the cells of a grid."""

from __future__ import annotations

import math

import numpy as np

from onboard.kernel_calls.checks import check_array
from onboard.kernel_calls.progress import CancelledError, Progress
from onboard.native.variant import kernels
from onboard.records import F32, F64, Bool

LARGEST_SIDE = 30_000  # cells; flat indices are int32
LARGEST_RATIO = 1e5  # of closeness: there are as many buckets as the most expensive step has cells
DIAGONAL = math.sqrt(2.0)


def cost_to_go(
    free: Bool, goals: Bool, cell_m: float, closeness: F32 | None = None, progress: Progress | None = None
) -> F64:
    """Least cost in metres from each cell to a goal cell, float64 (rows, columns), +inf if there is no path.

    free, goals: bool (rows, columns); a goal that is not free is ignored. Eight neighbours at 1 and sqrt(2) cells, no
        diagonal step between two cells that are not free.
    closeness: float32 (rows, columns), 0 to LARGEST_RATIO on free cells (others are not read), or None; a step's cost
        is multiplied by 1 + its mean at both ends.

    The result is a view into a field with a rim of one cell. Raises ValueError for wrong shapes, dtypes, layout or
    costs; CancelledError.
    """
    check_array("free", free, (None, None), np.bool_)
    rows, columns = free.shape
    if max(rows, columns) > LARGEST_SIDE:
        raise ValueError(f"free: expected at most {LARGEST_SIDE} rows and columns, given {rows} x {columns}")
    check_array("goals", goals, (rows, columns), np.bool_)
    if not 0.0 < cell_m < np.inf:
        raise ValueError(f"cell_m: expected a finite length above 0, given {cell_m}")
    watch = progress or Progress()
    check_array("progress.done", watch.done, (1,), np.int64)
    check_array("progress.stop", watch.stop, (1,), np.uint8)
    dearest = DIAGONAL * (1.0 + _largest(closeness, free))
    cost = np.empty((rows + 2, columns + 2))
    done = kernels.distance_into(
        free.view(np.uint8), goals.view(np.uint8), closeness, cell_m, dearest, watch.done, watch.stop, cost
    )
    if not done:
        raise CancelledError(f"distance transform: stopped after {watch.done[0]} of {free.size} cells")
    return cost[1:-1, 1:-1]


def _largest(closeness: F32 | None, free: Bool) -> float:
    """Largest closeness of a free cell, 0 if there is none. Raises ValueError for one out of range."""
    if closeness is None:
        return 0.0
    check_array("closeness", closeness, free.shape, np.float32)
    least = float(np.min(closeness, where=free, initial=np.inf))
    most = float(np.max(closeness, where=free, initial=0.0))
    if not (least >= 0.0 and most <= LARGEST_RATIO):
        raise ValueError(f"closeness: expected ratios of 0 to {LARGEST_RATIO:g}, given {least} to {most}")
    return most
