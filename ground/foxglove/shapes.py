"""Fetched map and scan as Foxglove's Grid and PointCloud."""

from __future__ import annotations

import numpy as np
from foxglove.messages import (
    Grid,
    PackedElementField,
    PackedElementFieldNumericType,
    PointCloud,
    Pose,
    Quaternion,
    Timestamp,
    Vector2,
    Vector3,
)

from ground.products.files import image_of, points_map
from protocol.products import LdemProduct
from protocol.products.scan import ScanProduct

CELL = np.dtype([("elevation", "<f4"), ("node_set", "u1")])
POINT = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("time", "<f4")])
_TYPES = {"f": PackedElementFieldNumericType.Float32, "u": PackedElementFieldNumericType.Uint8}


def grid(product: LdemProduct, at_ns: int) -> Grid:
    """Return the grid in the map frame.

    elevation in m, NaN unknown; node_set 0 outside, 1 hidden, 2 obstacle, 3 free.
    """
    cells = np.empty(product.heights_m.shape, CELL)
    cells["elevation"], cells["node_set"] = product.heights_m, product.node_sets
    cell_m, half = product.grid.cell_m, product.grid.cell_m / 2
    return Grid(
        timestamp=_stamp(at_ns), frame_id="map", pose=_pose(product.grid.x0_m - half, product.grid.y0_m - half),
        column_count=product.grid.columns, cell_size=Vector2(x=cell_m, y=cell_m),
        row_stride=CELL.itemsize * product.grid.columns, cell_stride=CELL.itemsize, fields=_fields(CELL),
        data=cells.tobytes(),
    )  # fmt: skip


def points(scan: ScanProduct) -> np.ndarray:
    """Return (k,) of POINT, in the map frame, m; time since the scan's first turn, s."""
    xyz_m, valid = points_map(scan, image_of(scan))
    rows = np.empty(len(xyz_m), POINT)
    rows["x"], rows["y"], rows["z"] = xyz_m.T
    rows["time"] = (valid.pixels["time_ns"] - int(scan.start_ns[0])) * 1e-9
    return rows


def cloud(scan: ScanProduct) -> PointCloud:
    """Return the cloud in the map frame, stamped with the scan's first turn."""
    return PointCloud(timestamp=_stamp(int(scan.start_ns[0])), frame_id="map", pose=_pose(0.0, 0.0),
                      point_stride=POINT.itemsize, fields=_fields(POINT), data=points(scan).tobytes())  # fmt: skip


def _fields(rows: np.dtype) -> list[PackedElementField]:
    return [
        PackedElementField(name=name, offset=int(rows.fields[name][1]), type=_TYPES[rows.fields[name][0].kind])
        for name in rows.names
    ]


def _pose(x_m: float, y_m: float) -> Pose:
    return Pose(position=Vector3(x=x_m, y=y_m, z=0.0), orientation=Quaternion(x=0.0, y=0.0, z=0.0, w=1.0))


def _stamp(at_ns: int) -> Timestamp:
    return Timestamp(sec=at_ns // 1_000_000_000, nsec=at_ns % 1_000_000_000)
