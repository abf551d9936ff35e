"""Interface of the pose field kernel: least costs over (8 orientations, rows, columns)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from onboard.kernel_calls.checks import check_array
from onboard.native.variant import kernels
from onboard.records import F32, U8

LARGEST_FIELD = 2**31 - 1  # states of a pose field: links are int32
FINEST = 2.0**21  # units in the cheapest edge: its cost is rounded by less than 1e-6 of it
DEAREST = 2.0**28  # most units in the most expensive edge
WIDTH = 6.0  # width of a band, in cheapest edges: best measured with and without closeness
MOST_BANDS = 16.0  # most bands that an edge spans


def cost_to_go(
    freedom: U8,
    least_freedom: int,
    seeds: tuple[NDArray[np.int64], F32],
    moves_m: F32,
    turn_m: float,
    closeness: F32 | None,
) -> F32:
    """Least cost from each pose to a seed, float32 (8, rows, columns), +inf if there is no path.

    freedom: uint8 (8, rows, columns), passable from `least_freedom` on.
    seeds: int64 (k,) flat indices of poses and float32 (k,) remaining cost from each, >= 0; a seed that is not passable
        is ignored.
    moves_m: float32 (8 orientations, 8 directions of k * 45 degrees), costs > 0.
    turn_m: cost of a turn to the next orientation, > 0.
    closeness: float32 like freedom, >= 0, or None; an edge's cost is multiplied by 1 + its mean at both ends.

    Costs are rounded to 2^-21 of the cheapest edge, or to 2^-28 of the most expensive if that is more. Raises
    ValueError for wrong shapes, dtypes, layout, seeds off the field or costs that are not above 0.
    """
    places, costs_m = seeds
    _check_field(freedom, places, costs_m, closeness)
    check_array("moves_m", moves_m, (8, 8), np.float32)
    cheapest, dearest = min(float(moves_m.min()), turn_m), max(float(moves_m.max()), turn_m)
    if not (cheapest > 0 and np.isfinite(dearest) and np.isfinite(turn_m)):  # min and max ignore a NaN
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
