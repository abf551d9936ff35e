"""Many missions: what is flown, one row for each, and the table that sums them up."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from onboard.config import Config, load
from tests.missions.drift import NO_DRIFT, Drift
from tests.missions.fields import FIELDS, from_orbit
from tests.missions.mission import Errors, Flight, Kinematic
from tests.missions.scanner import Scanner, scanner
from tests.missions.truth import Truth, truth
from tests.missions.world import World

POSE_ERROR = Errors(0.05, math.radians(1.0))
REGISTERED = Errors(0.02, math.radians(0.3))  # what a registration leaves
UNGUARDED_STOPS = 25


@dataclass(frozen=True)
class Run:
    """One set of fields under one rule. name: as in the table. settings: over the defaults of the configuration.

    orbit_cell_m: cell of the orbiter's map that the rover is given, 0: it has none. drift: of the estimate on the way.
    """

    name: str
    fields: str
    seeds: tuple[int, ...]
    settings: dict[str, object] = field(default_factory=dict)
    errors: Errors = Errors()
    orbit_cell_m: float = 0.0
    drift: Drift = NO_DRIFT


@dataclass(frozen=True)
class Row:
    """What came of one mission. ratio: way over the truth optimum, nan where there is none."""

    run: str
    seed: int
    kind: str
    reachable: bool
    optimum_m: float
    outcome: str
    reason: str
    stops: int
    scans: int
    way_m: float
    ratio: float
    miss_m: float
    hard: int
    soft: int
    unseen: int
    on_rocks: int
    rules: str

    def as_json(self) -> dict[str, object]:
        """For a file; what is not finite is null."""
        return {k: v if not isinstance(v, float) or math.isfinite(v) else None for k, v in asdict(self).items()}

    @classmethod
    def of_json(cls, row: dict[str, Any]) -> Row:
        """From a file; null is nan. Raises TypeError when keys are missing or foreign."""
        return cls(**{k: math.nan if v is None else v for k, v in row.items()})


@lru_cache(maxsize=4)
def _scanner(config: Config) -> Scanner:
    return scanner(config)


def config_of(run: Run) -> Config:
    """A whole leg at once: nothing slips here, so no leg needs to be short for the registration."""
    return load(None, {"mission.leg_m": 100.0, **run.settings})


def mission(run: Run, seed: int) -> tuple[World, Truth, Flight]:
    """One mission of a run: its field, what the truth planner says of it, and what came of it."""
    config = config_of(run)
    world = FIELDS[run.fields](seed)
    gdem = from_orbit(world, run.orbit_cell_m) if run.orbit_cell_m else None
    flight = Kinematic(world, _scanner(config), run.errors, seed, gdem, run.drift).fly()
    return world, truth(world, config), flight


def fly(run: Run, seed: int) -> Row:
    """One mission of a run as a row."""
    world, perfect, flight = mission(run, seed)
    arrived = flight.kind == "arrived"
    ratio = flight.way_m / perfect.way_m if arrived and perfect.way_m < math.inf else math.nan
    rules = " ".join(stop.result.decision.rule for stop in flight.stops)
    return Row(
        run.name, seed, world.kind, perfect.reachable, perfect.way_m, flight.kind, flight.reason, len(flight.stops),
        flight.scans, flight.way_m, ratio, flight.miss_m, flight.hard, flight.soft, flight.unseen,
        len(flight.on_rocks), rules,
    )


@dataclass(frozen=True)
class Summary:
    """A line of the table. Stops and ratios are of the reachable goals that were reached: (median, p90, most)."""

    name: str
    missions: int
    reachable: int
    reached: int
    beyond: int
    reported: int
    endless: int
    stops: tuple[float, float, float]
    ratio: tuple[float, float, float]
    hard: int
    soft: int
    unseen: int
    on_rocks: int


def summary(name: str, rows: Sequence[Row]) -> Summary:
    """beyond: goals that the truth planner calls unreachable and that were reached all the same."""
    good = [row for row in rows if row.reachable and row.outcome == "arrived"]
    return Summary(
        name, len(rows), sum(row.reachable for row in rows), len(good),
        sum(not row.reachable and row.outcome == "arrived" for row in rows),
        sum(row.outcome == "unreachable" for row in rows), sum(row.outcome == "endless" for row in rows),
        _spread([row.stops for row in good]), _spread([row.ratio for row in good]),
        sum(row.hard > 0 for row in rows), sum(row.soft > 0 for row in rows),
        sum(row.unseen > 0 for row in rows), sum(row.on_rocks > 0 for row in rows),
    )  # fmt: skip


def _spread(values: Sequence[float]) -> tuple[float, float, float]:
    if not values:
        return math.nan, math.nan, math.nan
    return float(np.median(values)), float(np.percentile(values, 90)), float(np.max(values))
