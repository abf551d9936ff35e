"""Measures what each rate group of a tick takes, and how late the tick began. Wall clock only."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter_ns

from onboard.core.schedule import GROUPS, Group
from onboard.records import Timing


class Stopwatch:
    """`begin` a tick, `mark` each group as it begins, `end` the tick; then the figures are those of that tick.

    group_ns: by Group, of the last whole tick; () before the first. tick_ns: all of it together.
    """

    def __init__(self, clock_ns: Callable[[], int] = perf_counter_ns) -> None:
        self._clock_ns = clock_ns
        self._running = [0] * len(GROUPS)
        self._since_ns, self._group = 0, Group.READ
        self.group_ns: tuple[int, ...] = ()

    @property
    def tick_ns(self) -> int:
        """The whole of the last tick."""
        return sum(self.group_ns)

    def begin(self) -> None:
        """A tick begins, with Group.READ."""
        self._running = [0] * len(GROUPS)
        self._since_ns, self._group = self._clock_ns(), Group.READ

    def mark(self, group: Group) -> None:
        """From now on this group works."""
        now_ns = self._clock_ns()
        self._running[self._group] += now_ns - self._since_ns
        self._since_ns, self._group = now_ns, group

    def end(self) -> None:
        """The tick is done."""
        self.mark(self._group)
        self.group_ns = tuple(self._running)

    def timing(self, late_ns: int, job_ns: tuple[int, ...]) -> Timing:
        """For the next tick's inputs."""
        return Timing(late_ns, self.group_ns, job_ns)


class Unmeasured(Stopwatch):
    """In lock-step: what the machine takes is no part of the run."""

    def begin(self) -> None:
        """Nothing."""

    def mark(self, group: Group) -> None:
        """Nothing."""

    def end(self) -> None:
        """Nothing."""

    def timing(self, late_ns: int, job_ns: tuple[int, ...]) -> Timing:
        """As if no time had passed."""
        return Timing()
