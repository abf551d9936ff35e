"""Checksums of a run tick by tick: first tick and channel at which two runs differ."""

from __future__ import annotations

from array import array
from collections.abc import Sequence

from protocol.conventions import TICK_NS


class Trace:
    """Checksum of all data that passed on each channel, at each tick; the run's SHA-256 are in its certificate."""

    def __init__(self, channels: Sequence[str]) -> None:
        self.channels = tuple(channels)
        self._sums = array("I")

    def add(self, sums: Sequence[int]) -> None:
        """Add the checksums of the channels at the end of a tick."""
        self._sums.extend(sums)

    def __len__(self) -> int:
        return len(self._sums) // len(self.channels)

    def at(self, tick: int) -> Sequence[int]:
        """Checksums after a tick; ticks count from 1."""
        return self._sums[(tick - 1) * len(self.channels) : tick * len(self.channels)]


def first_difference(one: Trace, other: Trace) -> tuple[float, str] | None:
    """Bench time, s, and channel of the first difference; None if the common ticks are equal."""
    ticks = min(len(one), len(other))
    if ticks == 0 or one.at(ticks) == other.at(ticks):
        return None
    low, high = 0, ticks  # equal after `low`, different after `high`: a difference persists
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if one.at(middle) == other.at(middle) else (low, middle)
    channel = next(name for name, a, b in zip(one.channels, one.at(high), other.at(high)) if a != b)
    return high * TICK_NS / 1e9, channel
