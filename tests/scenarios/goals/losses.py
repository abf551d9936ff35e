"""Missions with a scanner that loses 1, 3 or 8 % of its beams: at the goal, or stopped with the true reason.

The demo's fields 1 to 30; seed 101 is field 1 at 1 %, 330 is field 30 at 3 %, 801 is field 1 at 8 %. No mission touches
anything, and none ends with "no way is left": each field has a way. Keep-outs along the field's edges are set first:
the world ends there, and the flight program would look for a way beyond.
"""

from __future__ import annotations

from collections.abc import Sequence

from hil.campaign.mission import LIMIT_S, Watch, bench_to_goal, outcome_of
from hil.run.in_process import InMemory
from hil.scenarios.model import Scenario
from tests.scenarios.goals.flown import Row, broken, ended, line, with_losses

PERCENTS, FIELDS = (1, 3, 8), range(1, 31)
SEEDS = tuple(100 * percent + field for percent in PERCENTS for field in FIELDS)
SHORT = (101, 801)


def fly(seed: int) -> Row:
    """Fly the mission of a seed."""
    percent, field = divmod(seed, 100)
    scenario = Scenario(name="losses", terrain="fbm", seed=field, limit_s=LIMIT_S)
    return flown(with_losses(bench_to_goal(scenario), percent / 100), seed)


def flown(bench: InMemory, seed: int) -> Row:
    """Fly to the end of the mission."""
    watch, goal_m = Watch(), bench.field.goal_m
    flight = bench.run(watch)
    outcome = outcome_of(bench, flight.error)
    return ended(bench, watch, seed, goal_m, outcome, (watch.error_m,) if outcome == "arrived" else ())


def judge(rows: Sequence[Row]) -> list[str]:
    """Judge each flight by itself."""
    return [text for row in rows for text in broken(row)]


def summary(rows: Sequence[Row]) -> list[tuple[str, ...]]:
    """Return a line for each share of lost beams."""
    percents = sorted({row.seed // 100 for row in rows})
    return [line(f"{percent} % lost", [row for row in rows if row.seed // 100 == percent]) for percent in percents]
