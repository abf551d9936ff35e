"""Rim of the unknown ground: known cells in which no pose is free only because ground beside them was not seen.

The chapter's set "obstacle" is every known cell that is not the centre of a free pose. Round the seen ground that is a
band of half a rover's width: no step is there, but a wheel would stand on ground that nobody has seen. A picture that
paints both alike shows a wall round everything.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from onboard.records import F32, U8, Bool, NodeSet

REACH_M = 0.55  # from the body's centre to the farthest wheel's cell
STEP_M = 0.07  # `planning.step_m`
COLOUR, NAME = "#efe3b0", "beside unknown ground"


def rim(node_sets: U8, heights_m: F32, cell_m: float) -> Bool:
    """Obstacle cells with unknown ground and no step of STEP_M within REACH_M. All arrays (rows, columns).

    Ground beyond the grid is unknown.
    """
    unknown = (node_sets == NodeSet.OUTSIDE) | (node_sets == NodeSet.OCCLUDED)
    near = _disk(max(1, round(REACH_M / cell_m)))
    beside = ndimage.binary_dilation(unknown, near, border_value=1)
    stepped = ndimage.binary_dilation(_steps_m(heights_m) > STEP_M, near)
    return np.asarray((node_sets == NodeSet.OBSTACLE) & beside & ~stepped)


def _steps_m(heights_m: F32) -> NDArray[np.float64]:
    """Largest difference of height between a cell and its four neighbours, (rows, columns); 0 beside unknown cells."""
    heights = np.asarray(heights_m, np.float64)
    found = np.zeros(heights.shape)
    for axis in (0, 1):
        step = np.nan_to_num(np.abs(np.diff(heights, axis=axis)))
        low, high = [slice(None)] * 2, [slice(None)] * 2
        low[axis], high[axis] = slice(None, -1), slice(1, None)
        found[tuple(low)] = np.maximum(found[tuple(low)], step)
        found[tuple(high)] = np.maximum(found[tuple(high)], step)
    return found


def _disk(cells: int) -> Bool:
    y, x = np.mgrid[-cells : cells + 1, -cells : cells + 1]
    return np.asarray(x * x + y * y <= cells * cells)
