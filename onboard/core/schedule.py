"""TABLE of rate groups: the parts of a tick in their order, with rate, offset and time budget.

`tick` asks `Scheduler.due` for the groups that do not run at 100 Hz. If a group's own tick was left out because the
machine was late, the group runs in the next one; this slip is counted. Offsets spread the work: housekeeping is made in
ticks without wheel commands. The times are measured outside (onboard/drivers/platform/stopwatch.py) and come in by
Inputs.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from protocol.conventions import TICK_NS

US = 1_000


class Group(IntEnum):
    """The rate groups, in the order of the tick; rows of GROUPS."""

    READ = 0
    RECEIVE = 1
    ESTIMATE = 2
    MONITORS = 3
    EXECUTIVE = 4
    WHEELS = 5
    HOUSEKEEPING = 6
    SEND = 7
    WRITE = 8
    RECORD = 9


@dataclass(frozen=True, slots=True)
class RateGroup:
    """One row.

    group: its rate group.
    every_ticks, offset_ticks: the group runs in the ticks k * every_ticks + offset_ticks.
    budget_ns: longest planned run; longer ones are counted.
    runs: its work, in words.
    """

    group: Group
    every_ticks: int
    offset_ticks: int
    budget_ns: int
    runs: str

    @property
    def name(self) -> str:
        """Name in lower case, for people."""
        return self.group.name.lower()

    @property
    def rate_hz(self) -> float:
        """Runs per second."""
        return 1e9 / TICK_NS / self.every_ticks


GROUPS = (
    RateGroup(Group.READ, 1, 0, 500 * US, "what the ports hold, results of jobs that are due"),
    RateGroup(Group.RECEIVE, 1, 0, 1500 * US, "LIDAR frames, CAN frames, orders"),
    RateGroup(Group.ESTIMATE, 1, 0, 1000 * US, "odometry, attitude, pose; the wheels' health"),
    RateGroup(Group.MONITORS, 1, 0, 500 * US, "every row of the fault table"),
    RateGroup(Group.EXECUTIVE, 1, 0, 2000 * US, "orders, answers to faults, mode, mission, following of the path"),
    RateGroup(Group.WHEELS, 2, 0, 500 * US, "steering angles and rates of the wheels; at once where the rover stops"),
    RateGroup(Group.HOUSEKEEPING, 50, 1, 1500 * US, "telemetry items"),
    RateGroup(Group.SEND, 1, 0, 1000 * US, "frames, bytes and payloads that are due, digest of the state"),
    RateGroup(Group.WRITE, 1, 0, 500 * US, "all of them to the ports, new jobs to their thread"),
    RateGroup(Group.RECORD, 1, 0, 1000 * US, "the tick into the record, tiles of the map to the disk"),
)


class Scheduler:
    """Scheduler of the rate groups; counts slips by group."""

    def __init__(self) -> None:
        self._next = [row.offset_ticks or row.every_ticks for row in GROUPS]  # ticks count from 1
        self.slips = [0] * len(GROUPS)

    def due(self, group: Group, tick: int) -> bool:
        """Return whether the group runs in this tick. Call it once in every tick that runs; ticks only grow."""
        row = GROUPS[group]
        passed = (tick - row.offset_ticks) // row.every_ticks * row.every_ticks + row.offset_ticks
        if passed < self._next[group]:
            return False
        self.slips[group] += passed < tick
        self._next[group] = passed + row.every_ticks
        return True
