"""ROS 2 message types of the export, and the parts that most of them share: stamps, headers, poses.

Types are those of ROS 2 Humble, which later releases read, and grid_map_msgs/GridMap. rosbags makes the classes from
the definitions and writes the definitions into the bag, so a reader needs no installed message package.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from typing import Any

from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from onboard.record.reader import DamagedRecordError

MAP, BASE = "map", "base_link"  # frames of REP-105; the rover corrects its one estimate in place, so no frame odom
_GRID_MAP_INFO = """
float64 resolution
float64 length_x
float64 length_y
geometry_msgs/Pose pose
"""
_GRID_MAP = """
std_msgs/Header header
grid_map_msgs/GridMapInfo info
string[] layers
string[] basic_layers
std_msgs/Float32MultiArray[] data
uint16 outer_start_index
uint16 inner_start_index
"""
_MOST_S = 2**31


@cache
def store() -> Typestore:
    """Type store: Humble with GridMap."""
    types = get_typestore(Stores.ROS2_HUMBLE)
    types.register(get_types_from_msg(_GRID_MAP_INFO, "grid_map_msgs/msg/GridMapInfo"))
    types.register(get_types_from_msg(_GRID_MAP, "grid_map_msgs/msg/GridMap"))
    return types


def new(name: str, /, **fields: Any) -> Any:
    """Build a message: `new("geometry_msgs/Point", x=1.0, y=0.0, z=0.0)`."""
    package, _, kind = name.partition("/")
    return store().types[f"{package}/msg/{kind}"](**fields)


def stamp(now_ns: int) -> Any:
    """Build builtin_interfaces/Time of onboard time. Raises DamagedRecordError for a time that ROS cannot hold."""
    if not 0 <= now_ns < _MOST_S * 1_000_000_000:
        raise DamagedRecordError(f"time {now_ns} ns: ROS holds 0 to {_MOST_S} s")
    return new("builtin_interfaces/Time", sec=now_ns // 1_000_000_000, nanosec=now_ns % 1_000_000_000)


def header(now_ns: int, frame: str) -> Any:
    """Build std_msgs/Header."""
    return new("std_msgs/Header", stamp=stamp(now_ns), frame_id=frame)


def point(x: float, y: float, z: float) -> Any:
    """Build geometry_msgs/Point, m."""
    return new("geometry_msgs/Point", x=x, y=y, z=z)


def vector(x: float, y: float, z: float) -> Any:
    """Build geometry_msgs/Vector3."""
    return new("geometry_msgs/Vector3", x=x, y=y, z=z)


def quaternion(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Any:
    """Build geometry_msgs/Quaternion of intrinsic z-y-x angles."""
    cr, sr = math.cos(roll_rad / 2), math.sin(roll_rad / 2)
    cp, sp = math.cos(pitch_rad / 2), math.sin(pitch_rad / 2)
    cy, sy = math.cos(yaw_rad / 2), math.sin(yaw_rad / 2)
    return new(
        "geometry_msgs/Quaternion", x=sr * cp * cy - cr * sp * sy, y=cr * sp * cy + sr * cp * sy,
        z=cr * cp * sy - sr * sp * cy, w=cr * cp * cy + sr * sp * sy,
    )  # fmt: skip


def pose(xyz_m: Sequence[float], yaw_rad: float = 0.0, roll_rad: float = 0.0, pitch_rad: float = 0.0) -> Any:
    """Build geometry_msgs/Pose."""
    return new("geometry_msgs/Pose", position=point(*xyz_m), orientation=quaternion(roll_rad, pitch_rad, yaw_rad))
