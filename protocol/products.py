"""The map product: heights and node sets of a grid in few bytes, the same bits on both sides.

Heights become integers by an explicit step and offset, integers become residuals of the MED predictor (median of west,
north, west + north - north-west; LOCO-I, 2000), residuals become byte planes, and zstandard packs them. A cell without
a height takes its west neighbour's integer for the prediction and has residual 0; which cells these are is a bit mask.
Behind the map's bytes may follow what the planner made of it (`protocol.pose_map`).
"""

from __future__ import annotations

import struct
from typing import NamedTuple

import numpy as np
import zstandard
from numpy.typing import NDArray

from protocol import WireError
from protocol.pose_map import PoseMap, decode_poses

LDEM_CODEC = "ldem-2"  # 1: without the section of poses
STEP_M = 0.00199  # at most 0.995 mm off, float32 rounding included at most 1 mm
_HEAD = struct.Struct("<4sHHdddddBIII")
_MAGIC = b"LDM1"
_MAX_CELLS = 4_000_000
_LEVEL = 19

F32 = NDArray[np.float32]
U8 = NDArray[np.uint8]
I64 = NDArray[np.int64]


class MapGrid(NamedTuple):
    """Where a grid lies: centre of cell (0, 0), cell, rows along +y, columns along +x (as onboard.records.Grid)."""

    x0_m: float
    y0_m: float
    cell_m: float
    rows: int
    columns: int


class LdemProduct(NamedTuple):
    """heights_m (rows, columns) float32, NaN = no height; node_sets (rows, columns) uint8 of the sets chi, 0 to 3."""

    grid: MapGrid
    heights_m: F32
    node_sets: U8


