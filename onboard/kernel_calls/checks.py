"""Argument checks for kernel calls: a wrong array raises a ValueError that states the error."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import DTypeLike

from onboard.records import Grid


def check_array(name: str, array: object, shape: tuple[int | None, ...], dtype: DTypeLike) -> None:
    """Raise ValueError unless `array` is contiguous and aligned, of `dtype` and of `shape` (None: any length)."""
    if not isinstance(array, np.ndarray):
        raise ValueError(f"{name}: expected an array {_wanted(shape, dtype)}, given {type(array).__name__}")
    if array.dtype != dtype or len(array.shape) != len(shape) or not all(map(_fits, shape, array.shape)):
        raise ValueError(f"{name}: expected {_wanted(shape, dtype)}, given {array.dtype} {array.shape}")
    flags = array.flags
    if not flags.c_contiguous:
        raise ValueError(f"{name}: expected contiguous rows (numpy.ascontiguousarray), given strides {array.strides}")
    if not flags.aligned:
        raise ValueError(f"{name}: expected memory aligned for {array.dtype} (a copy is), given an odd address")


def check_grid(grid: Grid) -> None:
    """Raise ValueError unless `grid` has at least one cell, a cell size > 0 and finite numbers."""
    x_m, y_m, cell_m = grid.x0_m, grid.y0_m, grid.cell_m
    if not (grid.rows > 0 and grid.columns > 0 and cell_m > 0 and math.isfinite(x_m + y_m + cell_m)):
        raise ValueError(f"grid: expected a cell > 0, finite numbers and at least one cell, given {grid}")


def _fits(wanted: int | None, given: int) -> bool:
    return wanted is None or wanted == given


def _wanted(shape: tuple[int | None, ...], dtype: DTypeLike) -> str:
    return f"{np.dtype(dtype)} ({', '.join('any' if n is None else str(n) for n in shape)})"
