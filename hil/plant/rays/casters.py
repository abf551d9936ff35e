"""Rays on a field's triangles behind one interface, and the TABLE of the ray casters.

All use the same triangles (hil.terrain.mesh), so a name of the table changes speed and rounding, not the world:

    kernel   ground_rays.py: ours, double, exact to rounding. The default: fastest, no dependency, no limit of rays
    engine   engine_rays.py: pybullet's, on the bodies that wheels and hull touch
    embree   embree_rays.py: Intel's, single precision; a package of its own (`pip install .[fast]`)
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

from hil.terrain.field import Field
from onboard.records import F64

DEFAULT = "kernel"


class RayCaster(Protocol):
    """Caster of rays on one field. A field that changes needs a new caster."""

    def cast(self, origins_m: F64, directions: F64, range_m: float) -> F64:
        """Ranges (n,) float64 of rays from origins (n, 3) along unit directions (n, 3), map frame.

        inf where nothing is met in range; the rover itself is not seen. ValueError if the two differ in shape.
        """
        ...


def _kernel(field: Field, _client: int) -> RayCaster:
    from hil.plant.rays.ground_rays import GroundRays

    return GroundRays(field)


def _engine(field: Field, client: int) -> RayCaster:
    from hil.plant.rays.engine_rays import EngineRays

    return EngineRays(field, client)


def _embree(field: Field, _client: int) -> RayCaster:
    from hil.plant.rays.embree_rays import EmbreeRays

    return EmbreeRays(field)


CASTERS: Mapping[str, Callable[[Field, int], RayCaster]] = {"kernel": _kernel, "engine": _engine, "embree": _embree}


def ray_caster(name: str, field: Field, client: int) -> RayCaster:
    """Ray caster of a row; `client` contains the field's bodies. ValueError for another name or a missing package."""
    if name not in CASTERS:
        raise ValueError(f"rays {name!r} should be one of {', '.join(CASTERS)}")
    return CASTERS[name](field, client)
