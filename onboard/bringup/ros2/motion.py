"""Odometry, transform and joints as ROS 2 messages."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from onboard.bringup.ros2.types import BASE, MAP, header, new, point, quaternion, vector
from onboard.records import Twist, WheelState

Pose = Sequence[float]  # x, y, z (m), roll, pitch, yaw (rad) of base_link in map
CORNERS = ("front_left", "rear_left", "rear_right", "front_right")  # wheels 1 to 4, as in docs/rover.urdf
TILT_JOINT = "scanner_tilt_joint"


def odometry(pose: Pose, twist: Twist, sigmas: tuple[float, float], now_ns: int) -> Any:
    """Build nav_msgs/Odometry: the estimate in `map`, the wheels' twist in `base_link`.

    sigmas: 1 sigma of the position (m, of x and y together) and of the yaw (rad); NaN if not known. Elements of the
    covariances that the rover does not report are 0.
    """
    x_m, y_m, z_m, *angles = pose
    at = new("geometry_msgs/Pose", position=point(x_m, y_m, z_m), orientation=quaternion(*angles))
    moving = new(
        "geometry_msgs/Twist", linear=vector(twist.vx_mps, twist.vy_mps, 0.0), angular=vector(0.0, 0.0, twist.yaw_radps)
    )
    return new(
        "nav_msgs/Odometry", header=header(now_ns, MAP), child_frame_id=BASE,
        pose=new("geometry_msgs/PoseWithCovariance", pose=at, covariance=_covariance(*sigmas)),
        twist=new("geometry_msgs/TwistWithCovariance", twist=moving, covariance=np.zeros(36)),
    )  # fmt: skip


def transform(pose: Pose, now_ns: int) -> Any:
    """Build tf2_msgs/TFMessage: base_link in map."""
    x_m, y_m, z_m, *angles = pose
    offset = new("geometry_msgs/Transform", translation=vector(x_m, y_m, z_m), rotation=quaternion(*angles))
    one = new("geometry_msgs/TransformStamped", header=header(now_ns, MAP), child_frame_id=BASE, transform=offset)
    return new("tf2_msgs/TFMessage", transforms=[one])


def joints(wheels: Sequence[WheelState | None], tilt_rad: float | None, now_ns: int) -> Any:
    """Build sensor_msgs/JointState of the joints that have reported, with the names of docs/rover.urdf.

    The rate of steering and tilt is not measured: NaN. A wheel's position is its encoder, unwrapped.
    """
    rows: list[tuple[str, float, float]] = []
    for corner, wheel in zip(CORNERS, wheels, strict=True):
        if wheel is not None:
            rows.append((f"{corner}_steer_joint", wheel.steer_rad, math.nan))
            rows.append((f"{corner}_wheel_joint", wheel.position_rad, wheel.rate_radps))
    if tilt_rad is not None:
        rows.append((TILT_JOINT, tilt_rad, math.nan))
    return new(
        "sensor_msgs/JointState", header=header(now_ns, ""), name=[name for name, _, _ in rows],
        position=np.array([position for _, position, _ in rows]),
        velocity=np.array([rate for _, _, rate in rows]), effort=np.zeros(0),
    )  # fmt: skip


def _covariance(sigma_position_m: float, sigma_yaw_rad: float) -> Any:
    """(36,) float64, row by row: x, y, z, roll, pitch, yaw."""
    matrix = np.zeros((6, 6))
    if math.isfinite(sigma_position_m):
        matrix[0, 0] = matrix[1, 1] = sigma_position_m**2 / 2
    if math.isfinite(sigma_yaw_rad):
        matrix[5, 5] = sigma_yaw_rad**2
    return matrix.ravel()