def encode_ldem(product: LdemProduct, step_m: float = STEP_M) -> bytes:
    """The product's bytes; heights come back at most step_m / 2 off.

    Raises ValueError where shapes do not fit the grid or a node set is over 3.
    """
    grid, shape = product.grid, (product.grid.rows, product.grid.columns)
    if product.heights_m.shape != shape or product.node_sets.shape != shape or 0 in shape:
        raise ValueError(f"heights {product.heights_m.shape} and sets {product.node_sets.shape} for a grid of {shape}")
    if int(product.node_sets.max()) > 3:
        raise ValueError("node sets are 0 to 3")
    known = np.isfinite(product.heights_m)
    heights = np.where(known, product.heights_m, 0).astype(np.float64)
    offset_m = float(heights[known].min()) if known.any() else 0.0
    residuals = _residuals(np.rint((heights - offset_m) / step_m).astype(np.int64), known)
    folded = np.where(residuals < 0, -2 * residuals - 1, 2 * residuals)  # small numbers of either sign, unsigned
    planes = max(1, (int(folded.max()).bit_length() + 7) // 8)
    packer = zstandard.ZstdCompressor(level=_LEVEL, write_content_size=True)
    packed = [
        packer.compress(b"".join(((folded >> 8 * n) & 0xFF).astype(np.uint8).tobytes() for n in range(planes))),
        packer.compress(np.packbits(known).tobytes()),
        packer.compress(product.node_sets.astype(np.uint8).tobytes()),
    ]
    head = _HEAD.pack(_MAGIC, grid.rows, grid.columns, grid.x0_m, grid.y0_m, grid.cell_m, step_m, offset_m, planes,
                      *(len(p) for p in packed))
    return head + b"".join(packed)


def decode_ldem(data: bytes) -> LdemProduct:
    """The product. Raises WireError("product") on anything malformed."""
    try:
        magic, rows, columns, x0_m, y0_m, cell_m, step_m, offset_m, planes, *sizes = _HEAD.unpack_from(data)
        cells = rows * columns
        if magic != _MAGIC or not 0 < cells <= _MAX_CELLS or not 1 <= planes <= 4:
            raise ValueError(f"{magic!r}, {rows} x {columns}, {planes} planes")
        ends = np.cumsum([_HEAD.size, *sizes])
        if len(data) != ends[-1] and data[ends[-1] : ends[-1] + 4] != b"POS1":
            raise ValueError(f"{len(data)} B instead of {ends[-1]}")
        raw = [_unpack(data[a:b], n) for a, b, n in zip(ends, ends[1:], (planes * cells, (cells + 7) // 8, cells))]
    except (struct.error, ValueError, zstandard.ZstdError) as error:
        raise WireError("product", str(error)) from error
    folded = np.zeros(cells, np.int64)
    for n, plane in enumerate(raw[0].reshape(planes, cells)):
        folded |= plane.astype(np.int64) << 8 * n
    residuals = np.where(folded & 1, -(folded + 1) // 2, folded // 2).reshape(rows, columns)
    known = np.unpackbits(raw[1], count=cells).astype(bool).reshape(rows, columns)
    quanta = _integers(residuals, known)
    heights = np.where(known, offset_m + quanta * step_m, np.nan).astype(np.float32)
    grid = MapGrid(x0_m, y0_m, cell_m, rows, columns)
    return LdemProduct(grid, heights, raw[2].reshape(rows, columns))


def poses_of(data: bytes) -> PoseMap | None:
    """The section of poses behind a map's bytes; None where none follows. Raises WireError("product")."""
    try:
        end = _HEAD.size + sum(_HEAD.unpack_from(data)[-3:])
    except struct.error as error:
        raise WireError("product", str(error)) from error
    return decode_poses(data[end:]) if len(data) > end else None


def rounded(heights_m: F32, step_m: float = STEP_M) -> F32:
    """The heights as they come back from `encode_ldem` and `decode_ldem`, the same bits."""
    known = np.isfinite(heights_m)
    heights = np.where(known, heights_m, 0).astype(np.float64)
    offset_m = float(heights[known].min()) if known.any() else 0.0
    quanta = np.rint((heights - offset_m) / step_m).astype(np.int64)
    return np.where(known, offset_m + quanta * step_m, np.nan).astype(np.float32)


def _unpack(data: bytes, size: int) -> U8:
    raw = np.frombuffer(zstandard.ZstdDecompressor().decompress(data, max_output_size=size), np.uint8)
    if len(raw) != size:
        raise ValueError(f"{len(raw)} B instead of {size}")
    return raw


def _median(west: I64, north: I64, north_west: I64) -> I64:
    """The MED prediction: the middle one of west, north and west + north - north-west."""
    low, high = np.minimum(west, north), np.maximum(west, north)
    middle: I64 = np.maximum(low, np.minimum(west + north - north_west, high))
    return middle


def _residuals(quanta: I64, known: NDArray[np.bool_]) -> I64:
    """Integers minus their prediction; 0 where not known."""
    filled = quanta.copy()
    filled[:, 0] = _carried(filled[:, 0], known[:, 0])
    anchored = known.copy()
    anchored[:, 0] = True
    source = np.maximum.accumulate(np.where(anchored, np.arange(quanta.shape[1]), 0), axis=1)
    filled = np.take_along_axis(filled, source, axis=1)
    predicted = np.zeros_like(filled)
    predicted[0, 1:], predicted[1:, 0] = filled[0, :-1], filled[:-1, 0]
    predicted[1:, 1:] = _median(filled[1:, :-1], filled[:-1, 1:], filled[:-1, :-1])
    return np.where(known, filled - predicted, 0)


def _carried(column: I64, known: NDArray[np.bool_]) -> I64:
    """The first column's unknown cells take the cell to their north (0 above all)."""
    source = np.maximum.accumulate(np.where(known, np.arange(len(column)), -1))
    return np.where(source >= 0, column[np.maximum(source, 0)], 0)


def _integers(residuals: I64, known: NDArray[np.bool_]) -> I64:
    """The inverse of `_residuals`, one anti-diagonal after the other: all on one need only the two before."""
    rows, columns = residuals.shape
    padded = np.zeros((rows + 1, columns + 1), np.int64)
    flat, stride = padded.reshape(-1), columns + 1
    for diagonal in range(rows + columns - 1):
        j = np.arange(max(0, diagonal - columns + 1), min(rows, diagonal + 1))
        i = diagonal - j
        at = (j + 1) * stride + i + 1
        west, north, north_west = flat[at - 1], flat[at - stride], flat[at - stride - 1]
        edge = np.where(i == 0, north, west)  # the first row and column have one neighbour
        predicted = np.where((i == 0) | (j == 0), edge, _median(west, north, north_west))
        flat[at] = np.where(known[j, i], predicted + residuals[j, i], edge)
    return padded[1:, 1:]
