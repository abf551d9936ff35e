"""Figures of a mission for campaigns: the rover's reports against the truth, and the reason of its end.

`ended` makes the row from an observer of the flight (`Watch` in hil/campaign/mission.py); `true_reason` returns whether
a mission that did not arrive stopped for a true reason.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from hil.campaign.mission import Watch
from hil.run.in_process import InMemory

GOAL_M = 0.3
SAW_TOO_LITTLE = ("saw too little", "LIDAR_DIRTY")  # in a reason or among the faults: the scanner is the cause
NO_WAY = "no way is left"
HEADS = ("missions", "flown", "at the goal", "stopped with the true reason", "else", "contacts",
         "worst m from the goal, of those at it", "worst pose error, m", "at a goal, m", "registrations taken, refused",
         "faults", "way, m", "time, s")  # fmt: skip


@dataclass(frozen=True, slots=True)
class Row:
    """One flight.

    outcome: 'arrived', or the reason that the rover reported.
    to_goal_m: true distance from the (last) goal.
    max_error_m: largest horizontal error of the reported pose at any tick of the mission.
    goals: number of goals reached.
    goal_errors_m: pose error at each goal, after the turn on the spot if there is one.
    registered, refused: accepted and refused registrations.
    """

    seed: int
    field: int
    lost_ratio: float
    outcome: str
    to_goal_m: float
    max_error_m: float
    contacts: tuple[str, ...]
    goals: int
    goal_errors_m: tuple[float, ...]
    scans: int
    registered: int
    refused: int
    way_m: float
    mission_s: float
    faults: tuple[str, ...]

    @property
    def arrived(self) -> bool:
        """True if the rover reported its arrival."""
        return self.outcome == "arrived"


def with_losses(bench: InMemory, ratio: float | None) -> InMemory:
    """Set the share of lost beams of a bench before its first tick; None: that of the scenario."""
    if ratio is not None:
        bench.lidar.dropout_ratio = ratio
    return bench


def ended(
    bench: InMemory,
    watch: Watch,
    seed: int,
    goal_m: tuple[float, float],
    outcome: str,
    errors_m: Sequence[float] = (),
) -> Row:
    """Return the row of a finished flight."""
    events = [event.name for event in bench.events]
    x_m, y_m, _ = bench.state.position_m.tolist()
    return Row(
        seed=seed,
        field=bench.scenario.seed,
        lost_ratio=bench.lidar.dropout_ratio,
        outcome=outcome,
        to_goal_m=round(math.dist((x_m, y_m), goal_m), 3),
        max_error_m=round(watch.max_error_m, 3),
        contacts=tuple(contact_words(contact) for contact in bench.truth.contacts),
        goals=len(errors_m),
        goal_errors_m=tuple(round(error, 3) for error in errors_m),
        scans=bench.progress.sweeps,
        registered=events.count("REGISTERED"),
        refused=events.count("REGISTRATION_REFUSED"),
        way_m=round(bench.progress.way_m, 2),
        mission_s=bench.tick / 100,
        faults=tuple(event.text for event in bench.events if event.name == "FAULT"),
    )


def contact_words(contact: Any) -> str:
    """Return time and kind of a contact: a pair of both, or a record with `begin_s` and `what`."""
    at_s, what = contact if isinstance(contact, tuple) else (contact.begin_s, contact.what)
    return f"{at_s:.1f} s: {what}"


def true_reason(row: Row) -> bool:
    """Return whether a mission that did not arrive reported the true reason.

    Every goal here can be reached on the true ground, so 'no way is left' is never true. "The scanner saw too little"
    is true if beams are lost.
    """
    if row.arrived or NO_WAY in row.outcome or not row.lost_ratio:
        return False
    return any(word in text for word in SAW_TOO_LITTLE for text in (row.outcome, *row.faults))


def broken(row: Row) -> list[str]:
    """Return a flight's broken promises: neither at the goal nor stopped with the true reason; each contact."""
    short = []
    if row.arrived and row.to_goal_m > GOAL_M:
        short.append(f"seed {row.seed}: arrived {row.to_goal_m} m from the goal by truth")
    if not row.arrived and not true_reason(row):
        told = f"and not for the reason told: {row.outcome}"
        short.append(f"seed {row.seed}: ended {row.to_goal_m} m from the goal, {told}")
    if row.contacts:
        short.append(f"seed {row.seed} touched {len(row.contacts)} times, first {row.contacts[0]}")
    return short


def line(name: str, rows: Sequence[Row]) -> tuple[str, ...]:
    """Return a line of the documents' table, in the order of HEADS."""
    at_goal = [row for row in rows if row.arrived and row.to_goal_m <= GOAL_M]
    stopped = sum(true_reason(row) for row in rows)
    errors_m = [error for row in rows for error in row.goal_errors_m]
    return (
        name,
        str(len(rows)),
        str(len(at_goal)),
        str(stopped),
        str(len(rows) - len(at_goal) - stopped),
        str(sum(len(row.contacts) for row in rows)),
        _most(row.to_goal_m for row in at_goal),
        _most(row.max_error_m for row in rows),
        _most(errors_m),
        f"{sum(row.registered for row in rows)}, {sum(row.refused for row in rows)}",
        str(sum(len(row.faults) for row in rows)),
        f"{sum(row.way_m for row in rows):.0f}",
        f"{sum(row.mission_s for row in rows):.0f}",
    )


def _most(values: Iterable[float]) -> str:
    return max((f"{value:.2f}" for value in values), key=float, default="-")
