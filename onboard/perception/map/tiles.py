"""Persistent map in tiles of 10 m: cut, join, and encode each as bytes with a checksum.

A tile lies on the lattice of the cells: tile (j, i) begins at cell (j * side, i * side), counted from the origin of the
map frame, so a map that grew to the south or west has tiles with negative numbers. Its bytes, little-endian:

    magic 8 s, version u16 | cell_m f64, j i32, i i32, side u32, points u32, length of the layer table u16
    layer table, ASCII     | zstd of the layers (side, side) in their order, then the points (k, 3) float32
    BLAKE2b, 16 bytes, over all before it

The magic and the version come first in every version: the program can name a file of an older or newer program instead
of only refusing it.
"""

from __future__ import annotations

import hashlib
import math
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import zstandard

from onboard.perception.map import ldem
from onboard.records import F32, F64, Grid, Ldem

TILE_M = 10.0
VERSION = 1
MOST_CELLS = 10_000_000  # of the rectangle around all tiles: 0.45 GB of layers

_MAGIC = b"ELDTILE\n"
_OPENING = struct.Struct("<8sH")
_HEAD = struct.Struct("<diiIIH")
_SUM_BYTES = 16
_DTYPES = {name: np.dtype(kind).newbyteorder("<") for name, kind, _ in ldem.LAYERS}
_TABLE = ",".join(f"{name}:{kind.str}" for name, kind in _DTYPES.items()).encode("ascii")
_POINT = np.dtype("<f4")


class TileError(ValueError):
    """Bytes that are no tile for this map; the text is one line that continues after the file's name."""


@dataclass(frozen=True, slots=True)
class Tile:
    """Tile (j, i).

    j, i: its place on the tile lattice.
    cells: its cells.
    points_m: (k, 3) float32, map frame: the points in it to which later scans are registered.
    """

    j: int
    i: int
    cells: Ldem
    points_m: F32


def side_cells(cell_m: float) -> int:
    """Number of cells along the side of a tile."""
    return max(1, round(TILE_M / cell_m))


def tile_grid(j: int, i: int, cell_m: float) -> Grid:
    """Grid of tile (j, i)."""
    side = side_cells(cell_m)
    return ldem.lattice_grid(j * side, i * side, side, side, cell_m)


