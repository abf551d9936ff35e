"""Interface of the local planners: problem, plan and contract.

`planners.PLANNERS` lists the planners; one contract test runs over the table.

The contract: the path starts at the problem's start and ends on the cell of one of its goal poses; every station stands
on a free pose; the same problem gives the same path. If the goal cannot be reached, `path` is None and `reason`
explains why, for people.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from onboard.config import Planning
from onboard.records import F32, U8, Bool, Grid, Path


@dataclass(frozen=True, slots=True)
class Problem:
    """Planning problem.

    freedom: (8, rows, columns) uint8 of Freedom.
    grid: grid of the cells.
    start: x, y, yaw; its pose must be free.
    goals: (8, rows, columns) bool, goal poses.
    planning: configuration.
    closeness: (8, rows, columns) float32 soft cost ratio, or None.
    end: point within the goal cell to stop at instead of its centre.
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
    """Result of a local planner.

    path: None if the goal cannot be reached.
    cost_m: the field's value at the start.
    reason: for people.
    """

    path: Path | None
    cost_m: float
    reason: str


class Planner(Protocol):
    """A row of PLANNERS."""

    def plan(self, problem: Problem) -> Plan:
        """Return the path, or the reason why there is none."""
        ...
