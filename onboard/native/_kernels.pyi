import numpy as np
from numpy.typing import NDArray

from onboard.records import F32, F64, I32, U8

def rasterise_into(
    x0_m: float,
    y0_m: float,
    cell_m: float,
    origin_m: F64,
    ends_m: F32,
    hit: U8,
    sigma_range_m: float,
    n: I32,
    sum_z: F64,
    sum_z2: F64,
    z_hi: F32,
    z_lo: F32,
    sum_sigma: F32,
    z_ray: F32,
    view_m: F32,
) -> None: ...
def points_into(x0_m: float, y0_m: float, cell_m: float, points_m: F32, cells: U8) -> None: ...
def turn_into(
    x0_m: float,
    y0_m: float,
    cell_m: float,
    ranges_m: F32,
    azimuths: F64,
    tilts: F64,
    longest_m: float,
    scanner_m: F64,
    hull_m: F64,
    T_map_base: F64,
    cells: U8,
) -> None: ...
def cost_to_go_into(
    freedom: U8,
    least_freedom: int,
    closeness: F32 | None,
    moves_m: F32,
    turn_m: float,
    width_m: float,
    dearest_m: float,
    seeds: NDArray[np.int64],
    seed_costs_m: F32,
    cost: F32,
) -> None: ...
def simd_width() -> int: ...
