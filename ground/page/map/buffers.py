"""Buffers of the 3D panel: the last scan's cloud and the terrain as bytes that a browser draws without parsing. Pure.

    cloud:    4 float64: points here, points of the scan, stop, UTC of the measurement in s | points x 3 float32
    terrain:  5 float64: x and y of the first cell's centre, cell size, rows, columns       | rows x columns float32

All is little-endian, in m, in the map frame (REP-103: x east, y north, z up).
"""

from __future__ import annotations

import math
import struct

import numpy as np

from ground.products.files import image_of, points_map
from protocol.products.ldem import LdemProduct
from protocol.products.scan import decode_scan

MOST_POINTS = MOST_CELLS = 20_000
_CLOUD_HEAD, _TERRAIN_HEAD = struct.Struct("<4d"), struct.Struct("<5d")


def cloud_buffer(data: bytes, arrived_utc_ns: int, onboard_ns: int | None) -> bytes:
    """Return the points of a scan product, at most 20,000 evenly left out. Raises WireError for bytes that are none.

    arrived_utc_ns: UTC of the product's arrival.
    onboard_ns: onboard time then; None: not known, and neither is the time of the measurement (NaN).
    """
    scan = decode_scan(data)
    points_m = points_map(scan, image_of(scan))[0]
    points_m = points_m[np.isfinite(points_m).all(axis=1)]
    sent_m = points_m[:: max(1, -(-len(points_m) // MOST_POINTS))]
    taken_utc_s = _taken_utc_s(int(scan.start_ns[-1]), arrived_utc_ns, onboard_ns)
    return _CLOUD_HEAD.pack(len(sent_m), len(points_m), scan.stop, taken_utc_s) + sent_m.astype("<f4").tobytes()


def _taken_utc_s(end_ns: int, arrived_utc_ns: int, onboard_ns: int | None) -> float:
    """Return the UTC of a scan's end, s; NaN: not known. A scan that ends in the rover's future is of another boot."""
    if onboard_ns is None or end_ns > onboard_ns:
        return math.nan
    return (arrived_utc_ns - (onboard_ns - end_ns)) / 1e9


def terrain_buffer(product: LdemProduct) -> bytes:
    """Return the heights of a map, NaN unknown; of more than 20,000 cells each second or third row and column."""
    heights_m, grid = product.heights_m, product.grid
    step = math.ceil(math.sqrt(heights_m.size / MOST_CELLS)) if heights_m.size > MOST_CELLS else 1
    sent_m = heights_m[::step, ::step]
    head = _TERRAIN_HEAD.pack(grid.x0_m, grid.y0_m, grid.cell_m * step, *sent_m.shape)
    return head + sent_m.astype("<f4").tobytes()
