"""Which poses the rover may take: (cell, one of 8 orientations) free, blocked or unknown, and the node sets of the chapter.

Orientation o stands for the body's axis at o * 22.5 degrees against +x, modulo 180: the rover is symmetric, which end leads
is decided by the path. Arrays over poses are (8, rows, columns) = freedom[o, j, i].
"""

from __future__ import annotations

import math
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from onboard import config
from onboard.records import F32, I32, U8, Bool, Grid, Surface

ORIENTATIONS = 8


class Freedom(IntEnum):
    """What is known of a pose."""

    BLOCKED = 0
    UNKNOWN = 1
    FREE = 2


def orientation(yaw_rad: float) -> int:
    """The orientation 0..7 nearest to a yaw."""
    return round(yaw_rad / (math.pi / ORIENTATIONS)) % ORIENTATIONS


def pose_index(grid: Grid, x_m: float, y_m: float, yaw_rad: float) -> tuple[int, int, int]:
    """(j, i, o) of the pose nearest to a place and yaw; the cell may lie outside the grid."""
    return (*grid.cell(x_m, y_m), orientation(yaw_rad))


def pose_freedom(surface: Surface, rover: config.Rover, planning: config.Planning) -> U8:
    """Freedom of every pose, uint8 (8, rows, columns); `10-navigation` section 3."""
    raise NotImplementedError


def trail(freedom: U8, poses: NDArray[np.integer]) -> U8:
    """A copy with the driven poses free (R2). poses: (k, 3) integers j, i, o; those outside the grid are left out."""
    raise NotImplementedError


def closeness(freedom: U8, planning: config.Planning, cell_m: float) -> F32:
    """Soft cost ratio >= 0 near blocked poses, float32 (8, rows, columns): a move's price is multiplied by 1 + it."""
    raise NotImplementedError


def reachable(freedom: U8, j: int, i: int, o: int) -> Bool:
    """Free poses connected with pose (j, i, o) over free poses, bool (8, rows, columns); all False if it is not free."""
    raise NotImplementedError


def node_sets(surface: Surface, freedom: U8, reachable_mask: Bool) -> U8:
    """The sets chi of the cells, uint8 of NodeSet (rows, columns); disjoint, their union is the grid (Eq. 2 to 5)."""
    raise NotImplementedError
