"""A world without physics: true ground in 5 cm steps, a rover that stands on its four wheels, contacts that count.

The rocker differential lets the body follow the plane of the four wheels: pitch from the mean of front and rear, roll
from left and right. Holes are part of the raster, with steep walls.

A wheel's step is how far the ground anywhere under it (0.2 x 0.1 m) rises over the lowest ground of the patch that it
stands on, 10 x 10 cm about its contact point. A tyre meets what rises before it; what falls away
under its rim it does not touch as long as it stands: 10 cm from the contact point the rim is a radius above the ground.
What touches are the raster's nodes that lie under tyre and body: between nodes a wall would lean out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from hil.plant.rays.ground_rays import GroundRays
from hil.terrain.field import Field, truth_height
from hil.terrain.fields import surface_of
from hil.terrain.heightfield import HeightField
from hil.terrain.mesh import soil_height
from hil.terrain.rocks import Rock
from onboard.config import Rover
from onboard.records import F32, F64, Bool, Grid, Pose, Surface
from protocol.conventions import WHEEL_SIGNS

HARD_BELLY_M, SOFT_BELLY_M = 0.15, 0.12  # ground above the wheel plane under the body
HARD_STEP_M, SOFT_STEP_M = 0.12, 0.10  # of one wheel
HALF_PATCH_M = 0.05  # of the patch that a wheel stands on
TYRE_REACH_M = 0.15  # greatest distance of a tyre's point from the wheel's centre
HARD_TILT_RAD, SOFT_TILT_RAD = math.radians(30), math.radians(27)
CLEAR, SOFT, HARD = 0, 1, 2


class Caster(Protocol):
    """Beams from one point: see HeightField.cast."""

    def cast(self, origin_m: F64, directions: F64, range_m: float) -> F64:
        """Return ranges (n,) along unit directions (n, 3); inf where nothing is met in range."""
        ...


class Triangles:
    """The true soil and the rocks' own triangles: a rock narrower than a few nodes of the raster keeps its shape."""

    def __init__(self, made: Field) -> None:
        self._rays = GroundRays(made)

    def cast(self, origin_m: F64, directions: F64, range_m: float) -> F64:
        """See Caster."""
        return self._rays.cast(np.broadcast_to(np.asarray(origin_m, np.float64), directions.shape), directions, range_m)


