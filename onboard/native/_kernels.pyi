import numpy as np
from numpy.typing import NDArray

from onboard.records import F32, F64, I32, U8

def sin(x: float) -> float: ...
def cos(x: float) -> float: ...
def tan(x: float) -> float: ...
def asin(x: float) -> float: ...
def acos(x: float) -> float: ...
def exp(x: float) -> float: ...
def log(x: float) -> float: ...
def atan2(y: float, x: float) -> float: ...
def hypot(x: float, y: float) -> float: ...
def sin_into(numbers: F64, to: F64) -> None: ...
def cos_into(numbers: F64, to: F64) -> None: ...
def tan_into(numbers: F64, to: F64) -> None: ...
def asin_into(numbers: F64, to: F64) -> None: ...
def acos_into(numbers: F64, to: F64) -> None: ...
def exp_into(numbers: F64, to: F64) -> None: ...
def log_into(numbers: F64, to: F64) -> None: ...
def atan2_into(y: F64, x: F64, to: F64) -> None: ...
def product_into(a: F64, b: F64, to: F64) -> None: ...
def solve_into(a: F64, b: F64) -> bool: ...
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
    z_hi2: F32,
    z_lo2: F32,
    sum_sigma: F32,
    z_ray: F32,
    view_m: F32,
) -> None: ...
def keep_witnessed_into(ranges_m: F32, seen: U8, tolerance_m: float, kept: U8) -> None: ...
def no_hits_into(cells: U8) -> None: ...
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
    unit_m: float,
    width: int,
    seeds: NDArray[np.int64],
    seed_costs_m: F32,
    cost: F32,
) -> None: ...
def visibility_total_into(
    dj: I32,
    di: I32,
    inverse_pm: F32,
    share: I32,
    height_m: F32,
    veil: F32 | None,
    target: I32 | None,
    eye_m: float,
    where: U8 | None,
    first: I32 | None,
    width: int,
    heading_width: int,
    seen: I32,
    in_range: I32,
    fresh: I32 | None,
    heading: I32 | None,
    done: NDArray[np.int64],
    cancel: U8,
) -> bool: ...
def visibility_scalar_into(
    dj: I32,
    di: I32,
    inverse_pm: F32,
    share: I32,
    height_m: F32,
    veil: F32 | None,
    target: I32 | None,
    eye_m: float,
    where: U8 | None,
    first: I32 | None,
    width: int,
    heading_width: int,
    seen: I32,
    in_range: I32,
    fresh: I32 | None,
    heading: I32 | None,
    done: NDArray[np.int64],
    cancel: U8,
) -> bool: ...
def view_from_into(
    dj: I32,
    di: I32,
    inverse_pm: F32,
    share: I32,
    height_m: F32,
    veil: F32 | None,
    node: int,
    eye_m: float,
    first: int,
    width: int,
    seen: U8,
) -> tuple[int, int]: ...
def repeat_first_beam(
    dj: I32, di: I32, inverse_pm: F32, share: I32, height_m: F32, eye_m: float, times: int
) -> tuple[int, int]: ...
def distance_into(
    free: U8,
    goals: U8,
    closeness: F32 | None,
    cell_m: float,
    dearest: float,
    progress: NDArray[np.int64],
    cancel: U8,
    cost: F64,
) -> bool: ...
def sight_price_m(
    free: U8,
    closeness: F32 | None,
    x0_m: float,
    y0_m: float,
    cell_m: float,
    ax_m: float,
    ay_m: float,
    bx_m: float,
    by_m: float,
    spacing_m: float,
    orientation: int,
) -> float: ...
def classify_into(
    fill_cells: int,
    rules_m: F64,
    spread: F64,
    n: I32,
    sum_z: F64,
    z_hi: F32,
    z_lo: F32,
    sum_sigma: F32,
    z_ray: F32,
    assumed_z: F32,
    cell_class: U8,
    z_mean: F32,
    z_top: F32,
    z_bot: F32,
) -> None: ...
def pose_freedom_into(
    cell_class: U8,
    z_mean: F32,
    z_top: F32,
    z_bot: F32,
    z_ray: F32,
    wheels: I32,
    body: I32,
    reach: int,
    half: int,
    least_cells: float,
    level_m: float,
    step_m: float,
    steepest_per_cell_m: float,
    tilt_ratio: float,
    slope_ratio: float,
    belly_m: float,
    cell_m: float,
    freedom: U8,
) -> None: ...
def closeness_into(freedom: U8, falloff: F32, reach: int, touching: float, ratio: F32) -> None: ...
def reachable_into(freedom: U8, free: int, j: int, i: int, o: int, reached: U8) -> None: ...
def simd_width() -> int: ...

GLOBAL_CHUNK_NODES: int
GLOBAL_BUCKETS: int

def global_layers_into(
    heights_m: F32, cell_m: float, raw: bool, edges_m: F32, done: NDArray[np.int64], cancel: U8
) -> bool: ...
def global_edges_into(
    heights_m: F32, cell_m: float, prices: F32, edges_m: F32, done: NDArray[np.int64], cancel: U8
) -> bool: ...
def global_seeds_fit(seeds: NDArray[np.int64], seed_costs_m: F64, nodes: int) -> bool: ...
def global_cost_to_go_into(
    edges_m: F32,
    shortest_m: float,
    seeds: NDArray[np.int64],
    seed_costs_m: F64,
    words: F64,
    chunks: I32,
    done: NDArray[np.int64],
    cancel: U8,
    cost_m: F32,
    next_node: I32,
) -> bool: ...
def scip_values_into(frame: U8, at: int, characters: int, values: NDArray[np.int64]) -> bool: ...
def scip_beams_into(values: NDArray[np.int64], stride: int, status_of: U8, ranges_m: F32, status: U8) -> None: ...
