"""Real ground for TERRAIN=real: a measured elevation grid, scaled to a rover's size, with detail below its resolution.

The grid is matplotlib's sample data (the Jacksboro fault, Tennessee, 344 x 403 heights in metres on cells of about 74 m
x 93 m; read as a file, matplotlib is not imported). Its cells become 10 m x 10 m, heights shrink by 10 / 84 * 0.6. The
shape of the land is real; fractal detail shorter than 20 m and rocks are drawn by the seed. The rover's orbital map is
the whole scaled grid without them.

A field is a window of 60 m x 60 m in 0.1 m cells, start 10 m from its west side, goal 40 m away to the east. Windows
are drawn among those whose land is gentle (median slope of the grid's cells at most 4 degrees); of the windows of a
seed the first is taken that passes the rules of hil.terrain.fields.
"""

from __future__ import annotations

import importlib.util
import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from hil.own_functions import generator, give_to
from hil.terrain.field import Field, field_stats
from hil.terrain.fields import AcceptedField, first_accepted
from hil.terrain.fractal import fractal_heights
from hil.terrain.mesh import slopes_deg
from hil.terrain.recipe import GOAL_CLEAR_M, START_CLEAR_M
from hil.terrain.rock_sizes import PowerLaw
from hil.terrain.rocks import scatter_rocks
from onboard.native import elementary
from onboard.records import Gdem, Grid, Pose

F64 = NDArray[np.float64]
FILE = Path("mpl-data") / "sample_data" / "jacksboro_fault_dem.npz"
DEM_CELL_M, HEIGHT_RATIO = 10.0, 10 / 84 * 0.6
CELL_M, SIDE_M, GOAL_AWAY_M, DETAIL_LONGEST_M = 0.1, 60.0, 40.0, 20.0
GENTLE_DEG = 4.0
GDEM_CELLS = 25
NOTE = (
    "Jacksboro fault elevation grid (matplotlib sample data), cells of 74 m x 93 m scaled to 10 m, heights by 0.0714; "
    "500 m x 500 m around the start"
)


def real_field(seed_index: int) -> AcceptedField:
    """Field of `make demo TERRAIN=real SEED=seed_index`. Raises ValueError if no window passes."""
    heights = scaled_heights()
    return first_accepted(seed_index, lambda seed: make_field(heights, seed))


def scaled_heights() -> F64:
    """Whole grid, row 0 in the south, heights in metres after scaling. Raises FileNotFoundError without the sample."""
    package = importlib.util.find_spec("matplotlib")
    if package is None or package.origin is None:
        raise FileNotFoundError("TERRAIN=real reads a sample file of the package matplotlib, which is not installed")
    path = Path(package.origin).parent / FILE
    with np.load(path) as file:
        return np.flipud(file["elevation"]).astype(np.float64) * HEIGHT_RATIO


def make_field(heights: F64, seed: int) -> Field:
    """Window of a seed, accepted or not. The start lies on a corner of four cells of the grid: the map's origin."""
    rng = generator([seed, 60])
    corner_j, corner_i = _gentle_corner(heights, rng)
    median_deg, hurst, ratio = rng.uniform(4.0, 5.5), rng.uniform(0.75, 0.9), rng.uniform(0.026, 0.04)
    bearing = math.radians(rng.uniform(-15, 15))
    goal = (GOAL_AWAY_M * elementary.cos(bearing), GOAL_AWAY_M * elementary.sin(bearing))
    nodes = round(SIDE_M / CELL_M)
    grid = Grid(-DEM_CELL_M + CELL_M / 2, -SIDE_M / 2 + CELL_M / 2, CELL_M, nodes, nodes)

    x, y = grid.x0_m + np.arange(nodes) * CELL_M, grid.y0_m + np.arange(nodes) * CELL_M
    at = np.meshgrid(corner_j - 0.5 + y / DEM_CELL_M, corner_i - 0.5 + x / DEM_CELL_M, indexing="ij")
    give_to("scipy.ndimage._nd_image")
    land = ndimage.map_coordinates(heights, at, order=3)
    detail = fractal_heights(2 * nodes, CELL_M, hurst, 1.0, rng, DETAIL_LONGEST_M)[:nodes, :nodes]
    found_deg = float(np.median(slopes_deg(detail, CELL_M)))
    detail *= elementary.tan(math.radians(median_deg)) / elementary.tan(math.radians(found_deg))
    ground = land + detail
    level = ground[grid.cell(0.0, 0.0)]
    soil = (ground - level).astype(np.float32)
    rocks = scatter_rocks(grid, soil, PowerLaw(ratio), ((0.0, 0.0, START_CLEAR_M), (*goal, GOAL_CLEAR_M)), rng)
    stats = field_stats(grid, soil, rocks, hurst) | {"land_relief_m": float(np.ptp(land))}
    start = Pose(0.0, 0.0, yaw_rad=bearing)
    return Field(grid, soil, rocks, start, goal, _gdem(heights - level, corner_j, corner_i), seed, stats)


def _gdem(heights: F64, corner_j: int, corner_i: int) -> Gdem:
    """Orbital map: GDEM_CELLS to each side of the corner, or to the border of the grid."""
    low_j, low_i = max(0, corner_j - GDEM_CELLS), max(0, corner_i - GDEM_CELLS)
    part = heights[low_j : corner_j + GDEM_CELLS, low_i : corner_i + GDEM_CELLS].astype(np.float32)
    x0_m, y0_m = (0.5 - corner_i + low_i) * DEM_CELL_M, (0.5 - corner_j + low_j) * DEM_CELL_M
    return Gdem(Grid(x0_m, y0_m, DEM_CELL_M, *part.shape), part, NOTE)


def _gentle_corner(heights: F64, rng: np.random.Generator) -> tuple[int, int]:
    """Corner (row, column) of the grid with gentle land from 10 m west to 50 m east of it and 30 m to each side."""
    slopes = slopes_deg(heights, DEM_CELL_M)  # of cells 1 .. n - 2
    while True:
        j, i = (int(rng.integers(8, side - 8)) for side in heights.shape)
        if np.median(slopes[j - 4 : j + 2, i - 2 : i + 4]) <= GENTLE_DEG:
            return j, i
