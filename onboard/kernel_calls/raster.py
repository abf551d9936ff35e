"""Interface of the rasteriser: beams of one stop to statistics of map cells."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from onboard.kernel_calls.checks import check_array, check_grid
from onboard.native.variant import kernels
from onboard.records import F32, F64, I32, Cloud, Grid


class Raster(NamedTuple):
    """Statistics of one cloud's beams, all (rows, columns); the names and meanings are those of records.Ldem.

    z_hi2, z_lo2: the second highest and second lowest hit; the hit itself if there is only one.
    """

    n: I32
    sum_z: F64
    sum_z2: F64
    z_hi: F32
    z_lo: F32
    z_hi2: F32
    z_lo2: F32
    sum_sigma: F32
    z_ray: F32
    view_m: F32


def rasterise(grid: Grid, cloud: Cloud) -> Raster:
    """Trace each beam of `cloud` over `grid` from the scanner to its end; `10-navigation` section 3.

    A hit counts in its cell: n, heights, sigma_z = sigma_range * |sin(elevation)|, least horizontal distance. All other
    crossed cells (for a beam without a hit its end's cell too) store the least height of a crossing at entry or exit:
    z_ray. Beams with an end that is not finite are left out. Raises ValueError for wrong shapes, dtypes or layout.
    """
    check_array("cloud.origin_m", cloud.origin_m, (3,), np.float64)
    check_array("cloud.ends_m", cloud.ends_m, (None, 3), np.float32)
    check_array("cloud.hit", cloud.hit, (len(cloud.ends_m),), np.bool_)
    if not np.isfinite(cloud.origin_m).all():
        raise ValueError(f"cloud.origin_m: expected finite coordinates, given {cloud.origin_m}")
    check_grid(grid)
    shape = (grid.rows, grid.columns)
    raster = Raster(
        n=np.zeros(shape, np.int32),
        sum_z=np.zeros(shape),
        sum_z2=np.zeros(shape),
        z_hi=np.full(shape, np.nan, np.float32),
        z_lo=np.full(shape, np.nan, np.float32),
        z_hi2=np.full(shape, np.nan, np.float32),
        z_lo2=np.full(shape, np.nan, np.float32),
        sum_sigma=np.zeros(shape, np.float32),
        z_ray=np.full(shape, np.inf, np.float32),
        view_m=np.full(shape, np.inf, np.float32),
    )
    kernels.rasterise_into(
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
