"""The orbiter's map as the bytes of an .npz: heights_m (rows, columns) float32, x0_m, y0_m, cell_m, note."""

from __future__ import annotations

import io
import zipfile

import numpy as np

from onboard.records import Gdem, Grid


def to_npz(gdem: Gdem) -> bytes:
    """The map as a file's bytes; the same map gives the same bytes."""
    buffer, grid = io.BytesIO(), gdem.grid
    np.savez_compressed(
        buffer, heights_m=gdem.heights_m, x0_m=grid.x0_m, y0_m=grid.y0_m, cell_m=grid.cell_m, note=gdem.note
    )
    return buffer.getvalue()


def from_npz(data: bytes) -> Gdem:
    """The map of a file's bytes. Raises ValueError when they are no such map."""
    try:
        with np.load(io.BytesIO(data)) as file:
            heights_m = file["heights_m"].astype(np.float32)
            rows, columns = heights_m.shape
            grid = Grid(float(file["x0_m"]), float(file["y0_m"]), float(file["cell_m"]), rows, columns)
            return Gdem(grid, heights_m, str(file["note"]))
    except (KeyError, OSError, EOFError, zipfile.BadZipFile) as error:
        raise ValueError(f"not an .npz of heights_m, x0_m, y0_m, cell_m, note: {error}") from error
