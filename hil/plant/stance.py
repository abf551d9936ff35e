"""Stance of the rover on the ground: the pose of its body and rockers with all four wheels on the soil.

    wheel centre = base + Rz(yaw) Ry(pitch) Rx(roll) (pivot + Ry(rocker) arm)       rocker right = -rocker left

Four heights are given (one under each wheel), four unknowns are solved for: z, roll, pitch, rocker. x, y and yaw are
given. A rocker turns about a pivot above the ground, so its wheels move along x as well: the heights are those at the
resulting wheel places, by iteration. A rover that starts with level rockers turns them while it settles; that pushes
the wheels of the two sides apart and turns the yaw, by 1.3 degrees on twisted ground.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hil.plant.rover_model import PIVOT_M
from hil.terrain.field import Field
from hil.terrain.mesh import soil_height
from onboard.config import Rover
from onboard.native import elementary
from onboard.records import Pose
from protocol.conventions import WHEEL_SIGNS

ITERATIONS = 8  # each divides the error by ten on ground that a rover may stand on


class Stance(NamedTuple):
    """Stance of the rover.

    z_m: of base_link, map frame
    roll_rad, pitch_rad: intrinsic z-y-x
    rocker_rad: left rocker about +y
    """

    z_m: float
    roll_rad: float
    pitch_rad: float
    rocker_rad: float


def stance(field: Field, rover: Rover, pose: Pose) -> Stance:
    """Stance with base_link at x, y, yaw of `pose`, wheels straight and on the soil's surface, without sinkage."""
    found = Stance(0.0, 0.0, 0.0, 0.0)
    axle_m, track_m = 2 * rover.half_wheelbase_m, 2 * rover.half_track_m
    for _ in range(ITERATIONS):
        centres_m = wheel_centres(rover, pose, found)
        ground_m = soil_height(field.grid, field.soil_z, centres_m[:, 0].copy(), centres_m[:, 1].copy())
        front_left, rear_left, rear_right, front_right = (ground_m + rover.wheel_radius_m - centres_m[:, 2]).tolist()
        left_rad, right_rad = (rear_left - front_left) / axle_m, (rear_right - front_right) / axle_m
        found = Stance(
            found.z_m + (front_left + rear_left + rear_right + front_right) / 4,
            found.roll_rad + (front_left + rear_left - rear_right - front_right) / (2 * track_m),
            found.pitch_rad + (left_rad + right_rad) / 2,
            found.rocker_rad + (left_rad - right_rad) / 2,
        )
    return found


def wheel_centres(rover: Rover, pose: Pose, at: Stance) -> NDArray[np.float64]:
    """Centres of wheels 1 to 4, (4, 3), m, map frame, with base_link at x, y, yaw of `pose`."""
    places = []
    for ahead, left in WHEEL_SIGNS:
        rocker_rad = at.rocker_rad * left
        x_m, z_m = _turned(ahead * rover.half_wheelbase_m, rover.wheel_radius_m - PIVOT_M, rocker_rad)
        z_m += PIVOT_M
        y_m, z_m = _turned(left * rover.half_track_m, z_m, -at.roll_rad)
        x_m, z_m = _turned(x_m, z_m, at.pitch_rad)
        cosine, sine = elementary.cos(pose.yaw_rad), elementary.sin(pose.yaw_rad)
        places.append((pose.x_m + x_m * cosine - y_m * sine, pose.y_m + x_m * sine + y_m * cosine, at.z_m + z_m))
    return np.array(places)


def _turned(along_m: float, up_m: float, nose_down_rad: float) -> tuple[float, float]:
    """Rotate; positive angles turn the first axis downwards: pitch about +y, roll about +x with a minus sign."""
    cosine, sine = elementary.cos(nose_down_rad), elementary.sin(nose_down_rad)
    return along_m * cosine + up_m * sine, up_m * cosine - along_m * sine
