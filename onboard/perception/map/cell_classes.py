"""Class of each map cell: hit, filled, hole, assumed, occluded or outside; `10-navigation` section 3.

The extremes of many noisy hits lie far apart, so bounds are corrected by the spread that noise alone causes. A gap
between hits is filled only where a beam passed close above the expected ground; a beam that passed below it proves a
hole.
"""

from __future__ import annotations

import math
from statistics import NormalDist

import numpy as np

from onboard import config
from onboard.kernel_calls import cell_classes as kernel
from onboard.native import each
from onboard.perception.map.ldem import ROBUST_HITS
from onboard.records import F64, Ldem, Surface

RAY_MARGIN_M = 0.02  # a beam up to this far below counts as noise
FILL_ABOVE_M = 0.08  # a beam higher above the gap than this proves no ground
HOLE_DEPTH_M = 0.06  # a beam this far below the expected ground proves a hole
FILL_STEP_M, FILL_STEP_PER_CELL_M = 0.08, 0.036  # largest difference of the hits on both sides of a gap


COUNTS = 1024  # above this number of hits the spread hardly grows
# Standard deviation of the largest of n normal deviates, n = 0 ... 7 (David and Nagaraja, Order Statistics, 2003).
SIGMA_OF_LARGEST = (0.0, 1.0, 0.8256, 0.7480, 0.7012, 0.6690, 0.6449, 0.6260)
SIGMAS = 1.0  # of a bound's own noise; the bound moves outward by them


def _spreads() -> F64:
    """Inward correction of the bounds of n hits, (COUNTS,), in sigmas of one hit; negative values move a bound outward.

    The correction is the expected largest of n normal deviates (from ROBUST_HITS on the second largest, as
    `ldem.insert` uses it) minus SIGMAS of its own standard deviation.

    Expected value: the quantile (k - 3/8) / (n + 1/4) of the k-th smallest (Blom, Statistical Estimates and Transformed
    Beta-Variables, 1958). Variance: its first term, p (1 - p) / ((n + 2) density^2) with p = k / (n + 1) (David and
    Johnson, Biometrika 41, 1954). That term is too coarse for the largest of a few values, so a table is used below
    ROBUST_HITS.
    """
    normal, spread = NormalDist(), np.zeros(COUNTS)
    for n in range(1, COUNTS):
        k = n - 1 if n >= ROBUST_HITS else n
        p = k / (n + 1)
        sigma = math.sqrt(p * (1.0 - p) / (n + 2)) / normal.pdf(normal.inv_cdf(p))
        if n < ROBUST_HITS:
            sigma = SIGMA_OF_LARGEST[n]
        spread[n] = normal.inv_cdf((k - 0.375) / (n + 0.25)) - SIGMAS * sigma
    return np.round(spread, 9)  # drops the last bits of the C library: same on every processor


SPREAD = _spreads()
MOST_SPREAD: F64 = np.sqrt(2.0 * each.log(np.arange(COUNTS) + 1.0))  # noise hardly ever exceeds this


def classify(ldem: Ldem, mapping: config.Mapping_, spread: F64 = SPREAD) -> Surface:
    """Classes and bias-corrected heights of every cell (Eq. 1's z with its uncertainty; `10-navigation` section 3).

    All layers are (rows, columns) on the Ldem's grid: cell_class uint8; z_mean, z_top, z_bot and z_ray float32, metres
    in the map frame. Occluded and outside cells have NaN heights; filled, hole and assumed cells have equal z_mean,
    z_top and z_bot. An Ldem without hits and assumed cells raises no error; its surface has no known cell.

    spread: (counts,) inward correction of the bounds of n hits, in sigmas. MOST_SPREAD is for callers that must not
        mistake noise for ground.

    Bounds of n hits: z_hi and z_lo (or z_ray + 2 cm where that is lower), moved inward by the spread that noise of
    sigma_z alone causes (`_spreads`), never past the mean. Gaps: along each of rows, columns and both diagonals, the
    line between the nearest hits with at most `fill_cells` missing cells between them gives the expected ground. A
    filled cell takes the mean over the lines that fit. A hole proved along one line overrides a fill along another: its
    surface, z_ray, then lies within the bounds of the fill or is the hazard itself. Raises ValueError for layers of
    wrong shape, dtype or layout.
    """
    rules = kernel.Rules(
        mapping.fill_cells, RAY_MARGIN_M, FILL_ABOVE_M, HOLE_DEPTH_M, FILL_STEP_M, FILL_STEP_PER_CELL_M
    )
    return Surface(ldem.grid, *kernel.classify(ldem, rules, spread), z_ray=ldem.z_ray)
