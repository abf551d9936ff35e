r"""Ground that changes in mid-run: a trench or a step across the way ahead, where the scans saw level ground.

                  2 m across
    trench   ----+         +----  0.30 m along, 0.12 m deep       step       +-----------+   0.60 m along, 0.10 m high
                 |_________|                                             ----+           +----
             way -->                                                     way -->

Their walls stand between two nodes of the field: 5 cm. The place is drawn from a seed, 2.5 to 7 m of way from where the
rover stood: what lies nearer is the scan's business. Nothing heals it.

`collapse` is another matter: the ground under the left wheels falls by 15 cm.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from hil.bench.world import World
from hil.plant.turns import rotate
from hil.terrain.field import Field
from onboard.records import F32, F64, Bool

ACROSS_M = 2.0
NEAREST_M, FARTHEST_M, BEFORE_END_M = 2.5, 7.0, 0.5


@dataclass(frozen=True, slots=True)
class Kind:
    """rise_m: how much the ground changes; along_m: over so much of the way."""

    rise_m: float
    along_m: float


KINDS: Mapping[str, Kind] = MappingProxyType({"trench": Kind(-0.12, 0.30), "step": Kind(0.10, 0.60)})
SINKS, SINKS_ASIDE_M = Kind(-0.15, 2.40), 0.05


@dataclass(frozen=True, slots=True)
class Obstacle:
    """One of KINDS whose near edge has its middle at x, y; yaw_rad: of the way that crosses it there."""

    kind: Kind
    x_m: float
    y_m: float
    yaw_rad: float

    def holds(self, x_m: F64, y_m: F64, margin_m: float = 0.0) -> Bool:
        """Which points lie on it, or within a margin of it."""
        along = self.along_m(x_m, y_m)
        across = math.cos(self.yaw_rad) * (y_m - self.y_m) - math.sin(self.yaw_rad) * (x_m - self.x_m)
        within: Bool = (along >= -margin_m) & (along <= self.kind.along_m + margin_m)
        return within & (np.abs(across) <= ACROSS_M / 2 + margin_m)

    def along_m(self, x_m: F64, y_m: F64) -> F64:
        """How far points lie beyond its near edge."""
        return math.cos(self.yaw_rad) * (x_m - self.x_m) + math.sin(self.yaw_rad) * (y_m - self.y_m)

    def dug(self, field: Field) -> F32:
        """The field's soil with it, (rows, columns)."""
        grid = field.grid
        x = grid.x0_m + np.arange(grid.columns) * grid.cell_m
        y = grid.y0_m + np.arange(grid.rows) * grid.cell_m
        return field.soil_z + np.float32(self.kind.rise_m) * self.holds(x[None, :], y[:, None])


def across(kind: Kind, way_m: F64, seed: int) -> Obstacle | None:
    """An obstacle across a way (k, 2) at a place that `seed` draws; None where the way is too short for one."""
    steps = np.diff(way_m, axis=0)
    lengths = np.hypot(*steps.T)
    at_m = np.concatenate([[0.0], np.cumsum(lengths)])
    farthest_m = min(FARTHEST_M, float(at_m[-1]) - BEFORE_END_M)
    if farthest_m < NEAREST_M:
        return None
    drawn_m = float(np.random.default_rng([seed, 21]).uniform(NEAREST_M, farthest_m))
    k = int(np.searchsorted(at_m, drawn_m)) - 1
    x, y = way_m[k] + (drawn_m - at_m[k]) / lengths[k] * steps[k]
    return Obstacle(kind, float(x), float(y), math.atan2(steps[k, 1], steps[k, 0]))


def put(bench: World, obstacle: Obstacle) -> None:
    """Into the ground of a running bench."""
    before = bench.plant.field
    bench.plant.reshape(obstacle.dug(before))
    bench.truth.add_ground(bench.state.now_ns, before, bench.plant.field)


def before_the_goal(name: str) -> Callable[[World], None]:
    """What puts one of KINDS across the straight way from where the rover is to the goal, at a place by the seed."""

    def begin(bench: World) -> None:
        obstacle = across(KINDS[name], np.array([bench.state.position_m[:2], bench.field.goal_m]), bench.field.seed)
        if obstacle is not None:
            put(bench, obstacle)

    return begin


def collapse(bench: World, _processes: object, _target: int) -> None:
    """Lets the ground under the left wheels, from SINKS_ASIDE_M beside the rover's middle on, fall away."""
    q, (x, y, _) = tuple(bench.state.quaternion_xyzw.tolist()), bench.state.position_m.tolist()
    behind_x, behind_y, _ = rotate(q, (-SINKS.along_m / 2, SINKS_ASIDE_M + ACROSS_M / 2, 0.0))
    ahead_x, ahead_y, _ = rotate(q, (1.0, 0.0, 0.0))
    put(bench, Obstacle(SINKS, x + behind_x, y + behind_y, math.atan2(ahead_y, ahead_x)))
