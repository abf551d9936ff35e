"""Monitor of clocks that jump: the scanner's, the tilt node's and UTC.

The code that reads a clock estimates it again after a jump. The fault is reported here and lasts for one second, so
that a sweep across a jump is not used.
"""

from __future__ import annotations

HOLD_NS = 1_000_000_000
UTC_JUMP_NS = 500_000_000


class Jumps:
    """Detector of growth: True for one second after a count of jumps has grown."""

    def __init__(self) -> None:
        self.count = 0
        self._grew_ns = -HOLD_NS

    def update(self, count: int, now_ns: int) -> bool:
        """Process one tick with the count so far; return whether it grew within the last second."""
        if count > self.count:
            self._grew_ns = now_ns
        self.count = count
        return now_ns - self._grew_ns < HOLD_NS and self._grew_ns >= 0


class UtcWatch:
    """Counter of UTC jumps against onboard time. UTC of 0 is not known; an unchanged UTC has not been read again."""

    def __init__(self) -> None:
        self.jumps = 0
        self.last_ns = 0  # size of the newest jump, forward positive
        self._utc_ns = 0
        self._offset_ns: int | None = None

    def update(self, utc_ns: int, now_ns: int) -> None:
        """Process one tick."""
        if utc_ns == 0 or utc_ns == self._utc_ns:
            return
        offset_ns, before_ns = utc_ns - now_ns, self._offset_ns
        if before_ns is not None and abs(offset_ns - before_ns) > UTC_JUMP_NS:
            self.jumps += 1
            self.last_ns = offset_ns - before_ns
        self._utc_ns, self._offset_ns = utc_ns, offset_ns
