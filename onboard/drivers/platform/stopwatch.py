"""Stopwatch for the rate groups of a tick and the lateness of its start. Wall clock only."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter_ns

from onboard.core.schedule import GROUPS, Group
from onboard.records import Timing


class Stopwatch:
    """Stopwatch; call `begin` at a tick, `mark` as each group begins, `end`; the figures are then of that tick.

    group_ns: by Group, of the last whole tick; () before the first.
    tick_ns: total of the tick.
    """

    def __init__(self, clock_ns: Callable[[], int] = perf_counter_ns) -> None:
        self._clock_ns = clock_ns
        self._running = [0] * len(GROUPS)
        self._since_ns, self._group = 0, Group.READ
        self.group_ns: tuple[int, ...] = ()

    @property
    def tick_ns(self) -> int:
        """Total time of the last tick."""
        return sum(self.group_ns)

    def begin(self) -> None:
        """Start a tick, with Group.READ."""
        self._running = [0] * len(GROUPS)
        self._since_ns, self._group = self._clock_ns(), Group.READ

    def mark(self, group: Group) -> None:
        """Start the time of this group."""
        now_ns = self._clock_ns()
        self._running[self._group] += now_ns - self._since_ns
        self._since_ns, self._group = now_ns, group

    def end(self) -> None:
        """End the tick."""
        self.mark(self._group)
        self.group_ns = tuple(self._running)

    def timing(self, late_ns: int, job_ns: tuple[int, ...]) -> Timing:
        """Return the measured times for the next tick's inputs."""
        return Timing(late_ns, self.group_ns, job_ns)


class NullStopwatch(Stopwatch):
    """Stopwatch of lock-step, which measures nothing: the machine's time is not part of the run."""

    def begin(self) -> None:
        """Do nothing."""

    def mark(self, group: Group) -> None:
        """Do nothing."""

    def end(self) -> None:
        """Do nothing."""

    def timing(self, late_ns: int, job_ns: tuple[int, ...]) -> Timing:
        """Return zero times."""
        return Timing()
