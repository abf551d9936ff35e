"""Records of the ground: clouds, grids, the local map and its classes, the orbiter's map."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from onboard.native.arrays import F32, F64
from onboard.records.motion import Pose

U8 = NDArray[np.uint8]
I32 = NDArray[np.int32]
Bool = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Cloud:
    """Beams of one stop in the map frame.

    origin_m: (3,) the scanner's centre, one for all beams (the rover stands).
    ends_m: (n, 3) float32, the hit; for a beam without a hit within the mapping range the point at that range.
    hit: (n,) bool.
    sigma_range_m: noise of a range, 1 sigma.
    """

    origin_m: F64
    ends_m: F32
    hit: Bool
    sigma_range_m: float = 0.02


@dataclass(frozen=True, slots=True)
class Entry:
    """Entry of the map: a cloud with its pose and stop.

    cloud_base: in base_link axes.
    pose: at which the cloud enters the map.
    stop: number of the stop.
    dark_base_m: (k, 3) float32, points of ground that the same sweep did not see, in base_link axes
        (`perception.scan.dark_regions`).
    """

    cloud_base: Cloud
    pose: Pose
    stop: int
    dark_base_m: F32


@dataclass(frozen=True, slots=True)
class Grid:
    """Placement of a grid. Arrays on it are (rows, columns) = z[j, i], row j along +y, column i along +x.

    x0_m, y0_m: centre of cell (0, 0); they lie on (k + 1/2) * cell_m, so moving a grid never resamples.
    cell_m: side of a cell.
    """

    x0_m: float
    y0_m: float
    cell_m: float
    rows: int
    columns: int

    def cell(self, x_m: float, y_m: float) -> tuple[int, int]:
        """(j, i) of the cell that contains the point; may be outside the grid."""
        return round((y_m - self.y0_m) / self.cell_m), round((x_m - self.x0_m) / self.cell_m)

    def contains(self, j: int, i: int) -> bool:
        """Return whether the cell is on the grid."""
        return 0 <= j < self.rows and 0 <= i < self.columns

    def centre(self, j: int, i: int) -> tuple[float, float]:
        """(x_m, y_m) of a cell's centre."""
        return self.x0_m + i * self.cell_m, self.y0_m + j * self.cell_m


@dataclass(frozen=True, slots=True)
class Ldem:
    """Local digital elevation map: statistics of each cell, all (rows, columns); `10-navigation` section 3.

    n: int32, hits.
    sum_z, sum_z2: float64, sums of the heights (m) and their squares (m2).
    z_hi, z_lo: float32, highest and lowest hit, NaN without one.
    sum_sigma: float32, sum of sigma_z of the hits.
    z_ray: float32, lowest height at which a beam crossed the cell without a hit in it, +inf without one.
    view_m: float32, distance of the nearest view, inf without one.
    stop: int16, stop of the nearest view, -1 without one.
    assumed_z: float32, plane under the start, NaN where not assumed.
    """

    grid: Grid
    n: I32
    sum_z: F64
    sum_z2: F64
    z_hi: F32
    z_lo: F32
    sum_sigma: F32
    z_ray: F32
    view_m: F32
    stop: NDArray[np.int16]
    assumed_z: F32


@dataclass(frozen=True, slots=True)
class Surface:
    """Ground as the planner uses it, all (rows, columns); made from an Ldem by perception.map.cell_classes.

    cell_class: uint8 of CellClass.
    z_mean, z_top, z_bot: float32, de-biased heights, NaN where unknown.
    z_ray: float32, +inf where no beam crossed.
    """

    grid: Grid
    cell_class: U8
    z_mean: F32
    z_top: F32
    z_bot: F32
    z_ray: F32


class CellClass(IntEnum):
    """Class of a cell by its beams."""

    OUTSIDE = 0
    OCCLUDED = 1
    HIT = 2
    FILLED = 3
    HOLE = 4
    ASSUMED = 5


class NodeSet(IntEnum):
    """Node sets chi of the chapter (Eq. 2 to 5, made non-circular)."""

    OUTSIDE = 0
    OCCLUDED = 1
    OBSTACLE = 2
    FREE = 3


@dataclass(frozen=True, slots=True)
class Gdem:
    """The orbiter's map. heights_m: (rows, columns) float32, NaN = no data; note: its origin."""

    grid: Grid
    heights_m: F32
    note: str = ""
