"""3D scans of a record as sensor_msgs/PointCloud2."""

from __future__ import annotations

from typing import Any

import numpy as np

from onboard.bringup.ros2.types import BASE, header, new
from onboard.config import Rover
from onboard.perception.scan.scan3d import Scan3d, points

POINT = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<f4"), ("time", "<f4")])
_FLOAT32 = 7  # of sensor_msgs/PointField


def first_ns(scan: Scan3d) -> int:
    """Onboard time of the scan's first beam."""
    return int(scan.pixels["time_ns"].min())


def last_ns(scan: Scan3d) -> int:
    """Onboard time of the scan's last beam."""
    return int(scan.pixels["time_ns"].max())


def rows(scan: Scan3d, rover: Rover) -> Any:
    """Valid points, (k,) of POINT: x, y, z in base_link, m; intensity -1 if not measured; time since `first_ns`, s."""
    valid = points(scan, rover)
    table = np.empty(len(valid.xyz_m), POINT)
    table["x"], table["y"], table["z"] = valid.xyz_m.T
    table["intensity"] = valid.pixels["intensity"]
    table["time"] = (valid.pixels["time_ns"] - first_ns(scan)) * 1e-9
    return table


def cloud(scan: Scan3d, rover: Rover) -> Any:
    """Build sensor_msgs/PointCloud2 in base_link, stamped with the first beam's time: the rover stands in a sweep."""
    table = rows(scan, rover)
    fields = [
        new("sensor_msgs/PointField", name=name, offset=4 * k, datatype=_FLOAT32, count=1)
        for k, name in enumerate(POINT.names or ())
    ]  # fmt: skip
    return new(
        "sensor_msgs/PointCloud2", header=header(first_ns(scan), BASE), height=1, width=len(table), fields=fields,
        is_bigendian=False, point_step=POINT.itemsize, row_step=POINT.itemsize * len(table),
        data=np.frombuffer(table.tobytes(), np.uint8), is_dense=True,
    )  # fmt: skip
