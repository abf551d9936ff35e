"""A short mission in a process of its own: `python -m tests.hil.flown`.

Prints as JSON what its certificate would hold, and digests of the grounds that a bench can be given.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np

from hil.own_functions import generator
from hil.run.in_process import CAMPAIGN_STEP_NS, Flight, InMemory, Observe
from hil.scenarios.model import Scenario
from hil.terrain.craters import CraterLaw
from hil.terrain.field import Field
from hil.terrain.recipe import Course, Recipe, compose
from hil.terrain.rock_sizes import Golombek
from hil.world.operator import TimedCommand

SCENARIO = Scenario(terrain="fbm", seed=4, link="lan", set={  # a scan in 15 s, a short way
    "scanning.start_rad": 1.05, "scanning.end_rad": -0.1, "scanning.spacing_m": 0.15, "scanning.floor_rad": 0.006,
    "scanning.cap_rad": 0.03, "scanning.range_m": 6.0, "mapping.size_m": 14.0, "mapping.near_m": 3.0,
    "drive_guard.on": True,
})  # fmt: skip


def flown(record: Path | None = None, observe: Observe = lambda *_: None) -> Flight:
    """A scan; then a mission: a scan ahead that registers to it, one behind, a plan, a short drive under the guard."""
    orders = [TimedCommand(0.5, "scan"), TimedCommand(9.5, "goto", {"x_m": 1.5, "y_m": 0.0})]
    return InMemory(SCENARIO, orders, step_ns=CAMPAIGN_STEP_NS, record=record).run(observe)


def told(flight: Flight) -> dict[str, object]:
    """Hashes of all that passed between bench and flight program and of the plant's states; grounds and draws."""
    return {
        "streams": flight.streams,
        "states_sha256": flight.states_sha256,
        "error": flight.error,
        "ground": ground_digest(),
        "drawn": drawn_digest(),
    }


def ground_digest() -> str:
    """Of fractal soil with craters and Golombek's rocks: every law of the recipe."""
    recipe = Recipe(0.8, median_slope_deg=5.0, craters=CraterLaw(), rocks=Golombek(0.06))
    return field_digest(compose(recipe, Course(), generator(7)))


def field_digest(field: Field) -> str:
    """Of its soil, rocks, orbiter's map and goal."""
    parts = [field.soil_z, field.gdem.heights_m, np.array(field.goal_m), *(rock.vertices_m for rock in field.rocks)]
    return hashlib.sha256(b"".join(np.ascontiguousarray(part).tobytes() for part in parts)).hexdigest()


def drawn_digest() -> str:
    """Of what the bench's generators draw."""
    rng = generator(11)
    drawn = [
        rng.standard_normal(100_000),
        rng.exponential(2.0, 100_000),
        rng.poisson(3.5, 10_000),
        rng.binomial(50, 0.1, 10_000),
        rng.uniform(-1.0, 1.0, 1000),
    ]
    return hashlib.sha256(b"".join(part.tobytes() for part in drawn)).hexdigest()


if __name__ == "__main__":
    print(json.dumps(told(flown())))
