"""Wrong returns taken out of a sweep: the filter of the range image, lines x beams.

    beam ->   3.10 3.11 3.09 3.12      each return has eight neighbours: the beams beside it in its line and in the
    line      3.12 3.60 3.11 3.10      lines before and after. 3.60 has none within the tolerance: it is taken out.
     |        3.13 3.12 3.13 3.12
     v

A return is kept where it has a witness: a neighbour whose range is within the tolerance, or two opposite neighbours
with its range within the tolerance of their middle, as on ground met at a flat angle. What has none is a mixed pixel
at an edge, a speck of dust or a wrong measurement, and counts as lost (`onboard.perception.cloud`). The tolerance is
three sigmas of the difference of two ranges, and 5 cm at least. A rock of two beams has its own witness; a rock of
one beam is lost, and its cell keeps what the beams beside it say.

Like the speckle and shadow filters of common scanner drivers, but on the whole sweep: a line of rough ground met at a
flat angle jumps from beam to beam where the lines before and after do not.
"""

from __future__ import annotations

import math

import numpy as np

from onboard.native import range_filter
from onboard.records import F32, Bool

SIGMAS = 3.0
OF_A_DIFFERENCE = math.sqrt(2.0)
LEAST_M = 0.05  # ground is rough, however good the scanner


def witnessed(ranges_m: F32, seen: Bool, range_noise_m: float) -> Bool:
    """Which returns have a witness, bool (lines, beams).

    ranges_m: float32 (lines, beams), m; seen: bool, the same shape, where there is a return; range_noise_m: 1 sigma of
    a range. Raises ValueError for wrong shapes or dtypes.
    """
    tolerance_m = max(LEAST_M, SIGMAS * OF_A_DIFFERENCE * range_noise_m)
    return range_filter.keep_witnessed(np.ascontiguousarray(ranges_m), np.ascontiguousarray(seen), tolerance_m)
