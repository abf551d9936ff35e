"""Surfaces that the scanner's beams meet on a field: angle of incidence, and range up to which they return light.

Input of lidar_light.py.

    hit point -> inside a rock's disc and above the soil?  rock: albedo, normal of the sphere it was cut from
                 else soil: albedo, normal of the slope over two cells
                 within a dark patch: the dark albedo, for soil and rock

The slope over two cells (0.1 to 0.2 m) is that of a beam's footprint, which is longer than a triangle of the mesh; a
rock's facets are not distinguished. A surface of albedo a is seen up to far_m * sqrt(a): the returned light falls with
the square of the range. The angle does not change that range; `grazing_rad` models its effect.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hil.devices.lidar.errors import LidarErrors
from hil.devices.lidar.light import Surface
from hil.own_functions import generator
from hil.terrain.field import Field
from hil.terrain.mesh import soil_height
from onboard.native import each
from onboard.records import F32, F64, Grid

ROCK_STREAM = 4  # stream of the scenario's seed
ABOVE_M = 0.002  # a hit that is higher above the soil, in a rock's disc, is on the rock
I32 = NDArray[np.int32]


class Surfaces:
    """Optical properties of a field.

    dark: which rocks are dark; fixed for a seed, whatever happens to the soil
    """

    def __init__(self, field: Field, errors: LidarErrors, seed: int) -> None:
        self.field, self._errors = field, errors
        self._far_m = errors.applied().far_m
        self._soil_z = field.soil_z.astype(np.float64)
        self._normals = _normals(self._soil_z, field.grid.cell_m)
        rocks = field.rocks
        self._rocks = np.array([(*rock.vertices_m.mean(axis=0), rock.diameter_m / 2) for rock in rocks], np.float64)
        self._rocks = self._rocks.reshape(-1, 4)  # centre x, y, z and radius
        self._rock_at = _rock_raster(field.grid, self._rocks)
        self.dark = generator((seed, ROCK_STREAM)).random(len(rocks)) < errors.dark_rocks_ratio
        self._rock_reach_m = self._far_m * np.sqrt(np.where(self.dark, errors.dark_albedo, errors.rock_albedo))

    def met(self, origins_m: F64, directions: F64, ranges_m: F64) -> Surface:
        """Surface met by rays (n, 3), map frame, with ranges (n,).

        A range of inf means no surface; its values have no meaning.
        """
        errors, grid = self._errors, self.field.grid
        sine, reach_m = np.ones(len(ranges_m)), np.full(len(ranges_m), np.inf)
        hit = np.flatnonzero(ranges_m < np.inf)
        ways = directions[hit]
        points = origins_m[hit] + ranges_m[hit, None] * ways
        i, j = (
            _nearest(points[:, k], first_m, grid.cell_m, count)
            for k, first_m, count in ((0, grid.x0_m, grid.columns), (1, grid.y0_m, grid.rows))
        )
        met_sine = -inner(ways, self._normals[j, i].astype(np.float64))
        met_reach_m = np.full(len(hit), self._far_m * math.sqrt(errors.ground_albedo))
        self._meet_rocks(self._rock_at[j, i], points, ways, met_sine, met_reach_m)
        for x_m, y_m, radius_m in errors.dark_patches_m:
            dark = np.square(points[:, 0] - x_m) + np.square(points[:, 1] - y_m) <= radius_m * radius_m
            met_reach_m[dark] = self._far_m * math.sqrt(errors.dark_albedo)
        sine[hit], reach_m[hit] = met_sine, met_reach_m
        azimuth_rad = each.atan2(directions[:, 1], directions[:, 0]) if errors.sun_ratio else None
        return Surface(sine, reach_m, azimuth_rad)

    def _meet_rocks(self, rock: I32, points: F64, ways: F64, sine: F64, reach_m: F64) -> None:
        """Set sine and reach of the hits that are on a rock."""
        near = np.flatnonzero(rock >= 0)
        if not len(near):
            return
        rows, places = self._rocks[rock[near]], points[near]
        out = places - rows[:, :3]
        soil_m = soil_height(self.field.grid, self._soil_z, places[:, 0], places[:, 1])
        inside = np.square(out[:, 0]) + np.square(out[:, 1]) <= np.square(rows[:, 3])
        on = np.flatnonzero(inside & (places[:, 2] > soil_m + ABOVE_M))
        at, out = near[on], out[on]
        sine[at] = -inner(ways[at], out) / np.maximum(np.sqrt(inner(out, out)), 1e-9)
        reach_m[at] = self._rock_reach_m[rock[at]]


def inner(a: F64, b: F64) -> F64:
    """Inner products of vectors (n, 3) with vectors (n, 3), as (n,)."""
    return np.asarray(a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2])


def asked(errors: LidarErrors) -> bool:
    """True if these errors depend on the surfaces that the beams meet."""
    dark = min(errors.ground_albedo, errors.rock_albedo) < 1 or errors.dark_rocks_ratio or errors.dark_patches_m
    return bool(errors.grazing_rad or errors.sun_ratio or dark)


def _normals(soil_z: F64, cell_m: float) -> F32:
    """Unit normals of the slopes over two cells, (rows, columns, 3)."""
    slope_y, slope_x = np.gradient(soil_z, cell_m)
    length = np.sqrt(1.0 + slope_x * slope_x + slope_y * slope_y)
    return np.dstack((-slope_x / length, -slope_y / length, 1.0 / length)).astype(np.float32)


def _nearest(at_m: F64, first_m: float, cell_m: float, count: int) -> NDArray[np.intp]:
    """Number of the node nearest to each coordinate, clipped to the field."""
    return np.minimum(np.maximum(np.rint((at_m - first_m) / cell_m), 0.0), count - 1.0).astype(np.intp)


def _rock_raster(grid: Grid, rocks: F64) -> I32:
    """Rock whose disc may cover a point nearest to each node, (rows, columns); -1 for none.

    Of several the one whose disc is nearest.
    """
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
        away = each.hypot(xs[None, :], ys[:, None]) - radius
        closer = (away <= grid.cell_m) & (away < near)
        near[closer], part[closer] = away[closer], number
    return raster
