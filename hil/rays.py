"""Rays on a field's triangles behind one interface, and the TABLE of those that cast them.

All see the same triangles (hil.mesh), so a name of the table changes speed and rounding, not the world:

    kernel   hil.ground_rays: ours, double, exact to rounding. The default: fastest, needs nothing, has no limit of rays
    engine   hil.engine_rays: pybullet's, on the bodies that wheels and hull touch
    embree   hil.embree_rays: Intel's, single precision; a package of its own (`pip install .[fast]`)
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

from hil.terrain import Field
from onboard.records import F64

DEFAULT = "kernel"


class RayCaster(Protocol):
    """A field to cast rays on. A field that changes gets a new one."""

    def cast(self, origins_m: F64, directions: F64, range_m: float) -> F64:
        """Ranges (n,) float64 of rays from origins (n, 3) along unit directions (n, 3), map frame.

        inf where nothing is met in range; the rover itself is not seen. ValueError where the two are not of one shape.
        """
        ...


def check_rays(origins_m: F64, directions: F64) -> None:
    """Raises ValueError where origins and directions are not of one shape (n, 3)."""
    if origins_m.shape != directions.shape or origins_m.ndim != 2 or origins_m.shape[1] != 3:
        raise ValueError(f"origins_m, directions: expected (n, 3) both, given {origins_m.shape}, {directions.shape}")


def _kernel(field: Field, _client: int) -> RayCaster:
    from hil.ground_rays import GroundRays

    return GroundRays(field)


def _engine(field: Field, client: int) -> RayCaster:
    from hil.engine_rays import EngineRays

    return EngineRays(field, client)


def _embree(field: Field, _client: int) -> RayCaster:
    from hil.embree_rays import EmbreeRays

    return EmbreeRays(field)


CASTERS: Mapping[str, Callable[[Field, int], RayCaster]] = {"kernel": _kernel, "engine": _engine, "embree": _embree}


def ray_caster(name: str, field: Field, client: int) -> RayCaster:
    """The caster of a row; `client` holds the field's bodies. ValueError for another name or a missing package."""
    if name not in CASTERS:
        raise ValueError(f"rays {name!r} should be one of {', '.join(CASTERS)}")
    return CASTERS[name](field, client)
