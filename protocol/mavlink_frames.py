"""Conversion between our frames and MAVLink's. No other module knows that MAVLink's z axis points down.

Ours: map east, north, up (ENU); body forward, left, up (FLU); roll, pitch, yaw intrinsic z-y-x from ENU.
MAVLink: local north, east, down (NED); body forward, right, down (FRD); the same angles from NED.
The two vector functions are each their own inverse; the two attitude functions are inverses of each other.
"""

from __future__ import annotations

import math

from protocol.conventions import wrap_rad

Three = tuple[float, float, float]


def ned_from_enu(east: float, north: float, up: float) -> Three:
    """(north, east, down) of a vector in the map frame; also its own inverse, read as (east, north, up)."""
    return north, east, -up


def frd_from_flu(forward: float, left: float, up: float) -> Three:
    """(forward, right, down) of a vector in the body frame; also its own inverse."""
    return forward, -left, -up


def ned_angles(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Three:
    """(roll, pitch, yaw) of the FRD body in NED: nose up is positive pitch, yaw counts from north to the east."""
    return roll_rad, -pitch_rad, wrap_rad(math.pi / 2 - yaw_rad)


def enu_angles(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Three:
    """(roll, pitch, yaw) of the FLU body in ENU from MAVLink's angles: the same formula, inverted."""
    return ned_angles(roll_rad, pitch_rad, yaw_rad)
