"""The doors to SCIP's data blocks, what protocol.scip.BlockReader does in steps over arrays, and to its beams."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from onboard.native.checks import check_array
from onboard.native.variant import kernels
from onboard.scan import F32, U8


class Blocks:
    """A `protocol.scip.BlockReader`: called with a frame, it says whether all checks hold, and fills `values`.

    at: where in the frame the blocks begin; count: values, each of `characters` characters. Raises ValueError where
    one of them cannot be. The lock is kept: a scan takes 3 us.
    """

    def __init__(self, at: int, count: int, characters: int) -> None:
        if at < 0 or count < 1 or not 1 <= characters <= 10:
            given = f"{at}, {count}, {characters}"
            raise ValueError(f"at, count, characters: expected >= 0, >= 1 and 1 to 10, given {given}")
        self.values = np.empty(count, np.int64)
        self._at, self._characters = at, characters

    def __call__(self, frame: memoryview | bytes) -> bool:
        """Whether sizes, sums, LFs and characters are right; then `values` holds the values."""
        return kernels.scip_values_into(np.frombuffer(frame, np.uint8), self._at, self._characters, self.values)


def beams_into(values: NDArray[np.integer[Any]], each: int, status_of: U8, ranges_m: F32, status: U8) -> None:
    """The first value of each beam as metres and status.

    values: `each` a beam, mm or codes, of any shape; of 64 bits, or a copy is made. status_of: (codes,) what a value
    of 0 to codes - 1 means, its last entry all above, its first all below. ranges_m, status: (beams,), filled; NaN
    where the status is not 0. Raises ValueError for arrays of another kind or size. The lock is kept: 3 us.
    """
    beams, flat = len(status), values.astype(np.int64, "C", copy=False).reshape(-1)
    check_array("values", flat, (beams * each,), np.int64)
    check_array("status_of", status_of, (None,), np.uint8)
    check_array("ranges_m", ranges_m, (beams,), np.float32)
    check_array("status", status, (beams,), np.uint8)
    if each < 1 or not len(status_of):
        raise ValueError(f"each, status_of: expected at least one, given {each}, {status_of.shape}")
    kernels.scip_beams_into(flat, each, status_of, ranges_m, status)
