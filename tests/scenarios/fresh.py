"""The demo's fields 101 to 130, never used for tuning: at the goal by truth, or stopped with the true reason.

The scanner is the scenarios' default. No contact of a wheel with a rock over 0.08 m, none of the body.
"""

from __future__ import annotations

from collections.abc import Sequence

from hil.bench.in_memory import CAMPAIGN_STEP_NS, InMemory
from hil.scenario.scenario import Scenario, ground_of
from tests.scenarios import losses
from tests.scenarios.flown import Row, line
from tests.scenarios.three_goals import edges, goto

SEEDS = tuple(range(101, 131))
SHORT = (101, 103)
judge = losses.judge


def fly(seed: int) -> Row:
    """Fly the mission on the seed's field."""
    scenario = Scenario(name="fresh", terrain="fbm", seed=seed, limit_s=3600.0)
    ground = ground_of(scenario).field
    bench = InMemory(scenario, (*edges(ground), goto(ground.goal_m)), ground=ground, step_ns=CAMPAIGN_STEP_NS)
    return losses.flown(bench, seed)


def summary(rows: Sequence[Row]) -> list[tuple[str, ...]]:
    """Return one line."""
    return [line("fresh fields", rows)]
