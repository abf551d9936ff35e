"""What the beams said of each cell: hit, filled, hole, assumed, occluded or outside; `10-navigation` section 3.

Extremes of many noisy hits lie far apart, so bounds are de-biased by what noise alone would do. A gap between hits is
filled only where a beam passed close above the ground that should be there; a beam that passed below it proves a hole.
"""

from __future__ import annotations

import math
from statistics import NormalDist

import numpy as np

from onboard import config
from onboard.native import cell_classes as kernel
from onboard.native import each
from onboard.perception.ldem import ROBUST_HITS
from onboard.records import F64, Ldem, Surface

RAY_MARGIN_M = 0.02  # a beam this far below counts as noise
FILL_ABOVE_M = 0.08  # a beam higher above the gap than this vouches for nothing
HOLE_DEPTH_M = 0.06  # a beam this far below the ground that should be there proves a hole
FILL_STEP_M, FILL_STEP_PER_CELL_M = 0.08, 0.036  # largest difference of the hits on both sides of a gap


COUNTS = 1024  # more hits spread hardly farther
# Standard deviation of the largest of n normal deviates, n = 0 ... 7 (David and Nagaraja, Order Statistics, 2003).
SIGMA_OF_LARGEST = (0.0, 1.0, 0.8256, 0.7480, 0.7012, 0.6690, 0.6449, 0.6260)
SIGMAS = 1.0  # of a bound's own noise, by which it is put outward


def _spreads() -> F64:
    """(COUNTS,) How far the bounds of n hits are drawn in towards their mean, in sigmas of a hit; below 0: put outward.

    The expected largest of n normal deviates, from ROBUST_HITS on the largest but one (`ldem.insert`), less SIGMAS of
    its own standard deviation: the quantile (k - 3/8) / (n + 1/4) of the k-th smallest (Blom, Statistical Estimates and
    Transformed Beta-Variables, 1958), and the first term of its variance, p (1 - p) / ((n + 2) density^2) with
    p = k / (n + 1) (David and Johnson, Biometrika 41, 1954), which is too coarse for the largest of a few.
    """
    normal, spread = NormalDist(), np.zeros(COUNTS)
    for n in range(1, COUNTS):
        k = n - 1 if n >= ROBUST_HITS else n
        p = k / (n + 1)
        sigma = math.sqrt(p * (1.0 - p) / (n + 2)) / normal.pdf(normal.inv_cdf(p))
        if n < ROBUST_HITS:
            sigma = SIGMA_OF_LARGEST[n]
        spread[n] = normal.inv_cdf((k - 0.375) / (n + 0.25)) - SIGMAS * sigma
    return np.round(spread, 9)  # the C library's last bits cut off: the same on every processor


SPREAD = _spreads()
MOST_SPREAD: F64 = np.sqrt(2.0 * each.log(np.arange(COUNTS) + 1.0))  # that noise hardly ever goes beyond


def classify(ldem: Ldem, mapping: config.Mapping_, spread: F64 = SPREAD) -> Surface:
    """Classes and de-biased heights of every cell (Eq. 1's z with its uncertainty; `10-navigation` section 3).

    All (rows, columns) on the Ldem's grid: cell_class uint8, z_mean, z_top, z_bot and z_ray float32, metres in the map
    frame. Occluded and outside cells have NaN heights; filled, hole and assumed ones the same z_mean, z_top and z_bot.
    spread: (counts,) how far bounds of n hits are drawn in, in sigmas; MOST_SPREAD for who must not take noise for
    ground. An Ldem without hits and assumed cells gives no error but a surface without a known cell.

    Bounds of n hits: z_hi and z_lo (or z_ray + 2 cm where that is lower) drawn in by what noise of sigma_z alone does
    to them (`_spreads`), never past the mean. Gaps: along each of rows, columns and both diagonals the line between the
    nearest hits at most `fill_cells` missing cells apart says where ground should be; a filled cell takes the mean over
    the lines that fit, a hole proved along one line outweighs a fill along another: its surface, z_ray, lies within the
    fill's bounds then or is the danger itself. Raises ValueError for layers of wrong shape, dtype or layout.
    """
    rules = kernel.Rules(
        mapping.fill_cells, RAY_MARGIN_M, FILL_ABOVE_M, HOLE_DEPTH_M, FILL_STEP_M, FILL_STEP_PER_CELL_M
    )
    return Surface(ldem.grid, *kernel.classify(ldem, rules, spread), z_ray=ldem.z_ray)
