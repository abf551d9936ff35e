"""Trenches and steps placed across the path after the scan: the drive guard stops for each, and rarely without one.

Seeds 1 to 20 place a trench (0.30 m wide, 0.12 m deep), 21 to 40 a step (0.10 m), 2.5 to 7 m of path from the stop, on
gently rolling ground, and end when the rover has backed off. Seeds 41 to 50 are whole missions on the demo's fields.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hil.campaign.mission import LIMIT_S, wheels
from hil.faults import ground_faults
from hil.faults.ground_faults import KINDS
from hil.plant.plant import PlantAbortError
from hil.records import PlantState
from hil.run.in_process import CAMPAIGN_STEP_NS, InMemory
from hil.scenarios.model import Scenario
from hil.terrain.field import Field, height_at
from hil.terrain.obstacle import Obstacle
from hil.terrain.recipe import Course, Recipe, compose
from onboard.core.rover import Rover
from onboard.records import F64, Inputs, Outputs
from protocol.tables.modes import Phase

TRENCHES, STEPS, NOMINAL = range(1, 21), range(21, 41), range(41, 51)
SEEDS = (*TRENCHES, *STEPS, *NOMINAL)
SHORT = (1, 21, 41)
SET = {"drive_guard.on": True}
GOAL_M = (8.0, 0.0)
SLOPE_DEG = 2.0
LEG_M = 8.0  # one leg to the goal, so that there are 7 m of path
MOST_PER_10_M, MOST_FALSE_PER_10_M = 2.0, 0.2
TRUE_STEP_M, ONE_CELL_M = 0.08, 0.15  # a true step: within a cell and its neighbours


@dataclass(frozen=True, slots=True)
class Row:
    """One flight.

    at_m: path length to the obstacle's edge.
    room_m: distance from the foremost wheel to the edge after the rover stopped.
    in_it: True if a wheel's rim came over the obstacle.
    false_stops: stops without a true step over 0.08 m.
    """

    seed: int
    kind: str
    outcome: str
    at_m: float
    room_m: float
    in_it: bool
    stops: int
    false_stops: int
    way_m: float
    scans: int
    why: tuple[str, ...]
    mission_s: float


def fly(seed: int) -> Row:
    """Fly the flight of a seed."""
    if seed in NOMINAL:
        return _nominal(seed)
    return Crossing(seed, "trench" if seed in TRENCHES else "step").fly()


class Crossing:
    """Flight with an obstacle placed across its path, observed tick by tick."""

    def __init__(self, seed: int, kind: str) -> None:
        self.seed, self.kind = seed, kind
        scenario = Scenario(name="guard", terrain="flat", seed=seed, set={**SET, "mission.leg_m": LEG_M})
        self.bench = InMemory(scenario, ground=rolling(seed), step_ns=CAMPAIGN_STEP_NS)
        self.obstacle: Obstacle | None = None
        self.at_m, self.room_m, self.in_it, self.stopped = 0.0, math.inf, False, False

    def fly(self) -> Row:
        """Fly until the scan after the guard's stop, the first wheel on the obstacle, or the mission's end."""
        outcome = "passed"
        try:
            while not (self.bench.ended or self.in_it or self.stopped):
                self.bench.step(self._look)
        except PlantAbortError as abort:
            outcome = str(abort)
        finally:
            self.bench.free()
        hazards = tuple(event.text for event in self.bench.events if event.name == "HAZARD")
        progress = self.bench.progress
        return Row(
            self.seed,
            self.kind,
            "stopped" if self.stopped else outcome,
            round(self.at_m, 2),
            round(self.room_m, 3),
            self.in_it,
            len(hazards),
            0,
            round(progress.way_m, 2),
            progress.sweeps,
            hazards,
            self.bench.tick / 100,
        )

    def _look(self, tick: int, inputs: Inputs, outputs: Outputs, rover: Rover, state: PlantState) -> None:
        mission = rover.executive.mission
        if mission is None or mission.decision is None:
            return
        if self.obstacle is None:
            if mission.phase is Phase.DRIVING:
                self._dig(mission.decision.path.stations[:, :2])
            return
        radius_m = rover.config.rover.wheel_radius_m
        x_m, y_m = wheels(state, rover.config.rover)
        self.in_it |= bool(self.obstacle.holds(x_m, y_m, radius_m).any())
        self.room_m = min(self.room_m, -float(self.obstacle.along_m(x_m, y_m).max()) - radius_m)
        backing = mission.phase is Phase.BACKING_OFF
        self.stopped = backing and not mission.hazards  # it stands, and the hazards are in the map

    def _dig(self, way_m: F64) -> None:
        self.obstacle = ground_faults.across(KINDS[self.kind], way_m, self.seed)
        if self.obstacle is not None:
            ground_faults.put(self.bench, self.obstacle)
            self.at_m = math.dist(way_m[0], (self.obstacle.x_m, self.obstacle.y_m))


def rolling(seed: int) -> Field:
    """Return gently rolling ground without rocks, the goal 8 m ahead."""
    field = compose(Recipe(0.8, median_slope_deg=SLOPE_DEG), Course(), np.random.default_rng([seed, 22]), seed)
    return replace(field, goal_m=GOAL_M)


def _nominal(seed: int) -> Row:
    """Fly a whole mission without an obstacle; each stop of the guard is compared with the true ground."""
    field_seed = seed - NOMINAL[0] + 1
    scenario = Scenario(name="guard", terrain="fbm", seed=field_seed, limit_s=LIMIT_S, set=SET)
    bench = InMemory(scenario, step_ns=CAMPAIGN_STEP_NS)
    whys: list[tuple[str, bool]] = []

    def look(tick: int, inputs: Inputs, outputs: Outputs, rover: Rover, state: PlantState) -> None:
        mission = rover.executive.mission
        for event in (event for event in outputs.events if event.name == "HAZARD"):
            assert mission is not None
            whys.append((event.text, any(true_step(bench.field, cell.x_m, cell.y_m) for cell in mission.hazards)))

    flight = bench.run(look)
    told = flight.requests[0].report if flight.requests else None
    return Row(
        seed,
        "nominal",
        "arrived" if flight.arrived else flight.error or (told.text if told else "no outcome"),
        0.0,
        math.inf,
        False,
        len(whys),
        sum(not true for _, true in whys),
        round(flight.way_m, 2),
        flight.sweeps,
        tuple(text for text, _ in whys),
        flight.bench_s,
    )


def true_step(field: Field, x_m: float, y_m: float) -> bool:
    """Return whether the true ground, without its slope, has a step over 0.08 m within the cell and its neighbours."""
    side = np.arange(-ONE_CELL_M, ONE_CELL_M + 1e-9, field.grid.cell_m)
    dx, dy = (part.ravel() for part in np.meshgrid(side, side))
    z = height_at(field, x_m + dx, y_m + dy)
    basis = np.stack([np.ones_like(dx), dx, dy], axis=1)
    return bool(np.ptp(z - basis @ np.linalg.lstsq(basis, z, rcond=None)[0]) > TRUE_STEP_M)


def judge(rows: Sequence[Row]) -> list[str]:
    """Check that the guard stopped for each obstacle without a wheel on it, and rarely on the demo's fields."""
    short = [
        f"seed {row.seed}: the {row.kind} at {row.at_m} m: {'a wheel on it' if row.in_it else row.outcome}"
        for row in rows
        if row.kind != "nominal" and (row.in_it or row.outcome != "stopped")
    ]
    nominal = [row for row in rows if row.kind == "nominal"]
    way_m = max(sum(row.way_m for row in nominal), 1e-9)
    for stops, most in (
        (sum(row.stops for row in nominal), MOST_PER_10_M),
        (sum(row.false_stops for row in nominal), MOST_FALSE_PER_10_M),
    ):
        if 10.0 * stops / way_m > most:
            short.append(f"{stops} stops in {way_m:.0f} m of nominal way, over {most} per 10 m")
    return short
