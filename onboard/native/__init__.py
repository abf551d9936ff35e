"""The door to the native kernels: shapes, dtypes and memory layout are checked here, the work runs without the GIL.

A ValueError names the argument, what is expected and what was given. `_kernels` itself checks nothing.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from onboard.native import _kernels
from onboard.records import F32, F64, I32, U8, Cloud, Grid

LARGEST_FIELD = 2**31 - 1  # states of a pose field: links are int32
MOST_BUCKETS = 4096.0


class Raster(NamedTuple):
    """Statistics of one cloud's beams, all (rows, columns); the names and meanings are those of records.Ldem."""

    n: I32
    sum_z: F64
    sum_z2: F64
    z_hi: F32
    z_lo: F32
    sum_sigma: F32
    z_ray: F32
    view_m: F32


def rasterise(grid: Grid, cloud: Cloud) -> Raster:
    """Every beam of `cloud` walked over `grid` from the scanner to its end; `10-navigation` section 3.

    A hit counts in its cell: n, heights, sigma_z = sigma_range * |sin(elevation)|, least horizontal distance. All other
    crossed cells (for a beam without a hit its end's cell too) keep the least height of a crossing at entry or exit:
    z_ray. Beams with an end that is not finite are left out. Raises ValueError for wrong shapes, dtypes or layout.
    """
    _check("cloud.origin_m", cloud.origin_m, (3,), np.float64)
    _check("cloud.ends_m", cloud.ends_m, (None, 3), np.float32)
    _check("cloud.hit", cloud.hit, (len(cloud.ends_m),), np.bool_)
    if not np.isfinite(cloud.origin_m).all():
        raise ValueError(f"cloud.origin_m: expected finite coordinates, given {cloud.origin_m}")
    if not (grid.cell_m > 0 and grid.rows > 0 and grid.columns > 0):
        raise ValueError(f"grid: expected a cell > 0 and at least one cell, given {grid}")
    shape = (grid.rows, grid.columns)
    raster = Raster(
        n=np.zeros(shape, np.int32),
        sum_z=np.zeros(shape),
        sum_z2=np.zeros(shape),
        z_hi=np.full(shape, np.nan, np.float32),
        z_lo=np.full(shape, np.nan, np.float32),
        sum_sigma=np.zeros(shape, np.float32),
        z_ray=np.full(shape, np.inf, np.float32),
        view_m=np.full(shape, np.inf, np.float32),
    )
    _kernels.rasterise_into(
        grid.x0_m,
        grid.y0_m,
        grid.cell_m,
        cloud.origin_m,
        cloud.ends_m,
        cloud.hit.view(np.uint8),
        cloud.sigma_range_m,
        *raster,
    )
    return raster


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
    None; an edge's price is multiplied by 1 + its mean at both ends. Raises ValueError for wrong shapes, dtypes,
    layout, seeds off the field or prices that are not above 0.
    """
    places, costs_m = seeds
    _check_field(freedom, places, costs_m, closeness)
    _check("moves_m", moves_m, (8, 8), np.float32)
    cheapest, dearest = min(float(moves_m.min()), turn_m), max(float(moves_m.max()), turn_m)
    if not (cheapest > 0 and np.isfinite(dearest)):
        raise ValueError(f"moves_m, turn_m: expected finite prices above 0, given {cheapest} to {dearest}")
    if closeness is not None:
        dearest *= 1.0 + float(closeness.max(initial=0.0))
    rising = np.argsort(costs_m, kind="stable")
    cost = np.empty(freedom.shape, np.float32)
    _kernels.cost_to_go_into(
        freedom,
        least_freedom,
        closeness,
        moves_m,
        turn_m,
        max(cheapest, dearest / MOST_BUCKETS),
        dearest,
        places[rising],
        costs_m[rising],
        cost,
    )
    return cost


def _check_field(freedom: U8, places: NDArray[np.int64], costs_m: F32, closeness: F32 | None) -> None:
    _check("freedom", freedom, (8, None, None), np.uint8)
    if freedom.size > LARGEST_FIELD:
        raise ValueError(f"freedom: expected at most {LARGEST_FIELD} poses, given {freedom.size}")
    _check("seeds", places, (None,), np.int64)
    _check("seed costs", costs_m, (len(places),), np.float32)
    if len(places) and not (places.min() >= 0 and places.max() < freedom.size):
        raise ValueError(f"seeds: expected 0 to {freedom.size - 1}, given {places.min()} to {places.max()}")
    if len(places) and not (costs_m.min() >= 0 and np.isfinite(costs_m.max())):
        raise ValueError(f"seed costs: expected finite costs >= 0, given {costs_m.min()} to {costs_m.max()}")
    if closeness is None:
        return
    _check("closeness", closeness, freedom.shape, np.float32)
    if closeness.size and not (closeness.min() >= 0 and np.isfinite(closeness.max())):
        raise ValueError(f"closeness: expected finite ratios >= 0, given {closeness.min()} to {closeness.max()}")


def _check(name: str, array: object, shape: tuple[int | None, ...], dtype: DTypeLike) -> None:
    wanted = f"{np.dtype(dtype)} ({', '.join('any' if n is None else str(n) for n in shape)})"
    if not isinstance(array, np.ndarray):
        raise ValueError(f"{name}: expected an array {wanted}, given {type(array).__name__}")
    fits = array.ndim == len(shape) and all(n is None or n == m for n, m in zip(shape, array.shape))
    if array.dtype != np.dtype(dtype) or not fits:
        raise ValueError(f"{name}: expected {wanted}, given {array.dtype} {array.shape}")
    if not array.flags.c_contiguous:
        raise ValueError(f"{name}: expected contiguous rows (numpy.ascontiguousarray), given strides {array.strides}")
