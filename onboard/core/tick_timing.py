"""Timing statistics of past ticks, as the shell measured them, counted by rate group, cause and job.

All values come in by Inputs and are 0 in lock-step, so they are a function of the inputs like the rest of the core.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from onboard.core.schedule import GROUPS, Scheduler
from onboard.records import Health, Timing

BINS = 16  # of wake-up lateness: under 1 us, 2, 4, ... us; the last takes all from 16 ms on
WAKE = "wake-up"


class Pace:
    """Counts since the start, and the worst times since the last `rest`.

    worst_ns, over_budget: longest run and runs over budget, by Group.
    lateness: number of ticks by bin of lateness at their start.
    slips: (cause, job) -> ticks left out. The cause is the longest part of the tick before: a rate group or the
        wake-up itself. The job is the one that ran at the same time.
    slip_worst_ns: (cause, job) -> longest tick before a slip.
    recent_tick_ns, recent_late_ns: longest tick and lateness since the last `rest`.
    """

    def __init__(self) -> None:
        self.schedule = Scheduler()
        self.worst_ns = [0] * len(GROUPS)
        self.over_budget = [0] * len(GROUPS)
        self.lateness = [0] * BINS
        self.late_worst_ns = 0
        self.tick_worst_ns = 0
        self.slipped_ticks = 0
        self.slips: Counter[tuple[str, str]] = Counter()
        self.slip_worst_ns: dict[tuple[str, str], int] = {}
        self.recent_tick_ns = self.recent_late_ns = 0
        self._late_before_ns = 0

    def update(self, timing: Timing, health: Health, jobs: Sequence[str]) -> None:
        """Add the measures of one tick. jobs: names of those that run."""
        for group, taken_ns in enumerate(timing.group_ns):
            self.worst_ns[group] = max(self.worst_ns[group], taken_ns)
            self.over_budget[group] += taken_ns > GROUPS[group].budget_ns
        if health.slipped_ticks > self.slipped_ticks:
            self._slip(timing, health, " ".join(jobs))
        self._late_before_ns = timing.late_ns
        self.tick_worst_ns = max(self.tick_worst_ns, health.last_tick_ns)
        self.recent_tick_ns = max(self.recent_tick_ns, health.last_tick_ns)
        self.recent_late_ns = max(self.recent_late_ns, timing.late_ns)
        if timing.group_ns:
            self.late_worst_ns = max(self.late_worst_ns, timing.late_ns)
            self.lateness[lateness_bin(timing.late_ns)] += 1

    def rest(self) -> None:
        """Reset the recent worst times."""
        self.recent_tick_ns = self.recent_late_ns = 0

    def _slip(self, timing: Timing, health: Health, job: str) -> None:
        parts_ns = {WAKE: self._late_before_ns} | {
            GROUPS[group].name: taken_ns for group, taken_ns in enumerate(timing.group_ns)
        }
        key = max(parts_ns, key=parts_ns.__getitem__), job
        self.slips[key] += health.slipped_ticks - self.slipped_ticks
        self.slipped_ticks = health.slipped_ticks
        whole_ns = self._late_before_ns + health.last_tick_ns
        self.slip_worst_ns[key] = max(self.slip_worst_ns.get(key, 0), whole_ns)

    def digest_items(self) -> tuple[int, ...]:
        """Values of this state that go into the state digest."""
        return (self.slipped_ticks, self.tick_worst_ns, self.late_worst_ns, *self.schedule.slips)


def lateness_bin(late_ns: int) -> int:
    """Bin of a wake-up: bin k contains 2^(k-1) to 2^k us."""
    return min((late_ns // 1000).bit_length(), BINS - 1)


def quantile_us(lateness: Sequence[int], share: float) -> int:
    """Upper edge of the bin below which this share of the wake-ups lies, in us; 0 without any."""
    total, seen = sum(lateness), 0
    for k, count in enumerate(lateness):
        seen += count
        if total and seen >= share * total:
            return 1 << k
    return 0
