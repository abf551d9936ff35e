"""What the beams said of each cell: hit, filled, hole, assumed, occluded or outside; `10-navigation` section 3.

Extremes of many noisy hits lie far apart, so bounds are de-biased by what noise alone would do. A gap between hits is
filled only where a beam passed close above the ground that should be there; a beam that passed below it proves a hole.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from onboard import config
from onboard.records import F32, F64, Bool, CellClass, Ldem, Surface

RAY_MARGIN_M = 0.02  # a beam this far below counts as noise
FILL_ABOVE_M = 0.08  # a beam higher above the gap than this vouches for nothing
HOLE_DEPTH_M = 0.06  # a beam this far below the ground that should be there proves a hole
FILL_STEP_M, FILL_STEP_PER_CELL_M = 0.08, 0.036  # largest difference of the hits on both sides of a gap
DIRECTIONS = ((0, 1), (1, 0), (1, 1), (1, -1))  # rows, columns, both diagonals: (dj, di)


def classify(ldem: Ldem, mapping: config.Mapping_) -> Surface:
    """Classes and de-biased heights of every cell (Eq. 1's z with its uncertainty; `10-navigation` section 3).

    All (rows, columns) on the Ldem's grid: cell_class uint8, z_mean, z_top, z_bot and z_ray float32, metres in the map
    frame. Occluded and outside cells have NaN heights; filled, hole and assumed ones the same z_mean, z_top and z_bot.
    An Ldem without hits and assumed cells gives no error but a surface without a known cell.
    """
    hit = ldem.n > 0
    mean, top, bottom = _bounds(ldem, hit)
    gap = _gaps(hit, mean, ldem.z_ray, mapping.fill_cells)
    assumed = ~hit & ~gap.hole & ~gap.filled & np.isfinite(ldem.assumed_z)

    classes = np.where(np.isfinite(ldem.z_ray), np.uint8(CellClass.OCCLUDED), np.uint8(CellClass.OUTSIDE))
    z_mean = np.where(hit, mean, np.nan)
    for chosen, kind, height in (
        (assumed, CellClass.ASSUMED, ldem.assumed_z),
        (gap.filled, CellClass.FILLED, gap.height),
        (gap.hole, CellClass.HOLE, ldem.z_ray),
    ):
        classes[chosen] = kind
        z_mean[chosen] = height[chosen]
    classes[hit] = CellClass.HIT
    return Surface(
        grid=ldem.grid,
        cell_class=classes,
        z_mean=z_mean.astype(np.float32),
        z_top=np.where(hit, top, z_mean).astype(np.float32),
        z_bot=np.where(hit, bottom, z_mean).astype(np.float32),
        z_ray=ldem.z_ray,
    )


def _bounds(ldem: Ldem, hit: Bool) -> tuple[F64, F64, F64]:
    """Mean, z_top and z_bot of the hit cells, NaN elsewhere; the spread that noise makes of n hits is taken out."""
    n = np.where(hit, ldem.n, 1)
    mean = np.where(hit, ldem.sum_z / n, np.nan)
    bias = ldem.sum_sigma / n * np.sqrt(2.0 * np.log(n + 1.0))
    low = np.minimum(ldem.z_lo, ldem.z_ray + np.float32(RAY_MARGIN_M))
    return mean, np.maximum(mean, ldem.z_hi - bias), np.minimum(mean, low + bias)


class _Gaps(NamedTuple):
    filled: Bool
    hole: Bool
    height: F64  # of filled cells: mean over the directions that fit


def _gaps(hit: Bool, mean: F64, z_ray: F32, fill_cells: int) -> _Gaps:
    """Cells without a hit between hits at most `fill_cells` missing cells apart, along any of four directions.

    A hole proved along one direction outweighs a fill along another: its surface, z_ray, lies within the fill's bounds
    then or is the danger itself.
    """
    hole, total, count = np.zeros_like(hit), np.zeros(hit.shape), np.zeros(hit.shape, np.int32)
    pad = max(1, fill_cells)
    heights = np.pad(mean, pad, constant_values=np.nan)
    for direction in DIRECTIONS:
        waiting = ~hit
        for missing in range(1, fill_cells + 1):
            for before in range(1, missing + 1):
                after = missing + 1 - before
                low, high = _at(heights, -before, direction, pad), _at(heights, after, direction, pad)
                bracketed = waiting & np.isfinite(low) & np.isfinite(high)
                waiting &= ~bracketed
                middle = low + (high - low) * (before / (missing + 1))
                even = bracketed & (np.abs(high - low) <= FILL_STEP_M + FILL_STEP_PER_CELL_M * missing)
                hole |= even & (z_ray < middle - HOLE_DEPTH_M)
                fits = even & (z_ray >= middle - RAY_MARGIN_M) & (z_ray <= middle + FILL_ABOVE_M)
                total += np.where(fits, middle, 0.0)
                count += fits
    return _Gaps((count > 0) & ~hole, hole, total / np.maximum(count, 1))


def _at(padded: F64, steps: int, direction: tuple[int, int], pad: int) -> F64:
    """The neighbour that lies `steps` in `direction` of every cell of the unpadded grid."""
    dj, di, (rows, columns) = steps * direction[0], steps * direction[1], padded.shape
    return padded[pad + dj : rows - pad + dj, pad + di : columns - pad + di]
