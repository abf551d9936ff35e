"""Figures of the drive guard: missions on pitted and smooth ground with and without it, objects in its path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from rich.table import Table

from onboard.config import load
from tests.missions.campaign import REGISTERED
from tests.missions.guard.guarded import Guarded, GuardedFlight
from tests.missions.world.fields import FIELDS
from tests.missions.world.scan_errors import ScanErrors
from tests.missions.world.scanner import scanner


@dataclass(frozen=True)
class GuardRun:
    """Fields of one kind under one setting."""

    name: str
    fields: str
    seeds: tuple[int, ...]
    settings: dict[str, object] = field(default_factory=dict)
    errors: ScanErrors | None = None

    def only(self, wanted: set[int] | None) -> GuardRun:
        """Return the run with these of its seeds; None: with all."""
        return self if wanted is None else replace(self, seeds=tuple(seed for seed in self.seeds if seed in wanted))


@dataclass(frozen=True)
class GuardRow:
    """Result of one mission. false_stops: guard stops where the true ground has neither step nor hole."""

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
TRUST = GuardRun("pits, trust range 2.0 m alone", "pits", tuple(range(1, 25)), {**PITTED, "mapping.trust_m": 2.0})
GUARD = GuardRun("pits, guard and trust range 1.5 m", "pits", tuple(range(1, 25)), GUARDED)
SMOOTH = GuardRun("smooth fields, guard and trust range 1.5 m", "main", tuple(range(1, 17)), GUARDED)
WRONG_RANGES = ScanErrors(outlier_ratio=0.001, mixed_ratio=0.1)
WRONG = GuardRun("the same, 0.1 % outliers, 10 % of edge beams mixed", "pits", GUARD.seeds, GUARDED, WRONG_RANGES)
RUNS = (TRUST, GUARD, WRONG, SMOOTH)
LEAST_ARRIVALS = 0.9  # with wrong ranges, of those without
MOST_STOPS_PER_10_M = 2.0  # of the guard, on smooth fields


def fly(run: GuardRun, seed: int) -> GuardRow:
    """Fly one mission of a run, with drift during the drives and a registration error at each stop."""
    config = load(None, run.settings)
    flight = Guarded(FIELDS[run.fields](seed), replace(scanner(config), errors=run.errors), REGISTERED, seed).fly()
    assert isinstance(flight, GuardedFlight)
    return GuardRow(
        run.name,
        seed,
        flight.kind,
        len(flight.stops),
        flight.scans,
        flight.way_m,
        flight.hard,
        flight.in_hole,
        flight.unseen,
        len(flight.guard_stops),
        sum(not stop.real for stop in flight.guard_stops),
    )


def shortfalls(rows: Sequence[GuardRow]) -> list[str]:
    """Return each promise of the guard that these missions break, in words."""
    guarded, trusted = _of(GUARD, rows), _of(TRUST, rows)
    both = {row.seed for row in guarded} & {row.seed for row in trusted}
    scans = [sum(row.scans for row in part if row.seed in both) for part in (guarded, trusted)]
    wrong = _of(WRONG, rows)
    same = [row for row in guarded if row.seed in {other.seed for other in wrong}]
    arrived, of = (sum(row.outcome == "arrived" for row in part) for part in (wrong, same))
    said = [
        (any(row.hard for row in wrong), "a hard contact with wrong ranges in the sweeps"),
        (bool(wrong and same) and arrived < LEAST_ARRIVALS * of, f"{arrived} arrived with wrong ranges, {of} without"),
        (any(row.in_hole for row in guarded), "a wheel entered a hole"),
        (any(row.unseen for row in guarded), "a wheel rolled over ground that nobody had seen"),
        (any(row.outcome == "endless" for row in rows), "a mission was endless"),
        (scans[0] > scans[1], f"{scans[0]} scans with the guard, {scans[1]} with the trust range alone"),
        (_stops_per_10_m(_of(SMOOTH, rows)) > MOST_STOPS_PER_10_M, "too many guard stops on smooth fields"),
    ]
    return [text for broken, text in said if broken]


def _of(run: GuardRun, rows: Sequence[GuardRow]) -> list[GuardRow]:
    return [row for row in rows if row.run == run.name]


def _stops_per_10_m(rows: Sequence[GuardRow]) -> float:
    return 10 * sum(row.guard_stops for row in rows) / max(sum(row.way_m for row in rows), 1e-9)


def table(rows: Sequence[GuardRow]) -> Table:
    """Return sums over the rows of each run."""
    made = Table(
        "fields and rule",
        "missions",
        "with hard contact",
        "with a wheel in a hole",
        "wheel cells never seen",
        "arrived / reported / endless",
        "scans",
        "guard stops (false)",
        "guard stops per 10 m",
    )
    for run in RUNS:
        mine = _of(run, rows)
        outcomes, stops = [row.outcome for row in mine], sum(row.guard_stops for row in mine)
        made.add_row(
            run.name,
            str(len(mine)),
            str(sum(row.hard > 0 for row in mine)),
            str(sum(row.in_hole > 0 for row in mine)),
            str(sum(row.unseen for row in mine)),
            " / ".join(str(outcomes.count(kind)) for kind in ("arrived", "unreachable", "endless")),
            str(sum(row.scans for row in mine)),
            f"{stops} ({sum(row.false_stops for row in mine)})",
            f"{_stops_per_10_m(mine):.2f}",
        )
    return made
