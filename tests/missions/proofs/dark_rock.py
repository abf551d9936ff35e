"""Dark rock test: a rock that returns no light lies across the straight path of a whole kinematic mission.

Gently rough ground, goal 9 m ahead, a rock 0.2 m high and wide on the straight line 2 to 7 m from the start. No beam
that meets it returns. The beams next to it must not make a pose free that rolls over its top.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hil.terrain.recipe import Course, Recipe, compose
from hil.terrain.rocks import Rock
from onboard.config import Config
from onboard.perception.map.stop_map import StopMap
from onboard.planning.local.poses import pose_freedom
from onboard.records import Pose
from tests.missions.campaign import REGISTERED
from tests.missions.mission import Kinematic
from tests.missions.proofs.map_proof import surface_around
from tests.missions.proofs.rocks_proof import MEDIAN_SLOPE_DEG, SALT, free_of, rolling_over, standing, top_of
from tests.missions.world.drift import FLOWN_DRIFT
from tests.missions.world.scan_errors import DEFAULT, ScanErrors
from tests.missions.world.scanner import scanner
from tests.missions.world.world import Triangles, World, of_field

SEEDS = tuple(range(1, 11))
SIDE_M, AWAY_M, GOAL_M = 0.2, (2.0, 7.0), 9.0
RIM_M = 0.01  # the dark area extends this far around the rock


@dataclass(frozen=True)
class DarkRun:
    """Places of a dark rock, one a seed."""

    seeds: tuple[int, ...] = SEEDS
    errors: ScanErrors | None = DEFAULT


@dataclass(frozen=True)
class DarkRow:
    """One mission.

    free: largest number of free poses over the rock's top after any scan.
    touched: wheels that came onto the rock.
    hard: poses in hard contact.
    at_m: distance from the start to the rock.
    """

    seed: int
    at_m: float
    free: int
    touched: int
    hard: int
    outcome: str
    reason: str
    scans: int
    way_m: float


class Watched(Kinematic):
    """A mission that checks after each scan for free poses over the rock."""

    rock: Rock
    free = 0

    def _scan(self) -> None:
        super()._scan()
        assert self.flight.memory
        self.free = max(self.free, self.over(self.flight.memory))

    def over(self, memory: StopMap) -> int:
        """Return the free poses that roll over the rock's top, by the map so far."""
        config = self.config
        surface = surface_around(memory, Pose(self.rock.x_m, self.rock.y_m), 4.0, config)
        freedom = pose_freedom(surface, config.rover, config.planning)
        return free_of(freedom, rolling_over(top_of(self.rock), surface.grid, config.rover))


def fly(run: DarkRun, seed: int) -> DarkRow:
    """Fly the mission of a seed."""
    world = ground(seed)
    made = replace(scanner(Config()), errors=run.errors)
    mission = Watched(world, made, REGISTERED, seed, drift=FLOWN_DRIFT)
    mission.rock = world.rocks[0]
    flight = mission.fly()
    return DarkRow(
        seed,
        round(math.hypot(mission.rock.x_m, mission.rock.y_m), 2),
        mission.free,
        len(flight.on_rocks),
        flight.hard,
        flight.kind,
        flight.reason,
        flight.scans,
        round(flight.way_m, 2),
    )


def ground(seed: int) -> World:
    """Return the field of a seed with the dark rock as its only one."""
    rng = np.random.default_rng([seed, SALT, 2])
    field = compose(Recipe(0.8, median_slope_deg=MEDIAN_SLOPE_DEG), Course(away_m=GOAL_M), rng, seed)
    away_m = rng.uniform(*AWAY_M)
    rock = standing(field, field.start.x_m + away_m, field.start.y_m + rng.uniform(-0.1, 0.1), SIDE_M, SIDE_M, rng)
    field = replace(field, rocks=(rock,))
    dark = np.array([(rock.x_m, rock.y_m, SIDE_M / 2 + RIM_M)])
    return replace(of_field(field, "dark rock"), caster=Triangles(field), dark=dark)


def shortfalls(rows: Sequence[DarkRow]) -> list[str]:
    """Return each mission with a free pose over the rock, or with any contact."""
    return [
        f"dark rock, seed {row.seed}: {row.free} poses over it were free, {row.touched} wheels on it, {row.hard} hard "
        "contacts"
        for row in rows
        if row.free or row.touched or row.hard
    ]


def cells(rows: Sequence[DarkRow]) -> tuple[str, ...]:
    """Return a line of the rocks table: name, free, touched, arrived."""
    never = sum(row.free == 0 and row.touched == 0 and row.hard == 0 for row in rows)
    arrived = sum(row.outcome == "arrived" for row in rows)
    touched = sum(row.touched + row.hard > 0 for row in rows)
    return (
        f"{SIDE_M:g} m high, dark, in the way of a mission",
        f"never free nor touched: {never} of {len(rows)}",
        f"touched: {touched}",
        f"arrived: {arrived}",
        "",
    )
