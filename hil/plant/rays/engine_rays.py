"""Rays cast by the physics engine, on its own bodies (made by hil.plant.ground_bodies).

Engine traps that shape this file: a call with exactly 16,384 rays returns no hits and no error, larger ones are
refused, and a ray tests every triangle that its box covers. So rays are cast in batches, and only inside the box of all
ground.
"""

from __future__ import annotations

import numpy as np

from hil.plant.engine import ROCK, SOIL, pybullet
from hil.plant.rays.check import check_rays
from hil.terrain.field import Field
from onboard.records import F64

RAYS_PER_CALL = 8192
MARGIN_M = 0.01


class EngineRays:
    """Caster on the soil and rocks of an engine client, which contains the bodies of `field`."""

    def __init__(self, field: Field, client: int) -> None:
        grid = field.grid
        far_m = grid.centre(grid.rows - 1, grid.columns - 1)
        soil = (grid.x0_m, grid.y0_m, float(field.soil_z.min())), (*far_m, float(field.soil_z.max()))
        corners = np.concatenate([soil, *(rock.vertices_m for rock in field.rocks)])
        self._low, self._high = corners.min(axis=0) - MARGIN_M, corners.max(axis=0) + MARGIN_M
        self._client = client

    def cast(self, origins_m: F64, directions: F64, range_m: float) -> F64:
        """See hil.plant.rays.casters.RayCaster."""
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
        """Ranges at which each ray enters and leaves the box of all ground."""
        with np.errstate(divide="ignore", invalid="ignore"):
            one, other = (self._low - origins_m) / directions, (self._high - origins_m) / directions
        near_m, far_m = np.fmin(one, other), np.fmax(one, other)  # a ray along a side of the box: its NaN is no limit
        return np.fmax.reduce(near_m, axis=1, initial=0.0), np.fmin.reduce(far_m, axis=1, initial=range_m)
