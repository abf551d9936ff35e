"""Rays cast by the physics engine, on its own bodies (hil.plant.ground_bodies makes them).

Engine traps that shape this file: exactly 16,384 rays in a call return nothing without a word, more are refused, and a
ray costs a look at every triangle its box covers. So rays go in pieces, and only between where ground can be.
"""

from __future__ import annotations

import numpy as np

from hil.plant.engine import ROCK, SOIL, pybullet
from hil.rays.check import check_rays
from hil.terrain.field import Field
from onboard.records import F64

RAYS_PER_CALL = 8192
MARGIN_M = 0.01


class EngineRays:
    """Rays on the soil and rocks of an engine client, which holds the bodies of `field`."""

    def __init__(self, field: Field, client: int) -> None:
        grid = field.grid
        far_m = grid.centre(grid.rows - 1, grid.columns - 1)
        soil = (grid.x0_m, grid.y0_m, float(field.soil_z.min())), (*far_m, float(field.soil_z.max()))
        corners = np.concatenate([soil, *(rock.vertices_m for rock in field.rocks)])
        self._low, self._high = corners.min(axis=0) - MARGIN_M, corners.max(axis=0) + MARGIN_M
        self._client = client

    def cast(self, origins_m: F64, directions: F64, range_m: float) -> F64:
        """As hil.rays.casters.RayCaster says."""
        check_rays(origins_m, directions)
        near_m, far_m = self._within(origins_m, directions, range_m)
        ranges_m = np.full(len(directions), np.inf)
        (meets,) = np.nonzero(near_m < far_m)
        for k in range(0, len(meets), RAYS_PER_CALL):
            some = meets[k : k + RAYS_PER_CALL]
            start, length = near_m[some], far_m[some] - near_m[some]
            rays = pybullet.rayTestBatch(
                origins_m[some] + start[:, None] * directions[some],
                origins_m[some] + far_m[some, None] * directions[some],
                collisionFilterMask=SOIL | ROCK,
                physicsClientId=self._client,
            )
            ranges_m[some] = start + length * [ray[2] if ray[0] >= 0 else np.inf for ray in rays]
        return ranges_m

    def _within(self, origins_m: F64, directions: F64, range_m: float) -> tuple[F64, F64]:
        """Where each ray enters and leaves the box of all ground."""
        with np.errstate(divide="ignore", invalid="ignore"):
            one, other = (self._low - origins_m) / directions, (self._high - origins_m) / directions
        near_m, far_m = np.fmin(one, other), np.fmax(one, other)  # a ray along a side of the box: its NaN is no border
        return np.fmax.reduce(near_m, axis=1, initial=0.0), np.fmin.reduce(far_m, axis=1, initial=range_m)
