"""Filter of the range image, lines x beams: removes wrong returns from a sweep.

    beam ->   3.10 3.11 3.09 3.12      each return has eight neighbours: the adjacent beams in its line and in the
    line      3.12 3.60 3.11 3.10      lines before and after. 3.60 has none within the tolerance: it is removed.
     |        3.13 3.12 3.13 3.12
     v

A return stays if it has a witness: a neighbour whose range is within the tolerance, or two opposite neighbours whose
mean is within the tolerance of its range, as on ground met at a flat angle. A return without a witness is a mixed pixel
at an edge, a speck of dust or a wrong measurement, and counts as lost (`onboard.perception.scan.cloud`). The tolerance
is three sigmas of the difference of two ranges, at least 5 cm. A rock of two beams has its own witness; a rock of one
beam is lost, and its cell keeps the values of the beams around it.

This is like the speckle and shadow filters of common scanner drivers, but on the whole sweep: a line of rough ground
met at a flat angle jumps from beam to beam where the lines before and after do not.
"""

from __future__ import annotations

import math

import numpy as np

from onboard.kernel_calls import range_filter
from onboard.records import F32, Bool

SIGMAS = 3.0
OF_A_DIFFERENCE = math.sqrt(2.0)
LEAST_M = 0.05  # ground is rough, however good the scanner


def witnessed(ranges_m: F32, seen: Bool, range_noise_m: float) -> Bool:
    """Flags of the returns that have a witness, bool (lines, beams).

    ranges_m: float32 (lines, beams), m.
    seen: bool, the same shape, True where there is a return.
    range_noise_m: 1 sigma of a range.

    Raises ValueError for wrong shapes or dtypes.
    """
    tolerance_m = max(LEAST_M, SIGMAS * OF_A_DIFFERENCE * range_noise_m)
    return range_filter.keep_witnessed(np.ascontiguousarray(ranges_m), np.ascontiguousarray(seen), tolerance_m)
