"""Rays cast by Intel's Embree, if its package is installed (`pip install .[fast]`).

Embree computes in single precision: the field is first moved to its middle, and the range to the triangle that Embree
returns is computed to the triangle's plane in double precision.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hil.plant.rays.check import check_rays
from hil.terrain.field import Field
from hil.terrain.mesh import field_triangles
from onboard.config import ConfigError
from onboard.records import F64


class EmbreeRays:
    """Caster on one field by Embree. Raises ConfigError if the package is not installed."""

    def __init__(self, field: Field) -> None:
        try:
            from embreex.mesh_construction import TriangleMesh
            from embreex.rtcore_scene import EmbreeScene
        except ImportError:
            raise ConfigError("rays by embree need its package: pip install .[fast]") from None
        corners = field_triangles(field.grid, field.soil_z, [rock.vertices_m[rock.triangles] for rock in field.rocks])
        self._middle_m = (corners.min(axis=(0, 1)) + corners.max(axis=(0, 1))) / 2
        self._corner = corners[:, 0]
        self._normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        self._scene = EmbreeScene()
        TriangleMesh(self._scene, (corners - self._middle_m).astype(np.float32))

    def cast(self, origins_m: F64, directions: F64, range_m: float) -> F64:
        """See hil.plant.rays.casters.RayCaster."""
        check_rays(origins_m, directions)
        found = self._scene.run(
            (origins_m - self._middle_m).astype(np.float32),
            directions.astype(np.float32),
            np.full(len(directions), np.nextafter(np.float32(range_m), np.float32(np.inf))),
            output=True,
        )
        (hit,) = np.nonzero(found["primID"] >= 0)
        ranges_m = np.full(len(directions), np.inf)
        ranges_m[hit] = self._planes(found["primID"][hit], origins_m[hit], directions[hit])
        return np.where(ranges_m <= range_m, ranges_m, np.inf)

    def _planes(self, triangles: NDArray[np.integer], origins_m: F64, directions: F64) -> F64:
        """Ranges (n,) along rays to the planes of triangles (n,)."""
        normal = self._normal[triangles]
        away_m = ((self._corner[triangles] - origins_m) * normal).sum(axis=1)
        return np.asarray(away_m / (directions * normal).sum(axis=1))
