"""Clocks that jump: the scanner's, the tilt node's, UTC. What is timed by them is estimated anew where they are read;
here it is told, and holds for a second, so that a sweep on both sides of a jump is not used.
"""

from __future__ import annotations

HOLD_NS = 1_000_000_000
UTC_JUMP_NS = 500_000_000


class Jumps:
    """Whether a count of jumps has grown within the last second."""

    def __init__(self) -> None:
        self.count = 0
        self._grew_ns = -HOLD_NS

    def update(self, count: int, now_ns: int) -> bool:
        """One tick: the count so far."""
        if count > self.count:
            self._grew_ns = now_ns
        self.count = count
        return now_ns - self._grew_ns < HOLD_NS and self._grew_ns >= 0


class UtcWatch:
    """Jumps of UTC against the onboard time, counted. UTC of 0 is not known; one that stands was not read anew."""

    def __init__(self) -> None:
        self.jumps = 0
        self.last_ns = 0  # of the newest jump, ahead positive
        self._utc_ns = 0
        self._offset_ns: int | None = None

    def update(self, utc_ns: int, now_ns: int) -> None:
        """One tick."""
        if utc_ns == 0 or utc_ns == self._utc_ns:
            return
        offset_ns, before_ns = utc_ns - now_ns, self._offset_ns
        if before_ns is not None and abs(offset_ns - before_ns) > UTC_JUMP_NS:
            self.jumps += 1
            self.last_ns = offset_ns - before_ns
        self._utc_ns, self._offset_ns = utc_ns, offset_ns
