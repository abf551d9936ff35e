"""Ground from a recipe: fractal soil, craters, rocks, in one call.

    field = compose(Recipe(hurst=0.8, median_slope_deg=5.0, craters=CraterLaw(), rocks=Golombek(0.05)), Course(), rng)

The soil is cut from the middle of a tile twice as wide, whose borders would repeat; the orbital map is the whole tile
in cells of 2 m, with craters and without rocks.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hil.terrain.craters import CraterLaw, crater_relief, draw_craters
from hil.terrain.field import Field, field_stats
from hil.terrain.fractal import fractal_heights
from hil.terrain.mesh import block_mean, slopes_deg
from hil.terrain.rock_sizes import RockLaw
from hil.terrain.rocks import scatter_rocks
from onboard.native import elementary
from onboard.records import F64, Gdem, Grid, Pose

Relief = Callable[[F64, F64], F64]
CELL_M, SIDE_M, TILE_M, GDEM_CELL_M = 0.05, 20.0, 40.0, 2.0
START_FROM_EDGE_M, GOAL_AWAY_M = 2.5, 15.0
START_CLEAR_M, GOAL_CLEAR_M = 1.2, 0.6


@dataclass(frozen=True, slots=True)
class Recipe:
    """Parameters of the ground. The soil's height is set by `sigma` or by its median slope: give one.

    hurst: Hurst exponent H, between 0 and 1
    sigma: amplitude, m^(1 - H)
    median_slope_deg: median slope
    craters, rocks: laws of their sizes, or None for none
    relief: heights by x (1, columns) and y (rows, 1) of the map, m, on top of the soil and under the rocks
    """

    hurst: float
    sigma: float | None = None
    median_slope_deg: float | None = None
    craters: CraterLaw | None = None
    rocks: RockLaw | None = None
    relief: Relief | None = None

    def __post_init__(self) -> None:
        if not 0 < self.hurst < 1:
            raise ValueError(f"hurst should be over 0 and under 1, found {self.hurst}")
        if (self.sigma is None) == (self.median_slope_deg is None):
            raise ValueError(f"give sigma or median_slope_deg, found {self.sigma} and {self.median_slope_deg}")


@dataclass(frozen=True, slots=True)
class Course:
    """Start and goal on a field of 20 m x 20 m. The start is the map's origin, 2.5 m from the west side.

    south_m: distance from the south side to the start
    bearing_rad, away_m: bearing and distance of the goal
    """

    south_m: float = 10.0
    bearing_rad: float = 0.0
    away_m: float = GOAL_AWAY_M

    @property
    def goal_m(self) -> tuple[float, float]:
        """x, y of the goal."""
        return self.away_m * elementary.cos(self.bearing_rad), self.away_m * elementary.sin(self.bearing_rad)


def compose(recipe: Recipe, course: Course, rng: np.random.Generator, seed: int = 0) -> Field:
    """Field of a recipe; the same state of `rng` gives the same bytes. `seed` is only stored in the field."""
    margin, nodes = (TILE_M - SIDE_M) / 2, round(SIDE_M / CELL_M)
    inset = round(margin / CELL_M)
    window = (slice(inset, inset + nodes),) * 2
    west_m, south_m = -START_FROM_EDGE_M, -course.south_m
    grid = Grid(west_m + CELL_M / 2, south_m + CELL_M / 2, CELL_M, nodes, nodes)
    tile = _soil(recipe, window, rng)
    whole = Grid(grid.x0_m - margin, grid.y0_m - margin, CELL_M, *tile.shape)
    craters = ()
    if recipe.relief is not None:
        tile += recipe.relief(*_places(whole))
    if recipe.craters is not None:
        craters = draw_craters(whole, recipe.craters, rng)
        tile += crater_relief(whole, craters)
    tile -= tile[window][grid.cell(0.0, 0.0)]
    soil = tile[window].astype(np.float32)
    clear = ((0.0, 0.0, START_CLEAR_M), (*course.goal_m, GOAL_CLEAR_M))
    rocks = () if recipe.rocks is None else scatter_rocks(grid, soil, recipe.rocks, clear, rng)
    start = Pose(0.0, 0.0, yaw_rad=course.bearing_rad)
    stats = field_stats(grid, soil, rocks, recipe.hurst)
    if craters:
        stats["craters"] = len(craters)
    return Field(grid, soil, rocks, start, course.goal_m, _gdem(tile, west_m - margin, south_m - margin), seed, stats)


def _soil(recipe: Recipe, window: tuple[slice, slice], rng: np.random.Generator) -> F64:
    """Tile of fBm, scaled to the recipe; a median slope is that of the window."""
    sigma = 1.0 if recipe.sigma is None else recipe.sigma
    tile = fractal_heights(round(TILE_M / CELL_M), CELL_M, recipe.hurst, sigma, rng)
    if recipe.median_slope_deg is not None:
        found_deg = float(np.median(slopes_deg(tile[window], CELL_M)))
        tile *= elementary.tan(math.radians(recipe.median_slope_deg)) / elementary.tan(math.radians(found_deg))
    return tile


def _places(grid: Grid) -> tuple[F64, F64]:
    """x (1, columns) and y (rows, 1) of the nodes."""
    return (
        (grid.x0_m + grid.cell_m * np.arange(grid.columns))[None, :],
        (grid.y0_m + grid.cell_m * np.arange(grid.rows))[:, None],
    )


def _gdem(tile: F64, west_m: float, south_m: float) -> Gdem:
    """Whole tile in cells of 2 m whose borders are multiples of 2 m."""
    first_x, first_y = (math.ceil(edge / GDEM_CELL_M - 1e-9) * GDEM_CELL_M for edge in (west_m, south_m))
    i, j = round((first_x - west_m) / CELL_M), round((first_y - south_m) / CELL_M)
    heights = block_mean(tile[j:, i:], round(GDEM_CELL_M / CELL_M)).astype(np.float32)
    half = GDEM_CELL_M / 2
    grid = Grid(first_x + half, first_y + half, GDEM_CELL_M, *heights.shape)
    return Gdem(grid, heights, "fractal ground in 2 m cells, no rocks")
