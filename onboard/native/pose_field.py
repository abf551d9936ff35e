"""The door to the pose field: least prices over (8 orientations, rows, columns)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from onboard.native.checks import check_array
from onboard.native.variant import kernels
from onboard.records import F32, U8

LARGEST_FIELD = 2**31 - 1  # states of a pose field: links are int32
FINEST = 2.0**21  # units in the cheapest edge: its price is rounded by less than 1e-6 of it
DEAREST = 2.0**28  # units in the dearest edge at most
WIDTH = 6.0  # of a band, in cheapest edges: measured best with closeness and without
MOST_BANDS = 16.0  # that an edge reaches over


def cost_to_go(
    freedom: U8,
    least_freedom: int,
    seeds: tuple[NDArray[np.int64], F32],
    moves_m: F32,
    turn_m: float,
    closeness: F32 | None,
) -> F32:
    """Least price from every pose to a seed, float32 (8, rows, columns), +inf where there is no way.

    freedom: uint8 (8, rows, columns), passable from `least_freedom` on. seeds: int64 (k,) flat indices of poses and
    float32 (k,) what is left to go from each, >= 0; one that is not passable counts for nothing. moves_m: float32
    (8 orientations, 8 directions of k * 45 degrees) and turn_m: prices > 0. closeness: float32 like freedom, >= 0, or
    None; an edge's price is multiplied by 1 + its mean at both ends. Prices are rounded to 2^-21 of the cheapest edge,
    or to 2^-28 of the dearest where that is more. Raises ValueError for wrong shapes, dtypes, layout, seeds off the
    field or prices that are not above 0.
    """
    places, costs_m = seeds
    _check_field(freedom, places, costs_m, closeness)
    check_array("moves_m", moves_m, (8, 8), np.float32)
    cheapest, dearest = min(float(moves_m.min()), turn_m), max(float(moves_m.max()), turn_m)
    if not (cheapest > 0 and np.isfinite(dearest) and np.isfinite(turn_m)):  # min and max let a NaN pass
        raise ValueError(f"moves_m, turn_m: expected finite prices above 0, given {cheapest} to {dearest}")
    if closeness is not None:
        dearest *= 1.0 + float(closeness.max(initial=0.0))
    unit_m = max(cheapest / FINEST, dearest / DEAREST)
    rising = np.argsort(costs_m, kind="stable")
    cost = np.empty(freedom.shape, np.float32)
    kernels.cost_to_go_into(
        freedom,
        least_freedom,
        closeness,
        moves_m,
        turn_m,
        unit_m,
        math.ceil(max(WIDTH * cheapest, dearest / MOST_BANDS) / unit_m),
        places[rising],
        costs_m[rising],
        cost,
    )
    return cost


def _check_field(freedom: U8, places: NDArray[np.int64], costs_m: F32, closeness: F32 | None) -> None:
    check_array("freedom", freedom, (8, None, None), np.uint8)
    if freedom.size > LARGEST_FIELD:
        raise ValueError(f"freedom: expected at most {LARGEST_FIELD} poses, given {freedom.size}")
    check_array("seeds", places, (None,), np.int64)
    check_array("seed costs", costs_m, (len(places),), np.float32)
    if len(places) and not (places.min() >= 0 and places.max() < freedom.size):
        raise ValueError(f"seeds: expected 0 to {freedom.size - 1}, given {places.min()} to {places.max()}")
    if len(places) and not (costs_m.min() >= 0 and np.isfinite(costs_m.max())):
        raise ValueError(f"seed costs: expected finite costs >= 0, given {costs_m.min()} to {costs_m.max()}")
    if closeness is None:
        return
    check_array("closeness", closeness, freedom.shape, np.float32)
    if closeness.size and not (closeness.min() >= 0 and np.isfinite(closeness.max())):
        raise ValueError(f"closeness: expected finite ratios >= 0, given {closeness.min()} to {closeness.max()}")
