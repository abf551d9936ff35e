"""Resampling of an elevation file's heights to the cells of a map.

No file is read whole: the map is computed in tiles, and a tile reads the cells under it. Cells of the map that are
larger than those of the file get the mean over their area, smaller ones are interpolated between four centres. A cell
of the map is known if at least half of its weight is: heights never extend over unmeasured area.

(GDAL's warper was tried. Its transformation is approximate and differs from tile to tile, by metres of height on steep
ground, and rasterio 1.4 gives no way to make it exact.)
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from onboard.bringup.maps.dem_file import Dem, Site
from onboard.bringup.maps.dem_words import DemError
from onboard.records import F64, Grid

TILE_SIDE = 1024  # samples along a side of a tile
SAMPLES_A_CELL = 4  # of the file, along each axis, for means
KNOWN_RATIO = 0.5
ROUNDING = 1e-6


@dataclass(frozen=True, slots=True)
class Cells:
    """Window of the file with a border of NaN.

    heights_m: heights, m.
    row, column: cell of the file at [0, 0].
    size: number of cells that were read.
    """

    heights_m: F64
    row: int
    column: int
    size: int

    def at(self, rows: F64, columns: F64) -> F64:
        """Heights of the cells that contain the places (fractional rows and columns of the file); NaN outside."""
        last_row, last_column = (length - 1 for length in self.heights_m.shape)
        j = np.clip(np.floor(rows).astype(np.int64) - self.row, 0, last_row)
        i = np.clip(np.floor(columns).astype(np.int64) - self.column, 0, last_column)
        found: F64 = self.heights_m[j, i]
        return found


@dataclass(frozen=True, slots=True)
class ResampledMap:
    """Result of the resampling.

    heights_m: heights on the map's grid, float64, NaN where unknown.
    cells_read: cells of the file that were read.
    lowest_m, highest_m: of those cells; +inf and -inf if none had a height.
    """

    heights_m: F64
    cells_read: int
    lowest_m: float
    highest_m: float


def resample(site: Site, grid: Grid, progress: Callable[[int, int], None]) -> ResampledMap:
    """Resample the file's heights to the map's grid (origin at the start).

    progress: called after each tile with the number of finished tiles and of all tiles. Raises DemError if reading
        fails.
    """
    _refuse_pole(site, grid)
    ratio = grid.cell_m / site.cell_m + ROUNDING
    samples = math.ceil(SAMPLES_A_CELL * (ratio - 2 * ROUNDING)) if ratio >= 1.0 else 0
    side = max(1, TILE_SIDE // max(1, samples))
    tiles = [(j, i) for j in range(0, grid.rows, side) for i in range(0, grid.columns, side)]
    heights, cells_read, lowest_m, highest_m = np.full((grid.rows, grid.columns), np.nan), 0, math.inf, -math.inf
    for done, (j, i) in enumerate(tiles, start=1):
        part = heights[j : j + side, i : i + side]
        rows, columns = _corners(site, grid, (j, i), part.shape)
        cells = _cells_under(site.dem, rows, columns)
        part[:] = _means(cells, rows, columns, samples) if samples else _between(cells, rows, columns)
        cells_read += cells.size
        lowest_m = min(lowest_m, float(np.fmin.reduce(cells.heights_m, axis=None, initial=math.inf)))
        highest_m = max(highest_m, float(np.fmax.reduce(cells.heights_m, axis=None, initial=-math.inf)))
        progress(done, len(tiles))
    return ResampledMap(heights, cells_read, lowest_m, highest_m)


def _refuse_pole(site: Site, grid: Grid) -> None:
    pole = site.pole_m
    if pole and grid.contains(*grid.cell(*pole)):
        raise DemError("has a pole in the region, where longitudes meet; take the product in a polar projection")


def _corners(site: Site, grid: Grid, first: tuple[int, int], shape: tuple[int, ...]) -> tuple[F64, F64]:
    """Fractional rows and columns of the file at the corners of a tile's cells, each (shape[0] + 1, shape[1] + 1)."""
    x_m = grid.x0_m + grid.cell_m * (first[1] + np.arange(shape[1] + 1) - 0.5)
    y_m = grid.y0_m + grid.cell_m * (first[0] + np.arange(shape[0] + 1) - 0.5)
    x, y = np.meshgrid(x_m, y_m)
    rows, columns = site.rows_columns(x.ravel(), y.ravel())
    return rows.reshape(x.shape), columns.reshape(x.shape)


def _cells_under(dem: Dem, rows: F64, columns: F64) -> Cells:
    """Read the file's cells under a tile and one more on each side: NaN where the file has none."""
    row, row_end = _span(rows, dem.rows)
    column, column_end = _span(columns, dem.columns)
    read = np.zeros((0, 0))
    if row < row_end and column < column_end:
        read = dem.read(row, column, row_end - row, column_end - column)
    return Cells(np.pad(read, 1, constant_values=np.nan), row - 1, column - 1, read.size)


def _span(at: F64, count: int) -> tuple[int, int]:
    return max(0, math.floor(at.min()) - 1), min(count, math.ceil(at.max()) + 1)


def _means(cells: Cells, rows: F64, columns: F64, samples: int) -> F64:
    """Means over the cells of a tile, each sampled at `samples` x `samples` places."""
    inside = (np.arange(samples) + 0.5) / samples
    heights = cells.at(_spread(rows, inside), _spread(columns, inside))
    known = np.isfinite(heights)
    count = known.sum(axis=(2, 3))
    sums = np.where(known, heights, 0.0).sum(axis=(2, 3))
    return np.where(count >= KNOWN_RATIO * samples**2, sums / np.maximum(count, 1), np.nan)


def _spread(corners: F64, inside: F64) -> F64:
    """Interpolate corners (n + 1, m + 1) linearly to (n, m, k, k) places inside the cells."""
    down = corners[:-1, :, None] + (corners[1:] - corners[:-1])[:, :, None] * inside
    left, right = down[:, :-1, :, None], down[:, 1:, :, None]
    return left + (right - left) * inside


def _between(cells: Cells, rows: F64, columns: F64) -> F64:
    """Heights at the centres of the cells of a tile, linear between the file's four centres around each."""
    middle = np.array([0.5])
    row, column = (_spread(corners, middle)[:, :, 0, 0] - 0.5 for corners in (rows, columns))
    below, right = row - np.floor(row), column - np.floor(column)
    sums, weights = np.zeros(row.shape), np.zeros(row.shape)
    for j, i in ((0, 0), (0, 1), (1, 0), (1, 1)):
        height = cells.at(row + j, column + i)
        weight = np.where(np.isfinite(height), np.abs(1 - j - below) * np.abs(1 - i - right), 0.0)
        sums += weight * np.nan_to_num(height)
        weights += weight
    return np.where(weights >= KNOWN_RATIO - ROUNDING, sums / np.maximum(weights, ROUNDING), np.nan)