@dataclass(frozen=True)
class World:
    """True heights (rows, columns) on `grid`, start and goal of the rover, and objects in the ground.

    holes: (n, 4) x, y, width, depth.
    dark: (n, 3) x, y, radius of discs whose ground and rocks return no light.
    caster: replaces the raster for beams; None: the raster.
    rocks: as bodies; the raster has them as well.
    soil_m: heights without the rocks, (rows, columns); None: as heights_m.
    """

    grid: Grid
    heights_m: F32
    start: Pose
    goal_m: tuple[float, float]
    seed: int
    kind: str
    holes: F64
    dark: F64 = field(default_factory=lambda: np.empty((0, 3)))
    caster: Caster | None = None
    rocks: tuple[Rock, ...] = ()
    soil_m: F32 | None = None

    @cached_property
    def rays(self) -> Caster:
        """Surface that beams hit."""
        return self.caster or HeightField(self.grid, self.heights_m)

    def height_m(self, x_m: F64, y_m: F64) -> F64:
        """True height at points."""
        return soil_height(self.grid, self.heights_m, x_m, y_m)

    def soil_height_m(self, x_m: F64, y_m: F64) -> F64:
        """True height of the soil alone at points."""
        return soil_height(self.grid, self.heights_m if self.soil_m is None else self.soil_m, x_m, y_m)

    def is_dark(self, points_m: F64) -> Bool:
        """Return the mask of points (n, 2) on a dark disc."""
        found = np.zeros(len(points_m), np.bool_)
        for x_m, y_m, radius_m in self.dark:
            found |= np.hypot(points_m[:, 0] - x_m, points_m[:, 1] - y_m) <= radius_m
        return found

    def sunk(self, holes: F64) -> World:
        """Return the same world with round holes (n, 4) of x, y, width, depth, with steep walls."""
        grid, deep = self.grid, np.zeros_like(self.heights_m)
        x, y = grid.x0_m + np.arange(grid.columns) * grid.cell_m, grid.y0_m + np.arange(grid.rows) * grid.cell_m
        for at_x, at_y, width_m, depth_m in holes:
            deep[np.hypot(x[None, :] - at_x, y[:, None] - at_y) <= width_m / 2] += np.float32(depth_m)
        soil = None if self.soil_m is None else self.soil_m - deep
        return replace(self, heights_m=self.heights_m - deep, soil_m=soil, holes=np.concatenate([self.holes, holes]))

    def stand(self, x_m: float, y_m: float, yaw_rad: float, rover: Rover) -> Pose:
        """Return the pose of the rover placed there, from the heights under its wheels."""
        c, s = math.cos(yaw_rad), math.sin(yaw_rad)
        length, width = rover.half_wheelbase_m, rover.half_track_m
        along, across = np.array([length, -length, -length, length]), np.array([width, width, -width, -width])
        z = self.height_m(x_m + c * along - s * across, y_m + s * along + c * across)
        pitch = math.atan2(float(z[1] + z[2] - z[0] - z[3]) / 2, 2 * length)  # nose up is negative (REP-103)
        roll = math.atan2(float(z[0] + z[1] - z[2] - z[3]) / 2, 2 * width)
        return Pose(x_m, y_m, float(z.mean()), roll, pitch, yaw_rad)

    def contact(self, pose: Pose, rover: Rover) -> int:
        """Return CLEAR, SOFT or HARD for the rover standing at a pose: belly, a step under a wheel, tilt."""
        tilt = max(abs(pose.roll_rad), abs(pose.pitch_rad))
        belly, step = self._rises_m(pose, rover)
        if belly > HARD_BELLY_M or step > HARD_STEP_M or tilt > HARD_TILT_RAD:
            return HARD
        return SOFT if belly > SOFT_BELLY_M or step > SOFT_STEP_M or tilt > SOFT_TILT_RAD else CLEAR

    def belly_m(self, pose: Pose, rover: Rover) -> float:
        """Return the greatest height of the ground under the deck above the wheel plane."""
        return self._rises_m(pose, rover)[0]

    def _rises_m(self, pose: Pose, rover: Rover) -> tuple[float, float]:
        """Return `belly_m`, and the largest step of a wheel relative to the wheel plane."""
        along, across, above = self._over(pose, math.hypot(rover.half_wheelbase_m, rover.half_track_m) + TYRE_REACH_M)
        under = _within(along, across, rover.half_wheelbase_m, rover.half_track_m)
        steps = []
        for a, b in WHEEL_SIGNS:
            ahead, beside = along - a * rover.half_wheelbase_m, across - b * rover.half_track_m
            tyre = _within(ahead, beside, rover.wheel_radius_m, rover.wheel_width_m / 2)
            stood = _within(ahead, beside, HALF_PATCH_M, HALF_PATCH_M)
            steps.append(above[tyre].max() - above[stood].min())
        return float(above[under].max()), float(max(steps))

    def _over(self, pose: Pose, reach_m: float) -> tuple[F64, F64, F64]:
        """Return nodes of the raster near a pose: along and across the body, height over the wheel plane."""
        grid, c, s = self.grid, math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
        i0, i1 = (round((pose.x_m - grid.x0_m + side * reach_m) / grid.cell_m) for side in (-1, 1))
        j0, j1 = (round((pose.y_m - grid.y0_m + side * reach_m) / grid.cell_m) for side in (-1, 1))
        i, j = np.arange(i0, i1 + 1), np.arange(j0, j1 + 1)
        dx, dy = np.meshgrid(grid.x0_m + i * grid.cell_m - pose.x_m, grid.y0_m + j * grid.cell_m - pose.y_m)
        along, across = c * dx + s * dy, c * dy - s * dx
        plane = pose.z_m - along * math.tan(pose.pitch_rad) + across * math.tan(pose.roll_rad)
        z = self.heights_m[np.ix_(j.clip(0, grid.rows - 1), i.clip(0, grid.columns - 1))]
        return along, across, z - plane


def _within(along_m: F64, across_m: F64, half_length_m: float, half_width_m: float) -> Bool:
    """Return the mask of points in a rectangle about the origin, its border included."""
    inside: Bool = (np.abs(along_m) <= half_length_m + 1e-9) & (np.abs(across_m) <= half_width_m + 1e-9)
    return inside


def wheels(pose: Pose, rover: Rover) -> list[tuple[float, float]]:
    """Return (x, y) of the four wheels."""
    c, s = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    length, width = rover.half_wheelbase_m, rover.half_track_m
    return [
        (pose.x_m + c * a * length - s * b * width, pose.y_m + s * a * length + c * b * width) for a, b in WHEEL_SIGNS
    ]


def of_field(made: Field, kind: str) -> World:
    """Return the world of a field, without holes."""
    return World(
        made.grid,
        truth_height(made),
        made.start,
        made.goal_m,
        made.seed,
        kind,
        holes=np.empty((0, 4)),
        rocks=made.rocks,
        soil_m=made.soil_z,
    )


def true_surface(world: World, cell_m: float) -> Surface:
    """Return the whole true ground as a planner's best knowledge: every cell hit."""
    return surface_of(world.grid, world.heights_m, cell_m)
