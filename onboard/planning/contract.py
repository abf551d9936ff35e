"""What every local planner is asked and answers; `planners.PLANNERS` lists them, one contract test runs over the table.

The contract: the path starts at the problem's start, ends on one of its goal poses' cells, every station stands on a
free pose, the same problem gives the same path; a goal that cannot be reached is `path = None` with the reason for
people.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from onboard.config import Planning
from onboard.records import F32, U8, Bool, Grid, Path


@dataclass(frozen=True, slots=True)
class Problem:
    """Where from, where to, over what. freedom: (8, rows, columns) uint8 of Freedom; goals: bool, the same shape.

    start: x, y, yaw; its pose must be free. end: a point within the goal cell to stop at instead of its centre.
    closeness: soft cost ratio, same shape, or None.
    """

    freedom: U8
    grid: Grid
    start: tuple[float, float, float]
    goals: Bool
    planning: Planning
    closeness: F32 | None = None
    end: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Plan:
    """path: None where the goal cannot be reached. cost_m: the field's value at the start. reason: for people."""

    path: Path | None
    cost_m: float
    reason: str


class Planner(Protocol):
    """A row of PLANNERS."""

    def plan(self, problem: Problem) -> Plan:
        """The path, or why there is none."""
        ...
