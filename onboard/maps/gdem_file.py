"""File format of the orbiter's map, .npz: heights_m (rows, columns) float32, x0_m, y0_m, cell_m, note.

A cell whose height is not a number, or farther than HIGHEST_M from zero, is unknown: NaN. Any other error rejects the
whole map.
"""

from __future__ import annotations

import io
import math
import os
import stat
from pathlib import Path

import numpy as np

from onboard.maps.npz_arrays import NUMBER, ArraySpec, read_arrays
from onboard.records import Gdem, Grid

MOST_CELLS = 5000  # of a side: the limit of the global planner
MOST_BYTES = 256 << 20  # of the file
HIGHEST_M = 1e7  # same limit as in the global planner
FARTHEST_M = 1e7  # of the map's corner from the start
CELL_M = (0.01, 10_000.0)
_ROWS = {
    "heights_m": ArraySpec("iuf", 2, MOST_CELLS, 8 * MOST_CELLS**2), "x0_m": NUMBER, "y0_m": NUMBER, "cell_m": NUMBER,
    "note": ArraySpec("U", 0, 0, 40_000),
}  # fmt: skip


class GdemError(ValueError):
    """The bytes are not an orbiter's map; the text is one line."""


def to_npz(gdem: Gdem) -> bytes:
    """Encode the map; the same map gives the same bytes."""
    buffer, grid = io.BytesIO(), gdem.grid
    np.savez_compressed(
        buffer, heights_m=gdem.heights_m, x0_m=grid.x0_m, y0_m=grid.y0_m, cell_m=grid.cell_m, note=gdem.note
    )
    return buffer.getvalue()


def from_npz(data: bytes) -> Gdem:
    """Decode the map. Raises GdemError if the bytes are not such a map."""
    try:
        found = read_arrays(data, _ROWS)
    except ValueError as error:
        raise GdemError(f"no .npz of heights_m, x0_m, y0_m, cell_m, note: {error}") from None
    x0_m, y0_m, cell_m = (float(found[name]) for name in ("x0_m", "y0_m", "cell_m"))
    if not CELL_M[0] <= cell_m <= CELL_M[1]:
        raise GdemError(f"cell_m = {cell_m:g} should be {CELL_M[0]:g} to {CELL_M[1]:g} m")
    if not max(abs(x0_m), abs(y0_m)) <= FARTHEST_M or math.isnan(x0_m + y0_m):
        raise GdemError(f"x0_m, y0_m = {x0_m:g}, {y0_m:g} should be within {FARTHEST_M:g} m of the start")
    with np.errstate(over="ignore"):  # of float64: such a height is unknown anyway
        heights_m = np.array(found["heights_m"], dtype=np.float32, order="C")
    heights_m[~(np.abs(heights_m) <= HIGHEST_M)] = np.nan
    rows, columns = heights_m.shape
    if min(rows, columns) < 2:
        raise GdemError(f"heights_m of {rows} x {columns} cells are no map: 2 a side at least")
    if np.isnan(heights_m).all():
        raise GdemError("heights_m has no cell with a height")
    return Gdem(Grid(x0_m, y0_m, cell_m, rows, columns), heights_m, str(found["note"]))


def read_gdem(path: Path) -> Gdem:
    """Read the map in a file. Raises OSError if it cannot be read, GdemError; a pipe or a device is never read."""
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    with os.fdopen(descriptor, "rb") as file:
        told = os.fstat(descriptor)
        if not stat.S_ISREG(told.st_mode):
            raise GdemError("is no regular file")
        if told.st_size > MOST_BYTES:
            raise GdemError(f"has {told.st_size} bytes; a map has {MOST_BYTES} at most")
        return from_npz(file.read(MOST_BYTES + 1))
