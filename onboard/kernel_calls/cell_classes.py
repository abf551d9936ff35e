"""Interface of the cell class kernel: statistics of map cells to classes and de-biased heights."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from onboard.kernel_calls.checks import check_array
from onboard.native.variant import kernels
from onboard.records import F32, F64, U8, Ldem

_LAYERS = {"n": np.int32, "sum_z": np.float64, "z_hi": np.float32, "z_lo": np.float32, "sum_sigma": np.float32,
           "z_ray": np.float32, "assumed_z": np.float32}  # fmt: skip


class Rules(NamedTuple):
    """Parameters of perception.map.cell_classes, in metres but the first, a number of cells."""

    fill_cells: int
    ray_margin_m: float
    fill_above_m: float
    hole_depth_m: float
    fill_step_m: float
    fill_step_per_cell_m: float


class Classes(NamedTuple):
    """Result layers, all (rows, columns); the names and meanings are those of records.Surface."""

    cell_class: U8
    z_mean: F32
    z_top: F32
    z_bot: F32


def classify(ldem: Ldem, rules: Rules, spread: F64) -> Classes:
    """Compute classes and heights of each cell of `ldem`; `10-navigation` section 3.

    spread: (counts,) float64, distance of the bounds of n hits from their mean by noise alone, in sigmas; the last
        entry is for all larger n.

    Raises ValueError for layers of wrong shape, dtype or layout, rules that are not finite or below 0, and a spread
    that is empty or not finite.
    """
    shape = ldem.n.shape if isinstance(ldem.n, np.ndarray) and ldem.n.ndim == 2 else (None, None)
    for name, dtype in _LAYERS.items():
        check_array(name, getattr(ldem, name), shape, dtype)
    if not (np.isfinite(rules).all() and min(rules) >= 0):
        raise ValueError(f"rules: expected finite numbers >= 0, given {rules}")
    check_array("spread", spread, (None,), np.float64)
    if not (len(spread) and np.isfinite(spread).all()):
        raise ValueError(f"spread: expected finite numbers, one at least, given {spread}")
    made = Classes(np.empty(shape, np.uint8), *(np.empty(shape, np.float32) for _ in range(3)))
    kernels.classify_into(
        min(rules.fill_cells, max(ldem.n.shape)),
        np.array(rules[1:], np.float64),
        spread,
        ldem.n,
        ldem.sum_z,
        ldem.z_hi,
        ldem.z_lo,
        ldem.sum_sigma,
        ldem.z_ray,
        ldem.assumed_z,
        *made,
    )
    return made
