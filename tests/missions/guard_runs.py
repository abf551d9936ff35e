"""The drive guard's figures: missions on pitted and smooth ground with and without it, and objects put in its way."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from rich.table import Table

from onboard.config import load
from tests.missions.fields import FIELDS
from tests.missions.guarded import Guarded, GuardedFlight
from tests.missions.mission import Errors
from tests.missions.scanner import scanner

REGISTERED = Errors(0.02, math.radians(0.3))  # what a registration leaves


@dataclass(frozen=True)
class GuardRun:
    """Fields of one kind under one setting."""

    name: str
    fields: str
    seeds: tuple[int, ...]
    settings: dict[str, object] = field(default_factory=dict)

    def only(self, wanted: set[int] | None) -> GuardRun:
        """The run with these of its seeds; None: with all."""
        return self if wanted is None else replace(self, seeds=tuple(seed for seed in self.seeds if seed in wanted))


@dataclass(frozen=True)
class GuardRow:
    """What came of one mission. false_stops: guard stops where the true ground has neither step nor hole."""

    run: str
    seed: int
    outcome: str
    stops: int
    scans: int
    way_m: float
    hard: int
    in_hole: int
    unseen: int
    guard_stops: int
    false_stops: int


PITTED = {"mission.ground": "pitted"}
GUARDED = {**PITTED, "drive_guard.on": True, "mapping.trust_m": 1.5}
RUNS = (
    GuardRun("pits, trust range 2.0 m alone", "pits", tuple(range(1, 25)), {**PITTED, "mapping.trust_m": 2.0}),
    GuardRun("pits, guard and trust range 1.5 m", "pits", tuple(range(1, 25)), GUARDED),
    GuardRun("smooth fields, guard and trust range 1.5 m", "main", tuple(range(1, 17)), GUARDED),
)


def fly(run: GuardRun, seed: int) -> GuardRow:
    """One mission of a run, with drift inside the drives and what a registration leaves at each stop."""
    config = load(None, run.settings)
    flight = Guarded(FIELDS[run.fields](seed), scanner(config), REGISTERED, seed).fly()
    assert isinstance(flight, GuardedFlight)
    return GuardRow(
        run.name, seed, flight.kind, len(flight.stops), flight.scans, flight.way_m, flight.hard, flight.in_hole,
        flight.unseen, len(flight.guard_stops), sum(not stop.real for stop in flight.guard_stops),
    )  # fmt: skip


def table(rows: Sequence[GuardRow]) -> Table:
    """Sums over the rows of each run."""
    made = Table("fields and rule", "missions", "with hard contact", "with a wheel in a hole", "wheel cells never seen",
                 "arrived / reported / endless", "scans", "guard stops (false)", "guard stops per 10 m")  # fmt: skip
    for run in RUNS:
        mine = [row for row in rows if row.run == run.name]
        outcomes = [row.outcome for row in mine]
        way, stops = sum(row.way_m for row in mine), sum(row.guard_stops for row in mine)
        made.add_row(
            run.name, str(len(mine)), str(sum(row.hard > 0 for row in mine)), str(sum(row.in_hole > 0 for row in mine)),
            str(sum(row.unseen for row in mine)),
            " / ".join(str(outcomes.count(kind)) for kind in ("arrived", "unreachable", "endless")),
            str(sum(row.scans for row in mine)), f"{stops} ({sum(row.false_stops for row in mine)})",
            f"{10 * stops / max(way, 1e-9):.2f}",
        )  # fmt: skip
    return made
