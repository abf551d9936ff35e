"""Grounds built to a plan on gentle soil: a given obstacle at the same place for every seed.

    slope      12 degrees up, all the way          ridge     1 m high across the route, gentle, hides the goal
    dead_end   a U of walls, open to the start     pocket    the same with a baffle that hides half of its end
    ring       a closed wall round the goal        boulders  Golombek rocks, k = 0.12
    liar       the orbiter's map is upside down and shows a wall where there is none

Seen from above, start S, goal G, x ahead:

       dead_end  +------|        pocket  +------|        ring     ___
     S           :      |  G   S         :   :  |  G   S         ( G )
                 +------|                +---+--|                 ---
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hil.own_functions import generator
from hil.terrain.field import Field
from hil.terrain.recipe import Course, Recipe, Relief, compose
from hil.terrain.rock_sizes import Golombek, PowerLaw, RockLaw
from onboard.native import each, elementary
from onboard.records import F64

SLOPE_DEG = 12.0
RIDGE_AT_M, RIDGE_HIGH_M, RIDGE_WIDE_M = 7.0, 1.0, 2.4  # steepest slope: 14 degrees
WALL_HIGH_M, WALL_THICK_M = 0.6, 0.3
U_FROM_M, U_TO_M, U_WIDE_M, BAFFLE_AT_M, BAFFLE_TO_M = 6.0, 11.0, 5.0, 8.5, 0.3
RING_GOAL_M, RING_M = 11.0, 1.8
FEW = PowerLaw(0.004)
LIE_AT_M, LIE_HIGH_M = 8.0, 3.0


def _slope(x_m: F64, y_m: F64) -> F64:
    return elementary.tan(math.radians(SLOPE_DEG)) * x_m + 0.0 * y_m


def _ridge(x_m: F64, y_m: F64) -> F64:
    return RIDGE_HIGH_M * each.exp(-0.5 * np.square((x_m - RIDGE_AT_M) / RIDGE_WIDE_M)) + 0.0 * y_m


def _dead_end(x_m: F64, y_m: F64) -> F64:
    return WALL_HIGH_M * _in_u(x_m, y_m)


def _pocket(x_m: F64, y_m: F64) -> F64:
    baffle = _near(x_m, BAFFLE_AT_M) & (y_m > -U_WIDE_M / 2) & (y_m < BAFFLE_TO_M)
    return WALL_HIGH_M * (_in_u(x_m, y_m) | baffle)


def _ring(x_m: F64, y_m: F64) -> F64:
    return WALL_HIGH_M * _near(each.hypot(x_m - RING_GOAL_M, y_m), RING_M)


def _in_u(x_m: F64, y_m: F64) -> NDArray[np.bool_]:
    half_m = WALL_THICK_M / 2
    within = (x_m > U_FROM_M) & (x_m < U_TO_M + half_m) & (np.abs(y_m) < U_WIDE_M / 2 + half_m)
    return within & (_near(np.abs(y_m), U_WIDE_M / 2) | _near(x_m, U_TO_M))


def _near(value_m: F64, wall_m: float) -> NDArray[np.bool_]:
    return np.abs(value_m - wall_m) <= WALL_THICK_M / 2


def gentle(seed: int, relief: Relief | None = None, rocks: RockLaw = FEW, away_m: float = 15.0) -> Field:
    """Ground with a median slope of 2.5 degrees before the relief, goal straight ahead."""
    recipe = Recipe(0.8, median_slope_deg=2.5, rocks=rocks, relief=relief)
    return compose(recipe, Course(away_m=away_m), generator([seed, 80]), seed)


def liar(seed: int) -> Field:
    """Gentle ground with a wrong orbital map."""
    field = gentle(seed)
    grid, heights_m = field.gdem.grid, -field.gdem.heights_m
    heights_m[:, grid.cell(LIE_AT_M, 0.0)[1]] += LIE_HIGH_M
    return replace(field, gdem=replace(field.gdem, heights_m=heights_m, note="a map that lies"))


BUILT: Mapping[str, Callable[[int], Field]] = {
    "slope": lambda seed: gentle(seed, _slope),
    "ridge": lambda seed: gentle(seed, _ridge),
    "dead_end": lambda seed: gentle(seed, _dead_end),
    "pocket": lambda seed: gentle(seed, _pocket),
    "ring": lambda seed: gentle(seed, _ring, away_m=RING_GOAL_M),
    "boulders": lambda seed: gentle(seed, rocks=Golombek(0.12)),
    "liar": liar,
}
