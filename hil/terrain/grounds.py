"""TABLE of the grounds that a scenario can name: each row returns the n-th accepted field."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from hil.own_functions import generator
from hil.terrain.built_grounds import BUILT
from hil.terrain.field import Field
from hil.terrain.fields import AcceptedField, crater_field, demo_field
from hil.terrain.real_ground import real_field
from hil.terrain.rock_sizes import PowerLaw
from hil.terrain.rocks import scatter_rocks
from onboard.native import elementary
from onboard.records import Gdem, Grid, Pose

_CELL_M, _SIDE_M = 0.05, 12.0
_COUNT = round(_SIDE_M / _CELL_M)
YARD_LEAN_RAD, YARD_CLEAR_M = math.radians(1.5), 2.1


def flat_field(seed_index: int) -> AcceptedField:
    """12 m x 12 m of flat soil without rocks, goal 5 m ahead: for tests that do not concern the ground."""
    grid = Grid(-3.0 + _CELL_M / 2, -_SIDE_M / 2 + _CELL_M / 2, _CELL_M, _COUNT, _COUNT)
    gdem = Gdem(Grid(-19.0, -19.0, 2.0, 20, 20), np.zeros((20, 20), np.float32), "flat ground")
    stats = {"median_slope_deg": 0.0, "p95_slope_deg": 0.0, "rock_area_ratio": 0.0, "rocks": 0.0}
    soil_z = np.zeros((_COUNT, _COUNT), np.float32)
    field = Field(grid, soil_z, (), Pose(0.0, 0.0), (5.0, 0.5), gdem, seed_index, stats)
    return AcceptedField(field, seed_index, ())


def yard_field(seed_index: int) -> AcceptedField:
    """Yard for calibration: 12 m x 12 m with a slope of 1.5 degrees and rocks around a free area.

    The free area lies to the left, for a driven square of 1.5 m.
    """
    flat = flat_field(seed_index).field
    grid, rng = flat.grid, generator([seed_index, 0xCA1])
    towards, lean = rng.uniform(0.0, math.tau), elementary.tan(YARD_LEAN_RAD)
    x, y = (first + flat.grid.cell_m * np.arange(_COUNT) for first in (grid.x0_m, grid.y0_m))
    soil_z = (lean * (elementary.cos(towards) * x[None, :] + elementary.sin(towards) * y[:, None])).astype(np.float32)
    rocks = scatter_rocks(grid, soil_z, PowerLaw(0.05, 0.25, 0.8), ((0.75, 0.75, YARD_CLEAR_M),), rng)
    return AcceptedField(replace(flat, soil_z=soil_z, rocks=rocks), seed_index, ())


def _as_built(make: Callable[[int], Field]) -> Callable[[int], AcceptedField]:
    """Wrap a maker of fields without rejection: a built ground is accepted as it is."""
    return lambda seed_index: AcceptedField(make(seed_index), seed_index, ())


GROUNDS: Mapping[str, Callable[[int], AcceptedField]] = {
    "fbm": demo_field,
    "craters": crater_field,
    "real": real_field,
    "flat": flat_field,
    "yard": yard_field,
    **{name: _as_built(make) for name, make in BUILT.items()},
}
