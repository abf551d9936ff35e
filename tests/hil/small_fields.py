"""Small grounds for the tests of plant and rays."""

import math

import numpy as np

from hil.terrain.field import Field
from hil.terrain.fractal import fractal_heights
from hil.terrain.mesh import slopes_deg
from hil.terrain.rock_sizes import PowerLaw
from hil.terrain.rocks import scatter_rocks
from onboard.records import Gdem, Grid, Pose

CELL_M = 0.05


def field_of(soil_z, cell_m=CELL_M, rocks=()):
    """A field round the origin; the start is the origin."""
    rows, columns = soil_z.shape
    grid = Grid(-(columns / 2 - 0.5) * cell_m, -(rows / 2 - 0.5) * cell_m, cell_m, rows, columns)
    return Field(grid, soil_z.astype(np.float32), tuple(rocks), Pose(0, 0), (2, 0), Gdem(grid, soil_z), 0, {})


def plane(slope_deg=0.0, along="x", side=160):
    """A plane that rises along x or y, 8 m wide."""
    x = (np.arange(side) - side / 2 + 0.5) * CELL_M * math.tan(math.radians(slope_deg))
    return field_of(np.broadcast_to(x[None, :] if along == "x" else x[:, None], (side, side)).copy())


def rough(seed, median_deg=6.0, side=160, ratio=0.04, lift_m=0.0):
    """fBm with rocks; no rock within 0.8 m of the origin."""
    rng = np.random.default_rng(seed)
    z = fractal_heights(2 * side, CELL_M, 0.8, 1.0, rng)[:side, :side]
    z *= math.tan(math.radians(median_deg)) / math.tan(math.radians(np.median(slopes_deg(z, CELL_M))))
    bare = field_of(z - z[side // 2, side // 2] + lift_m)
    return field_of(bare.soil_z, rocks=scatter_rocks(bare.grid, bare.soil_z, PowerLaw(ratio), ((0, 0, 0.8),), rng))
