"""Extrinsics of sensors and steering units, from the configuration; `onboard calibrate` finds them.

    v_base = R_z(yaw) R_y(pitch) R_x(roll) v_unit        a vector in the axes of the tilt unit or the inertial sensor
    angle of a wheel = reading of its unit + offset      so an order is the wanted angle less the offset

A unit without rotation gives None, and callers skip the rotation: the result is bit-identical to none at all.
"""

from __future__ import annotations

import numpy as np

from onboard.config import Rover
from onboard.native.elementary import cos, sin
from onboard.records import F64

Vector = tuple[float, float, float]
Rows = tuple[Vector, Vector, Vector]


def rotation(roll_rad: float, pitch_rad: float, yaw_rad: float) -> F64:
    """Rotation matrix (3, 3): about x, then y, then z, of fixed axes."""
    (sr, sp, sy), (cr, cp, cy) = ([f(angle) for angle in (roll_rad, pitch_rad, yaw_rad)] for f in (sin, cos))
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def lidar_place(rover: Rover) -> F64:
    """(3,) centre of the scanner in base_link, m."""
    return np.array([rover.lidar_x_m, rover.lidar_y_m, rover.lidar_z_m])


def lidar_rotation(rover: Rover) -> F64 | None:
    """(3, 3) rotation from the tilt unit's axes at its angle 0 to base_link's; None if there is none."""
    angles = rover.lidar_roll_rad, rover.lidar_pitch_rad, rover.lidar_yaw_rad
    return rotation(*angles) if any(angles) else None


def imu_rotation(rover: Rover) -> Rows | None:
    """Rows of the rotation from the inertial sensor's axes to base_link's; None if there is none."""
    angles = rover.imu_roll_rad, rover.imu_pitch_rad, rover.imu_yaw_rad
    if not any(angles):
        return None
    x, y, z = rotation(*angles).tolist()
    return tuple(x), tuple(y), tuple(z)


def rotated(rows: Rows | None, v: Vector) -> Vector:
    """Return the rotated vector; unchanged if rows is None."""
    if rows is None:
        return v
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = rows
    x, y, z = v
    return ax * x + ay * y + az * z, bx * x + by * y + bz * z, cx * x + cy * y + cz * z


def steer_offsets_rad(rover: Rover) -> tuple[float, float, float, float]:
    """Angles of wheels 1 to 4 at which their units read 0."""
    return rover.steer_1_offset_rad, rover.steer_2_offset_rad, rover.steer_3_offset_rad, rover.steer_4_offset_rad
