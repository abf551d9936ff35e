"""Reader of the data blocks of many scans of one layout into preallocated memory."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from protocol.scip.blocks import BLOCK


class Reader(Protocol):
    """Callable that checks the blocks of a frame, fills `values` and returns True if all checks pass."""

    values: NDArray[np.int64]

    def __call__(self, frame: memoryview | bytes) -> bool: ...  # noqa: D102


class BlockReader:
    """Block reader with numpy.

    at: offset of the blocks in the frame.
    count: number of values, each of 1 to 3 `characters`.
    """

    def __init__(self, at: int, count: int, characters: int) -> None:
        self.values: NDArray[np.int64] = np.empty(count, np.int64)
        self._at = at
        self._whole, rest = (count * characters - 1) // BLOCK, (count * characters - 1) % BLOCK + 1  # 1 to 64
        self._size = at + self._whole * (BLOCK + 2) + rest + 1
        self._sums = np.empty(self._whole, np.uint8)
        self._sixes = np.empty(count * characters, np.uint8)
        self._wide = np.empty((count, characters), np.float32)
        self._weights = np.array([64**k for k in range(characters - 1, -1, -1)], np.float32)
        self._exact = np.empty(count, np.float32)

    def __call__(self, frame: memoryview | bytes) -> bool:
        """Check sizes, sums, LFs and characters; return True if all are right, with the result in `values`."""
        if len(frame) != self._size:
            return False
        raw = np.frombuffer(frame, np.uint8)
        last, split = self._at + self._whole * (BLOCK + 2), self._whole * BLOCK
        lines = raw[self._at : last].reshape(self._whole, BLOCK + 2)
        np.add.reduce(lines[:, :BLOCK], axis=1, dtype=np.uint8, out=self._sums)
        self._sums &= 0x3F  # 64 * 0x30 adds nothing to the low 6 bits
        self._sums += 0x30
        rest = int(np.add.reduce(raw[last:-1], dtype=np.uint8)) & 0x3F
        if rest + 0x30 != raw[-1] or (self._sums != lines[:, BLOCK]).any() or (lines[:, BLOCK + 1] != 0x0A).any():
            return False
        self._sixes[:split].reshape(self._whole, BLOCK)[:] = lines[:, :BLOCK]
        self._sixes[split:] = raw[last:-1]
        self._sixes -= 0x30
        if self._sixes.max() > 0x3F:
            return False
        self._wide[:] = self._sixes.reshape(self._wide.shape)
        np.dot(self._wide, self._weights, out=self._exact)  # 18 bits are exact in float32
        self.values[:] = self._exact
        return True
