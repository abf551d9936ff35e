"""A world without physics: true ground in 5 cm steps, a rover that stands on its four wheels, contacts that count.

The rocker differential lets the body follow the plane of the four wheels: pitch from the mean of front and rear, roll
from left and right. Holes are part of the raster, with steep walls.

A wheel's step is how far the ground anywhere under it (0.2 x 0.1 m) rises over the lowest ground of the patch that it
stands on, 10 x 10 cm about its contact point. A tyre meets what rises before it; what falls away
under its rim it does not touch as long as it stands: 10 cm from the contact point the rim is a radius above the ground.
All contacts are with whole cells of the raster, touched even by a border.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from hil.fields import surface_of
from hil.heightfield import HeightField
from hil.mesh import soil_height
from hil.terrain import Field, truth_height
from onboard.config import Rover
from onboard.records import F32, F64, Bool, Grid, Pose, Surface
from protocol.conventions import WHEEL_SIGNS

HARD_BELLY_M, SOFT_BELLY_M = 0.15, 0.12  # ground above the wheel plane under the body
HARD_STEP_M, SOFT_STEP_M = 0.12, 0.10  # of one wheel
HALF_PATCH_M = 0.05  # of the patch that a wheel stands on
HARD_TILT_RAD, SOFT_TILT_RAD = math.radians(30), math.radians(27)
CLEAR, SOFT, HARD = 0, 1, 2


@dataclass(frozen=True)
class World:
    """True heights (rows, columns) on `grid`; where the rover starts and wants to go; what is drawn into the ground.

    holes: (n, 4) x, y, width, depth.
    """

    grid: Grid
    heights_m: F32
    start: Pose
    goal_m: tuple[float, float]
    seed: int
    kind: str
    holes: F64

    @cached_property
    def rays(self) -> HeightField:
        """What beams meet."""
        return HeightField(self.grid, self.heights_m)

    def height_m(self, x_m: F64, y_m: F64) -> F64:
        """True height at points."""
        return soil_height(self.grid, self.heights_m, x_m, y_m)

    def sunk(self, holes: F64) -> World:
        """The same world with round holes (n, 4) of x, y, width, depth, their walls steep."""
        grid, heights = self.grid, self.heights_m.copy()
        x, y = grid.x0_m + np.arange(grid.columns) * grid.cell_m, grid.y0_m + np.arange(grid.rows) * grid.cell_m
        for at_x, at_y, width_m, depth_m in holes:
            heights[np.hypot(x[None, :] - at_x, y[:, None] - at_y) <= width_m / 2] -= np.float32(depth_m)
        return replace(self, heights_m=heights, holes=np.concatenate([self.holes, holes]))

    def stand(self, x_m: float, y_m: float, yaw_rad: float, rover: Rover) -> Pose:
        """The pose of the rover set down there, from the heights under its wheels."""
        c, s = math.cos(yaw_rad), math.sin(yaw_rad)
        length, width = rover.half_wheelbase_m, rover.half_track_m
        along, across = np.array([length, -length, -length, length]), np.array([width, width, -width, -width])
        z = self.height_m(x_m + c * along - s * across, y_m + s * along + c * across)
        pitch = math.atan2(float(z[1] + z[2] - z[0] - z[3]) / 2, 2 * length)  # nose up is negative (REP-103)
        roll = math.atan2(float(z[0] + z[1] - z[2] - z[3]) / 2, 2 * width)
        return Pose(x_m, y_m, float(z.mean()), roll, pitch, yaw_rad)

    def contact(self, pose: Pose, rover: Rover) -> int:
        """CLEAR, SOFT or HARD of the rover standing at a pose: belly, a step under a wheel, tilt."""
        tilt = max(abs(pose.roll_rad), abs(pose.pitch_rad))
        belly, step = self._rises_m(pose, rover)
        if belly > HARD_BELLY_M or step > HARD_STEP_M or tilt > HARD_TILT_RAD:
            return HARD
        return SOFT if belly > SOFT_BELLY_M or step > SOFT_STEP_M or tilt > SOFT_TILT_RAD else CLEAR

    def belly_m(self, pose: Pose, rover: Rover) -> float:
        """How far the ground under the deck rises above the wheel plane at most."""
        return self._rises_m(pose, rover)[0]

    def _rises_m(self, pose: Pose, rover: Rover) -> tuple[float, float]:
        """`belly_m`, and the largest step of a wheel with the wheel plane taken out."""
        x, y, stood, ends = _patches(rover, self.grid.cell_m / 2)
        above = np.split(self._above(pose, x, y), ends)
        steps = [wheel.max() - wheel[on].min() for wheel, on in zip(above[1:], np.split(stood, ends)[1:])]
        return float(above[0].max()), float(max(steps))

    def _above(self, pose: Pose, along_m: F64, across_m: F64) -> F64:
        """Height over the wheel plane of the raster's cells at points of the body, each at the cell's own place.

        Between cells the raster has no walls: what stands upright in it would lean into the next cell.
        """
        grid, c, s = self.grid, math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
        x, y = pose.x_m + c * along_m - s * across_m, pose.y_m + s * along_m + c * across_m
        i = np.rint((x - grid.x0_m) / grid.cell_m).astype(np.int64).clip(0, grid.columns - 1)
        j = np.rint((y - grid.y0_m) / grid.cell_m).astype(np.int64).clip(0, grid.rows - 1)
        dx, dy = grid.x0_m + i * grid.cell_m - pose.x_m, grid.y0_m + j * grid.cell_m - pose.y_m
        slope_along, slope_across = -math.tan(pose.pitch_rad), math.tan(pose.roll_rad)
        plane = pose.z_m + (c * dx + s * dy) * slope_along + (c * dy - s * dx) * slope_across
        above: F64 = self.heights_m[j, i] - plane
        return above


@lru_cache
def _patches(rover: Rover, step_m: float) -> tuple[F64, F64, Bool, tuple[int, ...]]:
    """Points of the body along and across, `step_m` apart: under the deck, then under each wheel; where each ends.

    The third: whether the wheel stands on the point, False under the deck.
    """
    deck_x, deck_y = _lattice(2 * rover.half_wheelbase_m, 2 * rover.half_track_m, step_m)
    patches = [(deck_x, deck_y, np.zeros(len(deck_x), np.bool_))]
    x, y = _lattice(2 * rover.wheel_radius_m, rover.wheel_width_m, step_m)
    stood = np.maximum(np.abs(x), np.abs(y)) <= HALF_PATCH_M + 1e-9
    for a, b in WHEEL_SIGNS:
        patches.append((x + a * rover.half_wheelbase_m, y + b * rover.half_track_m, stood))
    along, across, on = (np.concatenate(parts) for parts in zip(*patches))
    return along, across, on, tuple(np.cumsum([len(part[0]) for part in patches])[:-1])


def _lattice(length_m: float, width_m: float, step_m: float) -> tuple[F64, F64]:
    """Points over a rectangle about the origin, its border included."""
    x = np.linspace(-length_m / 2, length_m / 2, math.ceil(length_m / step_m) + 1)
    y = np.linspace(-width_m / 2, width_m / 2, math.ceil(width_m / step_m) + 1)
    across, along = np.meshgrid(y, x)
    return along.ravel(), across.ravel()


def wheels(pose: Pose, rover: Rover) -> list[tuple[float, float]]:
    """(x, y) of the four wheels."""
    c, s = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    length, width = rover.half_wheelbase_m, rover.half_track_m
    return [
        (pose.x_m + c * a * length - s * b * width, pose.y_m + s * a * length + c * b * width) for a, b in WHEEL_SIGNS
    ]


def of_field(field: Field, kind: str) -> World:
    """The world of a field, without holes."""
    return World(
        field.grid, truth_height(field), field.start, field.goal_m, field.seed, kind, holes=np.empty((0, 4))
    )


def true_surface(world: World, cell_m: float) -> Surface:
    """The whole true ground as a planner would know it at best: every cell hit."""
    return surface_of(world.grid, world.heights_m, cell_m)
