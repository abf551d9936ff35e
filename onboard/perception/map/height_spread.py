"""Standard deviation of the heights within each map cell: range noise, slope and roughness together."""

from __future__ import annotations

import numpy as np

from onboard.records import F32, Ldem
from protocol.products.height_std import HeightStd, encode_height_std
from protocol.products.ldem import MapGrid

LEAST_HITS = 2


def height_std_m(ldem: Ldem) -> F32:
    """(rows, columns) float32, 1 sigma of the heights of each cell's hits, m; NaN with fewer than 2 hits.

    Sums of squares cancel: if all hits of a cell have one height z, the result is up to 3e-8 |z| instead of 0.
    """
    hits = np.maximum(ldem.n, 1).astype(np.float64)
    mean_m = ldem.sum_z / hits
    variance_m2 = np.maximum((ldem.sum_z2 - ldem.sum_z * mean_m) / hits, 0.0)
    std: F32 = np.where(ldem.n >= LEAST_HITS, np.sqrt(variance_m2), np.nan).astype(np.float32)
    return std


def pack(ldem: Ldem) -> bytes:
    """Bytes of the product of `get height_std`; runs as a job."""
    grid = ldem.grid
    return encode_height_std(
        HeightStd(MapGrid(grid.x0_m, grid.y0_m, grid.cell_m, grid.rows, grid.columns), height_std_m(ldem))
    )
