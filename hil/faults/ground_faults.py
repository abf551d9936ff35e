r"""Ground that changes during a run: a trench or a step across the route, where the scans saw level ground.

                  2 m across
    trench   ----+         +----  0.30 m along, 0.12 m deep       step       +-----------+   0.60 m along, 0.10 m high
                 |_________|                                             ----+           +----
           route -->                                                   route -->

The walls are one cell of the field wide: 5 cm. The seed gives the place, 2.5 to 7 m along the route from the rover's
position: nearer obstacles are the task of the scan. Nothing heals it.

`collapse` is another fault: the ground under the left wheels falls by 15 cm.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from hil.own_functions import generator
from hil.plant.turns import rotate
from hil.terrain.obstacle import ACROSS_M, Obstacle, ObstacleShape
from hil.world.world import World
from onboard.native import each, elementary
from onboard.records import F64

NEAREST_M, FARTHEST_M, BEFORE_END_M = 2.5, 7.0, 0.5


KINDS: Mapping[str, ObstacleShape] = MappingProxyType(
    {"trench": ObstacleShape(-0.12, 0.30), "step": ObstacleShape(0.10, 0.60)}
)
SINKS, SINKS_ASIDE_M = ObstacleShape(-0.15, 2.40), 0.05


def across(kind: ObstacleShape, way_m: F64, seed: int) -> Obstacle | None:
    """Obstacle across a route (k, 2) at a place given by `seed`; None if the route is too short."""
    steps = np.diff(way_m, axis=0)
    lengths = each.hypot(*steps.T)
    at_m = np.concatenate([[0.0], np.cumsum(lengths)])
    farthest_m = min(FARTHEST_M, float(at_m[-1]) - BEFORE_END_M)
    if farthest_m < NEAREST_M:
        return None
    drawn_m = float(generator([seed, 21]).uniform(NEAREST_M, farthest_m))
    k = int(np.searchsorted(at_m, drawn_m)) - 1
    x, y = way_m[k] + (drawn_m - at_m[k]) / lengths[k] * steps[k]
    return Obstacle(kind, float(x), float(y), elementary.atan2(steps[k, 1], steps[k, 0]))


def put(bench: World, obstacle: Obstacle) -> None:
    """Put an obstacle into the ground of a running bench."""
    bench.obstacles.append(obstacle)
    _change(bench, obstacle)


def _change(bench: World, obstacle: Obstacle) -> None:
    before = bench.plant.field
    bench.plant.reshape(obstacle.dug(before))
    bench.truth.add_ground(bench.state.now_ns, before, bench.plant.field)


def before_the_goal(name: str) -> Callable[[World], None]:
    """Function that puts one of KINDS across the straight line from rover to goal, at a place given by the seed."""

    def begin(bench: World) -> None:
        obstacle = across(KINDS[name], np.array([bench.state.position_m[:2], bench.field.goal_m]), bench.field.seed)
        if obstacle is not None:
            put(bench, obstacle)

    return begin


def collapse(bench: World, _processes: object, _target: int) -> None:
    """Let the ground fall under the left wheels, starting SINKS_ASIDE_M to the left of the rover's middle."""
    q, (x, y, _) = tuple(bench.state.quaternion_xyzw.tolist()), bench.state.position_m.tolist()
    behind_x, behind_y, _ = rotate(q, (-SINKS.along_m / 2, SINKS_ASIDE_M + ACROSS_M / 2, 0.0))
    ahead_x, ahead_y, _ = rotate(q, (1.0, 0.0, 0.0))
    _change(bench, Obstacle(SINKS, x + behind_x, y + behind_y, elementary.atan2(ahead_y, ahead_x)))