def cut(cells: Ldem, points_m: F64 | F32, before: Ldem | None = None) -> Iterator[Tile]:
    """The tiles of a map in which anything was seen or assumed; with `before`, those whose cells differ from it."""
    grid, side = cells.grid, side_cells(cells.grid.cell_m)
    first_j, first_i = ldem.first_cell(grid)
    nothing = ldem.empty(tile_grid(0, 0, grid.cell_m))
    points = np.asarray(points_m, np.float32).reshape(-1, 3)
    points_ji = np.floor(points[:, 1::-1] / (side * grid.cell_m))
    for j in range(first_j // side, (first_j + grid.rows - 1) // side + 1):
        for i in range(first_i // side, (first_i + grid.columns - 1) // side + 1):
            part = ldem.crop(cells, tile_grid(j, i, grid.cell_m))
            old = nothing if before is None else ldem.crop(before, part.grid)
            if not same_cells(part, old):
                yield Tile(j, i, part, points[(points_ji == (j, i)).all(axis=1)])


def join(tiles: Sequence[Tile]) -> tuple[Ldem, F64]:
    """One map of tiles with equal cell sizes, unseen between them, and all their points.

    Raises ValueError without tiles, or if the rectangle around them is too large for memory.
    """
    if not tiles:
        raise ValueError("no tiles to join")
    cell_m = tiles[0].cells.grid.cell_m
    side = side_cells(cell_m)
    (low_j, high_j), (low_i, high_i) = ((min(ks), max(ks) + 1) for ks in zip(*((t.j, t.i) for t in tiles)))
    rows, columns = (high_j - low_j) * side, (high_i - low_i) * side
    if rows * columns > MOST_CELLS:
        raise ValueError(
            f"the tiles lie {rows * cell_m:g} m x {columns * cell_m:g} m apart: "
            f"{rows * columns} cells, {MOST_CELLS} can be held"
        )
    joined = ldem.empty(ldem.lattice_grid(low_j * side, low_i * side, rows, columns, cell_m))
    for tile in tiles:
        j, i = (tile.j - low_j) * side, (tile.i - low_i) * side
        for name in _DTYPES:
            getattr(joined, name)[j : j + side, i : i + side] = getattr(tile.cells, name)
    return joined, np.concatenate([tile.points_m for tile in tiles]).astype(np.float64)


def same_cells(one: Ldem, other: Ldem) -> bool:
    """True if two maps of one grid have the same bits."""
    return all(getattr(one, name).tobytes() == getattr(other, name).tobytes() for name in _DTYPES)


def encode(tile: Tile) -> bytes:
    """The tile as bytes of a file; the same tile gives the same bytes."""
    grid = tile.cells.grid
    head = _HEAD.pack(grid.cell_m, tile.j, tile.i, grid.rows, len(tile.points_m), len(_TABLE))
    layers = b"".join(getattr(tile.cells, name).astype(kind).tobytes() for name, kind in _DTYPES.items())
    body = zstandard.ZstdCompressor(level=3).compress(layers + tile.points_m.astype(_POINT).tobytes())
    data = _OPENING.pack(_MAGIC, VERSION) + head + _TABLE + body
    return data + _sum(data)


def decode(data: bytes) -> Tile:
    """The tile of a file's bytes. Raises TileError: foreign, truncated, damaged, of another version or other layers."""
    if not data:
        raise TileError("is empty: torn off while it was written")
    if not data.startswith(_MAGIC):
        torn = _MAGIC.startswith(data)
        raise TileError("is torn off after its first bytes" if torn else "is no map tile")
    if len(data) < _OPENING.size + _HEAD.size + _SUM_BYTES:
        raise TileError(f"is torn off after {len(data)} bytes")
    version = _OPENING.unpack_from(data)[1]
    if version != VERSION:
        raise TileError(f"is of version {version}; this program reads {VERSION}")
    content, found = data[:-_SUM_BYTES], data[-_SUM_BYTES:]
    if _sum(content) != found:
        raise TileError("is torn or damaged: its checksum does not fit")
    cell_m, j, i, side, points, table_size = _HEAD.unpack_from(content, _OPENING.size)
    at = _OPENING.size + _HEAD.size
    table = content[at : at + table_size]
    if table != _TABLE:
        raise TileError(f"has the layers {table.decode('ascii', 'replace')}; this program reads {_TABLE.decode()}")
    if not (math.isfinite(cell_m) and cell_m > 0.0 and side == side_cells(cell_m)):
        raise TileError(f"has {side} cells of {cell_m:g} m to a side; a tile is {TILE_M:g} m long")
    return _unpacked(content[at + table_size :], tile_grid(j, i, cell_m), (j, i), points)


def _unpacked(body: bytes, grid: Grid, at: tuple[int, int], points: int) -> Tile:
    count = grid.rows * grid.columns
    expected = count * sum(kind.itemsize for kind in _DTYPES.values()) + 3 * _POINT.itemsize * points
    try:
        raw = zstandard.ZstdDecompressor().decompress(body, max_output_size=expected)
    except zstandard.ZstdError as error:
        raise TileError(f"does not unpack: {error}") from error
    if len(raw) != expected:
        raise TileError(f"unpacks to {len(raw)} bytes; its cells and points need {expected}")
    layers: dict[str, Any] = {}
    offset = 0
    for name, kind in _DTYPES.items():
        layer = np.frombuffer(raw, kind, count, offset).reshape(grid.rows, grid.columns)
        layers[name] = layer.astype(kind.newbyteorder("="))  # a copy: writeable, in the machine's byte order
        offset += layer.nbytes
    found = np.frombuffer(raw, _POINT, 3 * points, offset).reshape(-1, 3).astype(np.float32)
    return Tile(*at, Ldem(grid=grid, **layers), found)


def _sum(data: bytes) -> bytes:
    return hashlib.blake2b(data, digest_size=_SUM_BYTES).digest()
