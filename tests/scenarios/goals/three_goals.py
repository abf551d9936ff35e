"""Three goals in a row, and at each a turn on the spot by 360 degrees: no contact, and a pose error below 0.1 m.

The demo's fields 1 to 20. Goals are drawn by the seed, 3 to 9 m from one another and 1.5 m or more from the field's
edge, where the true ground has a way with margin to and where a rover with a position error of up to 0.1 m can turn
without touching a rock. The turn is three orders `turn` of 120 degrees, which use no map: the place itself must be
free. Keep-outs along the field's edges are set first: the world ends there, and the flight program would look for a way
beyond.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from hil.campaign.mission import LIMIT_S, Watch, edges, goto, outcome_of
from hil.plant.plant import PlantAbortError
from hil.run.in_process import CAMPAIGN_STEP_NS, InMemory
from hil.scenarios.model import Scenario
from hil.terrain.field import Field
from hil.terrain.fields import free_with_room, pose_of, true_surface
from hil.world.operator import TimedCommand
from onboard.config import Planning, Rover
from onboard.planning.local import poses
from onboard.records import F64, Bool
from protocol.conventions import wrap_rad
from tests.scenarios.goals.flown import Row, broken, ended, line

SEEDS = tuple(range(1, 21))
SHORT = (1,)
GOALS, APART_M, EDGE_M = 3, (3.0, 9.0), 1.5
OFF_M, ROCK_M, ERROR_M = 0.1, 0.06, 0.1
TURNS = 3
PLACES_TRIED = 10_000


def fly(seed: int) -> Row:
    """Fly the mission on the seed's field, to its end or to the first order that fails."""
    scenario = Scenario(name="three-goals", terrain="fbm", seed=seed, limit_s=LIMIT_S)
    bench = InMemory(scenario, (), step_ns=CAMPAIGN_STEP_NS)
    watch, errors_m, reason = Watch(), [], ""
    goals = goals_of(bench.field, seed)
    goal = goals[0]
    try:
        assert all([_done(bench, watch, order) for order in edges(bench.field)])
        for goal in goals:
            if not (_done(bench, watch, goto(goal)) and all(_done(bench, watch, turn(bench)) for _ in range(TURNS))):
                break
            errors_m.append(watch.error_m)
    except PlantAbortError as abort:
        reason = str(abort)
    finally:
        bench.free()
    outcome = outcome_of(bench, reason)
    if outcome == "arrived" and len(errors_m) < GOALS:
        outcome = f"the limit of {LIMIT_S:g} s"
    return ended(bench, watch, seed, goal, outcome, errors_m)


def turn(bench: InMemory) -> TimedCommand:
    """Return the order of a third of a turn to the left."""
    assert bench.rover is not None
    yaw_rad = bench.rover.localisation.pose.yaw_rad
    return TimedCommand(0.0, "turn", {"heading_rad": round(float(wrap_rad(yaw_rad + 2 * math.pi / TURNS)), 6)})


def _done(bench: InMemory, watch: Watch, order: TimedCommand) -> bool:
    """Give an order and fly until its outcome is known; return whether it was completed."""
    bench.operator.ask(order)
    while not bench.ended:
        bench.step(watch)
    return bench.operator.done and outcome_of(bench) == "arrived"


def goals_of(field: Field, seed: int) -> tuple[tuple[float, float], ...]:
    """Return the goals of a seed, rounded to 1 cm. Raises ValueError if the field has no such places."""
    rng, surface = np.random.default_rng([seed, 0x3A]), true_surface(field)
    roomy = free_with_room(surface, Rover(), Planning())
    o, j, i = pose_of(surface.grid, field.start.x_m, field.start.y_m, field.start.yaw_rad)
    freedom = np.where(roomy, poses.Freedom.FREE, poses.Freedom.BLOCKED).astype(np.uint8)
    freedom[o, j, i] = poses.Freedom.FREE  # where the rover stands, as the planner takes it
    good = poses.reachable(freedom, j, i, o).all(axis=0)
    found: list[tuple[float, float]] = []
    at = (field.start.x_m, field.start.y_m)
    for x_m, y_m in _places(field, rng).tolist():
        if not APART_M[0] <= math.dist(at, (x_m, y_m)) <= APART_M[1]:
            continue
        if _all_good(good, *surface.grid.cell(x_m, y_m)) and clear_m(field, x_m, y_m) >= turning_m(Rover()) + OFF_M:
            at = (x_m, y_m)
            found.append(at)
        if len(found) == GOALS:
            return tuple(found)
    raise ValueError(f"field {seed}: only {len(found)} of {GOALS} places to turn at in {PLACES_TRIED} tries")


def _places(field: Field, rng: np.random.Generator) -> F64:
    grid = field.grid
    low = np.array([grid.x0_m, grid.y0_m]) + EDGE_M
    high = np.array(grid.centre(grid.rows - 1, grid.columns - 1)) - EDGE_M
    return np.asarray(np.round(rng.uniform(low, high, (PLACES_TRIED, 2)), 2))


def _all_good(good: Bool, j: int, i: int) -> bool:
    """Return whether a cell and its neighbours are good."""
    return bool(good[max(j - 1, 0) : j + 2, max(i - 1, 0) : i + 2].all())


def clear_m(field: Field, x_m: float, y_m: float) -> float:
    """Return the distance to the nearest rock of ROCK_M or more, by its widest radius; inf if there is none."""
    rocks = [rock for rock in field.rocks if rock.height_m >= ROCK_M]
    return min((math.hypot(rock.x_m - x_m, rock.y_m - y_m) - rock.diameter_m / 2 for rock in rocks), default=math.inf)


def turning_m(rover: Rover) -> float:
    """Return the reach of the tyres in a turn on the spot, with the wheels steered along it."""
    arm_m = math.hypot(rover.half_wheelbase_m, rover.half_track_m) + rover.wheel_width_m / 2
    return math.hypot(arm_m, rover.wheel_radius_m)


def judge(rows: Sequence[Row]) -> list[str]:
    """Judge each flight by itself, and the pose at each goal."""
    return [text for row in rows for text in broken(row)] + [
        f"seed {row.seed}: the pose is {error} m off at goal {goal}, {ERROR_M} promised"
        for row in rows
        for goal, error in enumerate(row.goal_errors_m, 1)
        if error > ERROR_M
    ]


def summary(rows: Sequence[Row]) -> list[tuple[str, ...]]:
    """Return one line."""
    return [line("three goals, a turn at each", rows)]
