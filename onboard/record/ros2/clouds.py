"""3D scans of a record as sensor_msgs/PointCloud2."""

from __future__ import annotations

from typing import Any

import numpy as np

from onboard.config import Rover
from onboard.perception.scan3d import Scan3d, points
from onboard.record.ros2.types import BASE, header, new

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
    found = points(scan, rover)
    made = np.empty(len(found.xyz_m), POINT)
    made["x"], made["y"], made["z"] = found.xyz_m.T
    made["intensity"] = found.pixels["intensity"]
    made["time"] = (found.pixels["time_ns"] - first_ns(scan)) * 1e-9
    return made


def cloud(scan: Scan3d, rover: Rover) -> Any:
    """Build sensor_msgs/PointCloud2 in base_link, stamped with the first beam's time: the rover stands in a sweep."""
    made = rows(scan, rover)
    fields = [
        new("sensor_msgs/PointField", name=name, offset=4 * k, datatype=_FLOAT32, count=1)
        for k, name in enumerate(POINT.names or ())
    ]  # fmt: skip
    return new(
        "sensor_msgs/PointCloud2", header=header(first_ns(scan), BASE), height=1, width=len(made), fields=fields,
        is_bigendian=False, point_step=POINT.itemsize, row_step=POINT.itemsize * len(made),
        data=np.frombuffer(made.tobytes(), np.uint8), is_dense=True,
    )  # fmt: skip
