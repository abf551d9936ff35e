"""Budget of a port: how many waiting items it may hand over now, and in what time.

    items   per_s in the long run, `burst` at once; an unused budget grows in a pause
    time    WORK_NS, and a tenth of the time since the last grant, LONGEST_NS at most

So a flood costs each tick a small part of it, and items that waited while the program was held up come in one piece:
divided over ticks they would look like a flood. The caller gives the stamps; a port measures time by its own clock.
"""

from __future__ import annotations

WORK_NS, LONGEST_NS = 3_000_000, 60_000_000
_S = 1_000_000_000


class Budget:
    """Budget; call `grant` before a read, `spend` after it. work_ns: time limit of the granted read."""

    def __init__(self, per_s: int, burst: int) -> None:
        self._per_s, self._burst = per_s, burst
        self._left, self._then_ns = float(burst), 0
        self.work_ns = WORK_NS

    def grant(self, now_ns: int) -> int:
        """Return the number of items that may be handed over at this time."""
        passed_ns = max(0, now_ns - self._then_ns)
        self._then_ns = now_ns
        self._left = min(float(self._burst), self._left + passed_ns * self._per_s / _S)
        self.work_ns = min(WORK_NS + passed_ns // 10, LONGEST_NS)
        return int(self._left)

    def spend(self, items: int) -> None:
        """Subtract the items handed over."""
        self._left -= items
