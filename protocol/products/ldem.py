"""Map product: heights and node sets of a grid in few bytes, the same bits on both sides.

Heights become integers by an explicit step and offset, integers become residuals of the MED predictor
(`prediction`), residuals become byte planes, and zstandard compresses them. A bit mask marks the cells with a height.
The planner's pose map (`pose_map`) may follow the map's bytes.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from protocol import WireError
from protocol.products.packing import check, compress, expand, fold, from_planes, planes_of, to_planes, unfold, within
from protocol.products.pose_map import MAGIC as POSES_MAGIC
from protocol.products.pose_map import MOST_PLACE_M, PoseMap, decode_poses
from protocol.products.prediction import integers, median_edge, residuals

LDEM_CODEC = "ldem-2"  # 1: without the section of poses
STEP_M = 0.00199  # at most 0.995 mm off, float32 rounding included at most 1 mm
_HEAD = struct.Struct("<4sHHdddddBIII")
_MAGIC = b"LDM1"
_MAX_CELLS = 4_000_000
MOST_HEIGHT_M = 1e5
_LEAST_CELL_M, _MOST_CELL_M = 0.01, 100.0

F32 = NDArray[np.float32]
U8 = NDArray[np.uint8]


class MapGrid(NamedTuple):
    """Grid of a map (as onboard.records.Grid).

    x0_m, y0_m: centre of cell (0, 0).
    cell_m: side of a cell.
    rows: along +y.
    columns: along +x.
    """

    x0_m: float
    y0_m: float
    cell_m: float
    rows: int
    columns: int


class LdemProduct(NamedTuple):
    """Map of heights and node sets.

    grid: the map's grid.
    heights_m: (rows, columns) float32, NaN = no height.
    node_sets: (rows, columns) uint8, number of the node set chi, 0 to 3.
    """

    grid: MapGrid
    heights_m: F32
    node_sets: U8


def encode_ldem(product: LdemProduct, step_m: float = STEP_M) -> bytes:
    """Encode the product; decoded heights are at most step_m / 2 off.

    Raises ValueError if shapes do not fit the grid or a node set is over 3.
    """
    grid, shape = product.grid, (product.grid.rows, product.grid.columns)
    if product.heights_m.shape != shape or product.node_sets.shape != shape or 0 in shape:
        raise ValueError(f"heights {product.heights_m.shape} and sets {product.node_sets.shape} for a grid of {shape}")
    if int(product.node_sets.max()) > 3:
        raise ValueError("node sets are 0 to 3")
    known = np.isfinite(product.heights_m)
    heights = np.where(known, product.heights_m, 0).astype(np.float64)
    offset_m = float(heights[known].min()) if known.any() else 0.0
    quanta = np.rint((heights - offset_m) / step_m).astype(np.int64)
    folded = fold(residuals(quanta, known, median_edge))
    planes = planes_of(folded)
    packed = [
        compress(to_planes(folded, planes)),
        compress(np.packbits(known).tobytes()),
        compress(product.node_sets.astype(np.uint8).tobytes()),
    ]
    head = _HEAD.pack(
        _MAGIC,
        grid.rows,
        grid.columns,
        grid.x0_m,
        grid.y0_m,
        grid.cell_m,
        step_m,
        offset_m,
        planes,
        *(len(p) for p in packed),
    )
    return head + b"".join(packed)


def decode_ldem(data: bytes) -> LdemProduct:
    """Decode the product. Raises WireError("product") if it is malformed."""
    if len(data) < _HEAD.size:
        raise WireError("product", f"{len(data)} B are no map")
    magic, rows, columns, x0_m, y0_m, cell_m, step_m, offset_m, planes, *sizes = _HEAD.unpack_from(data)
    cells = rows * columns
    if magic != _MAGIC or not 1 <= planes <= 4:
        raise WireError("product", f"{magic!r}, {planes} planes")
    grid = checked_grid(x0_m, y0_m, cell_m, rows, columns)
    check(0 < step_m <= 1 and within(MOST_HEIGHT_M, offset_m), f"steps of {step_m:g} m from {offset_m:g} m")
    ends = np.cumsum([_HEAD.size, *sizes])
    if len(data) != ends[-1] and data[ends[-1] : ends[-1] + 4] != POSES_MAGIC:
        raise WireError("product", f"{len(data)} B instead of {ends[-1]}")
    raw = [expand(data[a:b], n) for a, b, n in zip(ends, ends[1:], (planes * cells, (cells + 7) // 8, cells))]
    left = unfold(from_planes(raw[0], planes)).reshape(rows, columns)
    known = np.unpackbits(raw[1], count=cells).astype(bool).reshape(rows, columns)
    quanta = integers(left, known, median_edge)
    heights = np.where(known, offset_m + quanta * step_m, np.nan)
    check(bool((np.abs(heights[known]) <= 2 * MOST_HEIGHT_M).all()), "a height beyond all ground")
    check(int(raw[2].max()) <= 3, "a node set over 3")
    return LdemProduct(grid, heights.astype(np.float32), raw[2].reshape(rows, columns))


def checked_grid(x0_m: float, y0_m: float, cell_m: float, rows: int, columns: int) -> MapGrid:
    """Check and build the grid of a received product. Raises WireError("product") if no map can have this grid."""
    check(0 < rows * columns <= _MAX_CELLS, f"{rows} x {columns} cells")
    check(within(MOST_PLACE_M, x0_m, y0_m), f"a grid at {x0_m:g}, {y0_m:g}")
    check(_LEAST_CELL_M <= cell_m <= _MOST_CELL_M, f"cells of {cell_m:g} m")
    return MapGrid(x0_m, y0_m, cell_m, rows, columns)


def poses_of(data: bytes) -> PoseMap | None:
    """Decode the pose section after a map's bytes; None if there is none. Raises WireError("product")."""
    try:
        end = _HEAD.size + sum(_HEAD.unpack_from(data)[-3:])
    except struct.error as error:
        raise WireError("product", str(error)) from error
    return decode_poses(data[end:]) if len(data) > end else None


def rounded(heights_m: F32, step_m: float = STEP_M) -> F32:
    """Heights after `encode_ldem` and `decode_ldem`, the same bits."""
    known = np.isfinite(heights_m)
    heights = np.where(known, heights_m, 0).astype(np.float64)
    offset_m = float(heights[known].min()) if known.any() else 0.0
    quanta = np.rint((heights - offset_m) / step_m).astype(np.int64)
    return np.where(known, offset_m + quanta * step_m, np.nan).astype(np.float32)
