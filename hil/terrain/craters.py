r"""Simple craters on top of the soil: a bowl, a raised rim, ejecta that thin out.

    rim height h  _                         _
           ______/ \                       / \______     z = h - d (1 - (r / R)^2)   within the rim, R = D / 2
                    \__                 __/              z = h (R / r)^3             outside, to 10 R
                       \____ depth ____/                 depth d, from rim to floor

Depth and rim height are Pike's for fresh lunar craters under 15 km (Impact and Explosion Cratering, 1977, p. 489; D in
km there): d = 0.196 D^1.010, h = 0.036 D^1.014. Diameters of a few metres are an extrapolation: d = 0.18 D. The rim
decays with the cube of the distance as ejecta do (McGetchin et al., Earth Planet. Sci. Lett. 20 (1973) 226; Melosh,
Impact Cratering, 1989). In a worn crater depth and rim have lost the same share, `wear`: 0 fresh, 1 gone.

Sizes follow N(>= D) = per_m2 (D / 1 m)^-slope for each square metre. Small lunar craters are in a steady state of slope
2 with a few per cent (Minton et al., Icarus 326 (2019) 63) of geometric saturation, 1.54 D^-2 (Gault, Radio Science 5
(1970) 273). The default is 5 %. Their wear is uniformly distributed, as for craters that form and fade at a steady
rate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hil.terrain.rock_sizes import check_sizes, even_shares, power
from onboard.native import each
from onboard.records import F64, Grid

REACH = 10.0  # radii; a thousandth of the rim's height is left there
SATURATION = 1.54


@dataclass(frozen=True, slots=True)
class Crater:
    """One crater.

    x_m, y_m: centre
    diameter_m: rim to rim
    wear: lost share of its depth, 0 to 1
    """

    x_m: float
    y_m: float
    diameter_m: float
    wear: float = 0.0


@dataclass(frozen=True, slots=True)
class CraterLaw:
    """Law of sizes N(>= D) = per_m2 (D / 1 m)^-slope between two diameters; wear is uniform in 0 .. most_worn."""

    per_m2: float = 0.05 * SATURATION
    slope: float = 2.0
    smallest_m: float = 1.0
    largest_m: float = 6.0
    most_worn: float = 1.0

    def __post_init__(self) -> None:
        check_sizes(self.smallest_m, self.largest_m)
        if not (self.per_m2 > 0 and self.slope > 0 and 0 <= self.most_worn <= 1):
            raise ValueError(f"per_m2 and slope should be positive, most_worn 0 to 1, found {self}")

    def number_per_m2(self, diameter_m: F64 | float) -> F64 | float:
        """Number of craters of this diameter or larger on a square metre, without an upper limit."""
        return self.per_m2 * power(diameter_m, -self.slope)

    def diameters_m(self, area_m2: float, rng: np.random.Generator) -> F64:
        """Diameters of the craters on an area by the law, largest first, one from each of equally probable parts."""
        largest = self.number_per_m2(self.largest_m)
        number = self.number_per_m2(self.smallest_m) - largest
        shares = even_shares(number * area_m2, rng)
        return np.asarray(power((largest + shares * number) / self.per_m2, -1 / self.slope))


def depth_m(diameter_m: F64 | float) -> F64 | float:
    """Depth of a fresh crater from rim to floor (Pike 1977)."""
    return 196.0 * power(diameter_m / 1000, 1.010)


def rim_height_m(diameter_m: F64 | float) -> F64 | float:
    """Height of a fresh crater's rim above the surrounding ground (Pike 1977)."""
    return 36.0 * power(diameter_m / 1000, 1.014)


def profile_m(diameter_m: float, distance_m: F64, wear: float = 0.0) -> F64:
    """Height that a crater adds to the ground at distances from its centre, any shape of array (see the module head).

    Continuous at the rim. Beyond REACH radii it is 0, a step of a thousandth of the rim's height.
    """
    rim, depth = rim_height_m(diameter_m), depth_m(diameter_m)
    r = np.asarray(distance_m) / (diameter_m / 2)
    beyond = np.maximum(r, 1.0)
    outside = np.where(r < REACH, rim / (beyond * beyond * beyond), 0.0)
    return (1 - wear) * np.where(r < 1, rim - depth * (1 - r * r), outside)


def draw_craters(grid: Grid, law: CraterLaw, rng: np.random.Generator) -> tuple[Crater, ...]:
    """Craters with centres on the grid or up to the largest diameter outside it: its borders are like the rest."""
    margin = law.largest_m
    width, height = grid.columns * grid.cell_m + 2 * margin, grid.rows * grid.cell_m + 2 * margin
    diameters = law.diameters_m(width * height, rng)
    x = grid.x0_m - grid.cell_m / 2 - margin + width * rng.random(len(diameters))
    y = grid.y0_m - grid.cell_m / 2 - margin + height * rng.random(len(diameters))
    wear = law.most_worn * rng.random(len(diameters))
    return tuple(Crater(*row) for row in np.stack([x, y, diameters, wear], 1).tolist())


def crater_relief(grid: Grid, craters: tuple[Crater, ...]) -> F64:
    """Heights that craters add to a grid, (rows, columns). Where craters overlap, their profiles add up."""
    relief = np.zeros((grid.rows, grid.columns))
    x, y = grid.x0_m + np.arange(grid.columns) * grid.cell_m, grid.y0_m + np.arange(grid.rows) * grid.cell_m
    for crater in craters:
        reach = REACH * crater.diameter_m / 2
        columns = slice(*np.searchsorted(x, (crater.x_m - reach, crater.x_m + reach)))
        rows = slice(*np.searchsorted(y, (crater.y_m - reach, crater.y_m + reach)))
        distance = each.hypot(x[columns] - crater.x_m, (y[rows] - crater.y_m)[:, None])
        relief[rows, columns] += profile_m(crater.diameter_m, distance, crater.wear)
    return relief
