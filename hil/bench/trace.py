"""A run tick by tick in a few bytes: where two runs differ first, and on which channel."""

from __future__ import annotations

from array import array
from collections.abc import Sequence

from protocol.conventions import TICK_NS


class Trace:
    """A checksum of all that passed on each channel until each tick; the run's SHA-256 are in its certificate."""

    def __init__(self, channels: Sequence[str]) -> None:
        self.channels = tuple(channels)
        self._sums = array("I")

    def add(self, sums: Sequence[int]) -> None:
        """The checksums of the channels at the end of a tick."""
        self._sums.extend(sums)

    def __len__(self) -> int:
        return len(self._sums) // len(self.channels)

    def at(self, tick: int) -> Sequence[int]:
        """The checksums after a tick, from 1 on."""
        return self._sums[(tick - 1) * len(self.channels) : tick * len(self.channels)]


def first_difference(one: Trace, other: Trace) -> tuple[float, str] | None:
    """Bench time and channel; None where the ticks that both have are alike."""
    ticks = min(len(one), len(other))
    if ticks == 0 or one.at(ticks) == other.at(ticks):
        return None
    low, high = 0, ticks  # alike after `low`, not after `high`: what differed once differs from then on
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if one.at(middle) == other.at(middle) else (low, middle)
    channel = next(name for name, a, b in zip(one.channels, one.at(high), other.at(high)) if a != b)
    return high * TICK_NS / 1e9, channel
