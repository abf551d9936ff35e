"""Interface of the range image filter: the returns of a sweep that have a witness next to them."""

from __future__ import annotations

import math

import numpy as np

from onboard.kernel_calls.checks import check_array
from onboard.native.variant import kernels
from onboard.records import F32, Bool


def keep_witnessed(ranges_m: F32, seen: Bool, tolerance_m: float) -> Bool:
    """Mask of returns to keep, bool (lines, beams): the rule of `onboard.perception.scan.range_image`.

    ranges_m: float32 (lines, beams), lines in order of time.
    seen: bool, the same shape, True where there is a return.

    Raises ValueError for wrong shapes, dtypes or layout, and for a tolerance that is negative or not finite.
    """
    check_array("ranges_m", ranges_m, (None, None), np.float32)
    check_array("seen", seen, ranges_m.shape, np.bool_)
    if not (math.isfinite(tolerance_m) and tolerance_m >= 0.0):
        raise ValueError(f"tolerance_m: expected a finite number of 0 or more, given {tolerance_m}")
    kept = np.empty(ranges_m.shape, np.bool_)
    kernels.keep_witnessed_into(ranges_m, seen.view(np.uint8), tolerance_m, kept.view(np.uint8))
    return kept
