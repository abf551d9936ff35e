"""Mission of a campaign: to the goal of a generated field, with keep-outs along the field's edges.

The bench has no ground beyond its fields: a look over an edge sees nothing, and the planner would look for a way there.
"""

from __future__ import annotations

from itertools import chain

from hil.run.in_process import CAMPAIGN_STEP_NS, GOTO_S, InMemory
from hil.scenarios.model import Scenario, ground_of
from hil.terrain.field import Field
from hil.world.operator import TimedCommand
from onboard.records import Grid

LIMIT_S = 3600.0
KEEP_OUT_M = 0.6  # from the field's edge; the bench ends a flight whose body's middle is 0.5 m from it


def bench_to_goal(scenario: Scenario) -> InMemory:
    """Return the bench of a scenario with the orders of its mission: the keep-outs, then `goto` to the field's goal."""
    ground = ground_of(scenario).field
    return InMemory(scenario, (*edges(ground), goto(ground.goal_m)), ground=ground, step_ns=CAMPAIGN_STEP_NS)


def edges(field: Field) -> tuple[TimedCommand, ...]:
    """Return the orders of four keep-outs, a strip along each edge of the field."""
    return tuple(
        TimedCommand(GOTO_S, "fence_add", {"fence": name, "kind": "keep_out", "corners_m": tuple(chain(*corners))})
        for name, corners in strips(field.grid).items()
    )


def strips(grid: Grid) -> dict[str, tuple[tuple[float, float], ...]]:
    """Return the corners of a strip along each edge of a grid."""
    west, south = grid.x0_m, grid.y0_m
    east, north = grid.centre(grid.rows - 1, grid.columns - 1)
    boxes = {
        "west": (west, south, west + KEEP_OUT_M, north),
        "east": (east - KEEP_OUT_M, south, east, north),
        "south": (west, south, east, south + KEEP_OUT_M),
        "north": (west, north - KEEP_OUT_M, east, north),
    }
    return {name: ((x0, y0), (x1, y0), (x1, y1), (x0, y1)) for name, (x0, y0, x1, y1) in boxes.items()}


def goto(goal_m: tuple[float, float]) -> TimedCommand:
    """Return the order to a goal: at once; the first one after the rover's start."""
    return TimedCommand(GOTO_S, "goto", {"x_m": goal_m[0], "y_m": goal_m[1]})
