"""Garbage collection in the time left after a tick, so that no tick waits for it.

Objects made at start-up and loading are frozen, so a collection visits only those of the run. It starts only if the
time left is twice the longest collection of its kind so far.
"""

from __future__ import annotations

import gc
from collections.abc import Callable
from time import perf_counter_ns

FIRST_NS = (200_000, 500_000, 4_000_000)  # assumed longest collection of each generation until one has run
AFTER = (700, 10, 10)  # thresholds: objects, and collections of the generation before, as in Python


class SlackCollector:
    """Replacement of the automatic collector, which it stops; `close` restarts it. counts: by generation."""

    def __init__(self, clock_ns: Callable[[], int] = perf_counter_ns) -> None:
        self._clock_ns = clock_ns
        self._longest_ns = list(FIRST_NS)
        self.counts = [0, 0, 0]
        gc.disable()

    def spend(self, left_ns: int) -> None:
        """Collect what is due if there is time for it."""
        due = [count > after for count, after in zip(gc.get_count(), AFTER)]
        for generation in (2, 1, 0):
            if due[generation] and left_ns > 2 * self._longest_ns[generation]:
                began_ns = self._clock_ns()
                gc.collect(generation)
                self._longest_ns[generation] = max(self._longest_ns[generation], self._clock_ns() - began_ns)
                self.counts[generation] += 1
                return

    def close(self) -> None:
        """Restart the automatic collector."""
        gc.enable()
