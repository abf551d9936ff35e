"""The demo's fields 101 to 130, never used for tuning: at the goal by truth, or stopped with the true reason.

The scanner is the scenarios' default. No contact of a wheel with a rock over 0.08 m, none of the body.
"""

from __future__ import annotations

from collections.abc import Sequence

from hil.campaign.mission import LIMIT_S, bench_to_goal
from hil.scenarios.model import Scenario
from tests.scenarios.goals import losses
from tests.scenarios.goals.flown import Row, line

SEEDS = tuple(range(101, 131))
SHORT = (101, 103)
judge = losses.judge


def fly(seed: int) -> Row:
    """Fly the mission on the seed's field."""
    return losses.flown(bench_to_goal(Scenario(name="fresh", terrain="fbm", seed=seed, limit_s=LIMIT_S)), seed)


def summary(rows: Sequence[Row]) -> list[tuple[str, ...]]:
    """Return one line."""
    return [line("fresh fields", rows)]
