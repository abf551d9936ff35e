"""Interface of the live grid kernel: hits to five statistics of map cells, from points or ranges; no ray casting.

The kernels add in the order of the hits, so hits added in parts give the same bits as hits added at once.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from onboard.kernel_calls.checks import check_array, check_grid
from onboard.native.variant import kernels
from onboard.records import F32, F64, U8, Grid

LARGEST_GRID = 2**31 - 1  # cells: the kernel uses int32
CELL = np.dtype([
    ("sum_z", np.float64), ("sum_z2", np.float64), ("z_hi", np.float32), ("z_lo", np.float32), ("n", np.int32),
    ("unused", np.int32),
])  # fmt: skip


class BeamBlock(NamedTuple):
    """k beams of one turn of the scanner, or of a part of it.

    ranges_m: (k,) float32, NaN for a beam without a return.
    azimuths: (2, k) float64, cosines and sines of the angles in the scanner's plane.
    tilts: (2, k) float64, cosines and sines of the tilt at each beam's own time, positive down.
    longest_m: returns farther than this are no hits.
    """

    ranges_m: F32
    azimuths: F64
    tilts: F64
    longest_m: float


@dataclass(frozen=True, slots=True)
class Mount:
    """Mounting of the scanner, hull of the rover and pose. Raises ValueError for other arrays.

    scanner_m: (3,) float64 in base axes, on the tilt axis.
    hull_m: (any, 2, 3) float64, lowest and highest corner of boxes in base axes; hits in them are the rover's own.
    T_map_base: (4, 4) float64, pose of the rover.
    """

    scanner_m: F64
    hull_m: F64
    T_map_base: F64

    def __post_init__(self) -> None:
        check_array("scanner_m", self.scanner_m, (3,), np.float64)
        check_array("hull_m", self.hull_m, (None, 2, 3), np.float64)
        check_array("T_map_base", self.T_map_base, (4, 4), np.float64)


class LiveGrid:
    """Five statistics of each cell of a grid, updated hit by hit.

    cells: (rows, columns) of CELL, so `cells["n"]` and the others are views; their meanings are those of records.Ldem.
    """

    def __init__(self, grid: Grid) -> None:
        """Create an empty grid: 0, and NaN for highest and lowest. Raises ValueError for a grid without cells."""
        check_grid(grid)
        if grid.rows * grid.columns > LARGEST_GRID:
            raise ValueError(f"grid: expected at most {LARGEST_GRID} cells, given {grid.rows} x {grid.columns}")
        self.grid = grid
        self._bytes = _on_whole_lines((grid.rows, grid.columns, CELL.itemsize))
        kernels.no_hits_into(self._bytes)
        self.cells: NDArray[np.void] = self._bytes.view(CELL)[..., 0]
        self._place = grid.x0_m, grid.y0_m, grid.cell_m

    def add_points(self, points_m: F32) -> None:
        """Add points (n, 3) float32 of the map frame; points off the grid or not finite are left out.

        Raises ValueError for a wrong shape, dtype or layout.
        """
        check_array("points_m", points_m, (None, 3), np.float32)
        kernels.points_into(*self._place, points_m, self._bytes)

    def add_turn(self, turn: BeamBlock, mount: Mount) -> None:
        """Add the hits of one turn: p_map = T_map_base (scanner + R_y(tilt) range (cos azimuth, sin azimuth, 0)).

        Hits in the rover's hull, off the grid or not finite are left out. Raises ValueError for wrong shapes, dtypes
        or layout.
        """
        check_array("ranges_m", turn.ranges_m, (None,), np.float32)
        count = len(turn.ranges_m)
        check_array("azimuths", turn.azimuths, (2, count), np.float64)
        check_array("tilts", turn.tilts, (2, count), np.float64)
        kernels.turn_into(
            *self._place,
            turn.ranges_m,
            turn.azimuths,
            turn.tilts,
            turn.longest_m,
            mount.scanner_m,
            mount.hull_m,
            mount.T_map_base,
            self._bytes,
        )


def _on_whole_lines(shape: tuple[int, int, int]) -> U8:
    """Allocate records of which none lies across two cache lines; numpy only aligns to a multiple of 16."""
    size = math.prod(shape)
    room = np.empty(size + CELL.itemsize, np.uint8)
    first = -room.ctypes.data % CELL.itemsize
    return room[first : first + size].reshape(shape)
