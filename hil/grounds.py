"""TABLE of the grounds a scenario can name: each gives the n-th accepted field."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from hil.built_grounds import BUILT
from hil.fields import Accepted, crater_field, demo_field
from hil.real_ground import real_field
from hil.terrain import Field
from onboard.records import Gdem, Grid, Pose

_CELL_M, _SIDE_M = 0.05, 12.0


def flat_field(seed_index: int) -> Accepted:
    """12 m x 12 m of flat soil without rocks, goal 5 m ahead: for tests of everything but the ground."""
    count = round(_SIDE_M / _CELL_M)
    grid = Grid(-3.0 + _CELL_M / 2, -_SIDE_M / 2 + _CELL_M / 2, _CELL_M, count, count)
    gdem = Gdem(Grid(-19.0, -19.0, 2.0, 20, 20), np.zeros((20, 20), np.float32), "flat ground")
    stats = {"median_slope_deg": 0.0, "p95_slope_deg": 0.0, "rock_area_ratio": 0.0, "rocks": 0.0}
    soil_z = np.zeros((count, count), np.float32)
    field = Field(grid, soil_z, (), Pose(0.0, 0.0), (5.0, 0.5), gdem, seed_index, stats)
    return Accepted(field, seed_index, ())


def _as_built(make: Callable[[int], Field]) -> Callable[[int], Accepted]:
    """None is passed over: a plan that is there for what it is."""
    return lambda seed_index: Accepted(make(seed_index), seed_index, ())


GROUNDS: Mapping[str, Callable[[int], Accepted]] = {
    "fbm": demo_field, "craters": crater_field, "real": real_field, "flat": flat_field,
    **{name: _as_built(make) for name, make in BUILT.items()},
}
