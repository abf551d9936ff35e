"""Interface of the SCIP kernels: data blocks (as protocol.scip.BlockReader with numpy) and beams."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from onboard.kernel_calls.checks import check_array
from onboard.native.variant import kernels
from onboard.records.scan import F32, U8


class Blocks:
    """Native `protocol.scip.BlockReader`: checks a frame, fills `values` and returns True if all checks pass.

    at: offset of the blocks in the frame.
    count: number of values, each of `characters` characters.

    Raises ValueError if one of them is out of range. The interpreter's lock is kept: a scan takes 3 us.
    """

    def __init__(self, at: int, count: int, characters: int) -> None:
        if at < 0 or count < 1 or not 1 <= characters <= 10:
            given = f"{at}, {count}, {characters}"
            raise ValueError(f"at, count, characters: expected >= 0, >= 1 and 1 to 10, given {given}")
        self.values = np.empty(count, np.int64)
        self._at, self._characters = at, characters

    def __call__(self, frame: memoryview | bytes) -> bool:
        """Check sizes, sums, LFs and characters; return True if all are right, with the result in `values`."""
        return kernels.scip_values_into(np.frombuffer(frame, np.uint8), self._at, self._characters, self.values)


def beams_into(values: NDArray[np.integer[Any]], each: int, status_of: U8, ranges_m: F32, status: U8) -> None:
    """Convert the first value of each beam to metres and status.

    values: `each` per beam, mm or codes, of any shape; of 64 bits, otherwise a copy is made.
    status_of: (codes,) status of the values 0 to codes - 1; its last entry applies to all above, its first to all
        below.
    ranges_m, status: (beams,), filled; NaN where the status is not 0.

    Raises ValueError for arrays of another kind or size. The interpreter's lock is kept: 3 us.
    """
    beams, flat = len(status), values.astype(np.int64, "C", copy=False).reshape(-1)
    check_array("values", flat, (beams * each,), np.int64)
    check_array("status_of", status_of, (None,), np.uint8)
    check_array("ranges_m", ranges_m, (beams,), np.float32)
    check_array("status", status, (beams,), np.uint8)
    if each < 1 or not len(status_of):
        raise ValueError(f"each, status_of: expected at least one, given {each}, {status_of.shape}")
    kernels.scip_beams_into(flat, each, status_of, ranges_m, status)
