"""Height deviation product: 1 sigma of the heights of each cell's hits, in steps of a factor of sqrt(2).

A cell's level is one byte: 0 for an unknown deviation, k for 1 mm * sqrt(2)^(k - 1) on; zstandard compresses them. The
decoded value is at most 19 % off (a factor of 2^0.25), from 1 mm to 46 m; smaller ones decode as 1 mm.
"""

from __future__ import annotations

import math
import struct
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from protocol.products.ldem import MapGrid, checked_grid
from protocol.products.packing import check, compress, expand

HEIGHT_STD_CODEC = "height-std-1"
LEAST_M, MOST_LEVEL = 1e-3, 32
_STEPS = np.sqrt(np.ldexp(1.0, np.arange(MOST_LEVEL)))  # of levels 1 and up, in LEAST_M: sqrt(2)^k to the bit
_BETWEEN = _STEPS[:-1] * math.sqrt(math.sqrt(2.0))  # thresholds between two levels
_HEAD = struct.Struct("<4sHHdddI")
_MAGIC = b"STD1"

F32 = NDArray[np.float32]


class HeightStd(NamedTuple):
    """Height deviations of a map.

    grid: the map's grid.
    std_m: (rows, columns) float32, m, NaN where unknown.
    """

    grid: MapGrid
    std_m: F32


def encode_height_std(product: HeightStd) -> bytes:
    """Encode the product. Raises ValueError if the shape is not the grid's."""
    grid = product.grid
    if product.std_m.shape != (grid.rows, grid.columns) or product.std_m.size == 0:
        raise ValueError(f"deviations {product.std_m.shape} for a grid of {(grid.rows, grid.columns)}")
    known = np.isfinite(product.std_m)
    std_m = np.where(known, np.maximum(product.std_m, LEAST_M), LEAST_M).astype(np.float64)
    level = 1 + np.searchsorted(_BETWEEN, std_m / LEAST_M)
    packed = compress(np.where(known, level, 0).astype(np.uint8).tobytes())
    head = _HEAD.pack(_MAGIC, grid.rows, grid.columns, grid.x0_m, grid.y0_m, grid.cell_m, len(packed))
    return head + packed


def decode_height_std(data: bytes) -> HeightStd:
    """Decode the product. Raises WireError("product") if it is malformed."""
    check(len(data) >= _HEAD.size, f"{len(data)} B are no deviations")
    magic, rows, columns, x0_m, y0_m, cell_m, size = _HEAD.unpack_from(data)
    check(magic == _MAGIC and len(data) == _HEAD.size + size, f"{magic!r}, {len(data)} B")
    grid = checked_grid(x0_m, y0_m, cell_m, rows, columns)
    level = expand(data[_HEAD.size :], rows * columns).reshape(rows, columns)
    check(int(level.max()) <= MOST_LEVEL, f"a level of {int(level.max())}")
    std_m = np.where(level > 0, LEAST_M * _STEPS[np.maximum(level, 1) - 1], np.nan).astype(np.float32)
    return HeightStd(grid, std_m)
