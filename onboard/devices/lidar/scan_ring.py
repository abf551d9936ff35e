"""Ring of scan buffers, reused when nothing references them.

A place is leased while its arrays, or views of them, are referenced anywhere: by a job, a map, the record. Python's
reference counts show that; no release call is needed. If the next place is still leased, the newest scan wins: the
holder keeps the old arrays, the ring makes new ones and counts `overflows`.
"""

from __future__ import annotations

import sys
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from onboard.records import F32, U8

_HELD_HERE = 3  # the place, the argument of getrefcount, the loop's name


class ScanBuffer(NamedTuple):
    """Arrays of one scan, as in `records.Scan`."""

    ranges_m: F32
    status: U8
    intensity: NDArray[np.int32] | None
    further_m: F32 | None


class ScanRing:
    """`size` places for scans of `beams` beams. overflows: number of takes whose place was still leased."""

    def __init__(self, size: int, beams: int, channels: int = 1, echoes: int = 1) -> None:
        self.overflows = 0
        self._shape = beams, channels, echoes
        self._places = [_place(*self._shape) for _ in range(size)]
        self._next = 0

    def take(self) -> ScanBuffer:
        """Return the place for a new scan; its content is old."""
        at, self._next = self._next, (self._next + 1) % len(self._places)
        if _leased(self._places[at]):
            self.overflows += 1
            self._places[at] = _place(*self._shape)
        return self._places[at]


def _leased(place: ScanBuffer) -> bool:
    return any(array is not None and sys.getrefcount(array) > _HELD_HERE for array in place)


def _place(beams: int, channels: int, echoes: int) -> ScanBuffer:
    return ScanBuffer(
        np.empty(beams, np.float32),
        np.empty(beams, np.uint8),
        np.empty(beams, np.int32) if channels > 1 else None,
        np.empty((beams, echoes - 1), np.float32) if echoes > 1 else None,
    )
