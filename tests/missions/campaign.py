"""Campaign of many missions: their runs, one row for each mission, and the summary table."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from hil.campaign.truth import TrueWay
from onboard.config import Config, load
from tests.missions.mission import Errors, Flight, Kinematic
from tests.missions.world.drift import NO_DRIFT, Drift
from tests.missions.world.fields import FIELDS, from_orbit
from tests.missions.world.scanner import Scanner, scanner
from tests.missions.world.truth import truth
from tests.missions.world.world import World

POSE_ERROR = Errors(0.05, math.radians(1.0))
REGISTERED = Errors(0.02, math.radians(0.3))  # the error after a registration
UNGUARDED_STOPS = 25


@dataclass(frozen=True)
class Run:
    """One set of fields under one rule.

    name: as in the table.
    settings: changes to the default configuration.
    orbit_cell_m: cell of the orbiter's map that the rover has; 0: it has none.
    drift: of the estimate during drives.
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
    """Result of one mission. ratio: driven way over the true optimum; nan if there is none."""

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
        """Return the row for a file; non-finite numbers are null."""
        return {k: v if not isinstance(v, float) or math.isfinite(v) else None for k, v in asdict(self).items()}

    @classmethod
    def of_json(cls, row: dict[str, Any]) -> Row:
        """Build from a file; null becomes nan. Raises TypeError if keys are missing or unknown."""
        return cls(**{k: math.nan if v is None else v for k, v in row.items()})


@lru_cache(maxsize=4)
def _scanner(config: Config) -> Scanner:
    return scanner(config)


def config_of(run: Run) -> Config:
    """Return the configuration, with whole legs: nothing slips here, so registration needs no short legs."""
    return load(None, {"mission.leg_m": 100.0, **run.settings})


def mission(run: Run, seed: int) -> tuple[World, TrueWay, Flight]:
    """Fly one mission of a run; returns its field, the truth planner's result, and the flight."""
    config = config_of(run)
    world = FIELDS[run.fields](seed)
    gdem = from_orbit(world, run.orbit_cell_m) if run.orbit_cell_m else None
    flight = Kinematic(world, _scanner(config), run.errors, seed, gdem, run.drift).fly()
    return world, truth(world, config), flight


def fly(run: Run, seed: int) -> Row:
    """Fly one mission of a run and return its row."""
    world, perfect, flight = mission(run, seed)
    arrived = flight.kind == "arrived"
    ratio = flight.way_m / perfect.way_m if arrived and perfect.way_m < math.inf else math.nan
    rules = " ".join(stop.result.decision.rule for stop in flight.stops)
    return Row(
        run.name,
        seed,
        world.kind,
        perfect.reachable,
        perfect.way_m,
        flight.kind,
        flight.reason,
        len(flight.stops),
        flight.scans,
        flight.way_m,
        ratio,
        flight.miss_m,
        flight.hard,
        flight.soft,
        flight.unseen,
        len(flight.on_rocks),
        rules,
    )


@dataclass(frozen=True)
class Summary:
    """Line of the table. Stops and ratios are of the reachable goals that were reached: (median, p90, most)."""

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
    """Sum up a run. beyond: goals reached although the truth planner calls them unreachable."""
    good = [row for row in rows if row.reachable and row.outcome == "arrived"]
    return Summary(
        name,
        len(rows),
        sum(row.reachable for row in rows),
        len(good),
        sum(not row.reachable and row.outcome == "arrived" for row in rows),
        sum(row.outcome == "unreachable" for row in rows),
        sum(row.outcome == "endless" for row in rows),
        _spread([row.stops for row in good]),
        _spread([row.ratio for row in good]),
        sum(row.hard > 0 for row in rows),
        sum(row.soft > 0 for row in rows),
        sum(row.unseen > 0 for row in rows),
        sum(row.on_rocks > 0 for row in rows),
    )


def _spread(values: Sequence[float]) -> tuple[float, float, float]:
    if not values:
        return math.nan, math.nan, math.nan
    return float(np.median(values)), float(np.percentile(values, 90)), float(np.max(values))
