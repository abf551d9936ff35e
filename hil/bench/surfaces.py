"""What the scanner's beams meet on a field: the angle to the surface, and how far it returns light. For lidar_light.py.

    hit point -> over a rock's disc and above the soil?  rock: albedo, normal of the sphere it was cut from
                 else soil: albedo, normal of the slope over two cells
                 within a dark patch: the dark albedo, whatever stands there

The slope over two cells (0.1 to 0.2 m) is that of a beam's footprint, which is longer than a triangle of the mesh; a
rock's facets are not told apart. A surface of albedo a is seen up to far_m * sqrt(a): light that comes back falls with
the square of the range. The angle does not change that reach; `grazing_rad` stands for its part.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hil.devices.lidar_errors import LidarErrors
from hil.devices.lidar_light import Surface
from hil.terrain.field import Field
from hil.terrain.mesh import soil_height
from onboard.records import F64, Grid

ROCK_STREAM = 4  # of the scenario's seed
ABOVE_M = 0.002  # a hit so far over the soil, in a rock's disc, is on the rock
I32 = NDArray[np.int32]


class Surfaces:
    """A field as light meets it. dark: which of its rocks are; the same for a seed whatever becomes of the soil."""

    def __init__(self, field: Field, errors: LidarErrors, seed: int) -> None:
        self.field, self._errors = field, errors
        self._far_m = errors.applied().far_m
        z = field.soil_z.astype(np.float64)
        slope_y, slope_x = np.gradient(z, field.grid.cell_m)
        self._slope_x, self._slope_y = slope_x.astype(np.float32), slope_y.astype(np.float32)
        rocks = field.rocks
        self._rocks = np.array([(*rock.vertices_m.mean(axis=0), rock.diameter_m / 2) for rock in rocks], np.float64)
        self._rocks = self._rocks.reshape(-1, 4)  # centre x, y, z and radius
        self._rock_at = _rock_raster(field.grid, self._rocks)
        self.dark = np.random.default_rng((seed, ROCK_STREAM)).random(len(rocks)) < errors.dark_rocks_ratio
        self._rock_reach_m = self._far_m * np.sqrt(np.where(self.dark, errors.dark_albedo, errors.rock_albedo))

    def met(self, origins_m: F64, directions: F64, ranges_m: F64) -> Surface:
        """By rays (n, 3) in the map frame and their ranges (n,), inf where nothing is met (there it means nothing)."""
        errors, grid = self._errors, self.field.grid
        points = origins_m + np.where(np.isfinite(ranges_m), ranges_m, 0.0)[:, None] * directions
        x, y = points[:, 0], points[:, 1]
        i = np.clip(np.rint((x - grid.x0_m) / grid.cell_m).astype(np.intp), 0, grid.columns - 1)
        j = np.clip(np.rint((y - grid.y0_m) / grid.cell_m).astype(np.intp), 0, grid.rows - 1)
        along, across = self._slope_x[j, i].astype(np.float64), self._slope_y[j, i].astype(np.float64)
        into = directions[:, 0] * along + directions[:, 1] * across - directions[:, 2]
        sine = into / np.sqrt(1.0 + along * along + across * across)
        reach_m = np.full(len(x), self._far_m * math.sqrt(errors.ground_albedo))
        self._meet_rocks(self._rock_at[j, i], points, directions, sine, reach_m)
        for px, py, radius in errors.dark_patches_m:
            dark = (x - px) ** 2 + (y - py) ** 2 <= radius * radius
            reach_m[dark] = self._far_m * math.sqrt(errors.dark_albedo)
        azimuth_rad = np.arctan2(directions[:, 1], directions[:, 0]) if errors.sun_ratio else None
        return Surface(np.arcsin(np.clip(sine, 0.0, 1.0)), reach_m, azimuth_rad)

    def _meet_rocks(self, rock: I32, points: F64, directions: F64, sine: F64, reach_m: F64) -> None:
        """Sine and reach of the beams that meet a rock, where they stand."""
        near = np.flatnonzero(rock >= 0)
        if not len(near):
            return
        rows = self._rocks[rock[near]]
        out = points[near] - rows[:, :3]
        soil_m = soil_height(self.field.grid, self.field.soil_z, points[near, 0], points[near, 1])
        inside = out[:, 0] ** 2 + out[:, 1] ** 2 <= rows[:, 3] ** 2
        on = inside & (points[near, 2] > soil_m + ABOVE_M)
        at, out = near[on], out[on]
        sine[at] = -(directions[at] * out).sum(axis=1) / np.maximum(np.sqrt((out * out).sum(axis=1)), 1e-9)
        reach_m[at] = self._rock_reach_m[rock[at]]


def asked(errors: LidarErrors) -> bool:
    """Whether these errors depend on what the beams meet."""
    dark = min(errors.ground_albedo, errors.rock_albedo) < 1 or errors.dark_rocks_ratio or errors.dark_patches_m
    return bool(errors.grazing_rad or errors.sun_ratio or dark)


def _rock_raster(grid: Grid, rocks: F64) -> I32:
    """The rock whose disc may cover a point nearest to each node, (rows, columns); -1: none. The nearest by centre."""
    raster, best = np.full((grid.rows, grid.columns), -1, np.int32), np.full((grid.rows, grid.columns), np.inf)
    for number, (x, y, _, radius) in enumerate(rocks.tolist()):
        reach = radius + grid.cell_m
        i0, i1 = ((v - grid.x0_m) / grid.cell_m for v in (x - reach, x + reach))
        j0, j1 = ((v - grid.y0_m) / grid.cell_m for v in (y - reach, y + reach))
        columns = slice(max(0, math.floor(i0)), max(0, math.ceil(i1) + 1))
        rows = slice(max(0, math.floor(j0)), max(0, math.ceil(j1) + 1))
        near, part = best[rows, columns], raster[rows, columns]
        if not near.size:
            continue
        xs = grid.x0_m + np.arange(columns.start, columns.start + near.shape[1]) * grid.cell_m - x
        ys = grid.y0_m + np.arange(rows.start, rows.start + near.shape[0]) * grid.cell_m - y
        away = np.hypot(xs[None, :], ys[:, None]) - radius
        closer = (away <= grid.cell_m) & (away < near)
        near[closer], part[closer] = away[closer], number
    return raster
