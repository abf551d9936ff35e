"""What the beams said of each cell: hit, filled, hole, assumed, occluded or outside; `10-navigation` section 3.

Extremes of many noisy hits lie far apart, so bounds are de-biased by what noise alone would do. A gap between hits is
filled only where a beam passed close above the ground that should be there; a beam that passed below it proves a hole.
"""

from __future__ import annotations

from onboard import config
from onboard.native import cell_classes as kernel
from onboard.records import Ldem, Surface

RAY_MARGIN_M = 0.02  # a beam this far below counts as noise
FILL_ABOVE_M = 0.08  # a beam higher above the gap than this vouches for nothing
HOLE_DEPTH_M = 0.06  # a beam this far below the ground that should be there proves a hole
FILL_STEP_M, FILL_STEP_PER_CELL_M = 0.08, 0.036  # largest difference of the hits on both sides of a gap


def classify(ldem: Ldem, mapping: config.Mapping_) -> Surface:
    """Classes and de-biased heights of every cell (Eq. 1's z with its uncertainty; `10-navigation` section 3).

    All (rows, columns) on the Ldem's grid: cell_class uint8, z_mean, z_top, z_bot and z_ray float32, metres in the map
    frame. Occluded and outside cells have NaN heights; filled, hole and assumed ones the same z_mean, z_top and z_bot.
    An Ldem without hits and assumed cells gives no error but a surface without a known cell.

    Bounds of n hits: z_hi and z_lo (or z_ray + 2 cm where that is lower) drawn in by sigma_z sqrt(2 ln(n + 1)), never
    past the mean. Gaps: along each of rows, columns and both diagonals the line between the nearest hits at most
    `fill_cells` missing cells apart says where ground should be; a filled cell takes the mean over the lines that fit,
    a hole proved along one line outweighs a fill along another: its surface, z_ray, lies within the fill's bounds then
    or is the danger itself. Raises ValueError for layers of wrong shape, dtype or layout.
    """
    rules = kernel.Rules(
        mapping.fill_cells, RAY_MARGIN_M, FILL_ABOVE_M, HOLE_DEPTH_M, FILL_STEP_M, FILL_STEP_PER_CELL_M
    )
    return Surface(ldem.grid, *kernel.classify(ldem, rules), z_ray=ldem.z_ray)
