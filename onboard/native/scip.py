"""The door to SCIP's data blocks: what protocol.scip.BlockReader does in steps over arrays, in one pass."""

from __future__ import annotations

import numpy as np

from onboard.native.variant import kernels


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
