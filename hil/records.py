"""Bench records: the true state, which onboard never sees, and the exchange between emulated nodes and plant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from onboard.native import elementary
from onboard.records import Pose


class WheelTruth(NamedTuple):
    """True state of one wheel.

    steer_rad, position_rad: steering angle and wheel angle
    rate_radps: wheel rate
    torque_nm: drive torque at the wheel
    load_n: load where the wheel meets the soil
    """

    steer_rad: float
    position_rad: float
    rate_radps: float
    torque_nm: float
    load_n: float = 0.0


class WheelDrive(NamedTuple):
    """Targets that a wheel node's motor drivers send to the plant, after the node's own ramps and timeouts."""

    steer_rad: float
    rate_radps: float


class TrueTurn(NamedTuple):
    """One turn of the scanner with its true rays; the arrays are not changed after creation.

    now_ns: time of its last beam
    sweep: number of the running sweep from 1, 0 outside a sweep
    origins_m, directions: (n, 3), map frame
    ranges_m: (n,), inf where the ray meets nothing
    """

    now_ns: int
    sweep: int
    origins_m: NDArray[np.float64]
    directions: NDArray[np.float64]
    ranges_m: NDArray[np.float64]


class Touch(NamedTuple):
    """Contact of one part of the rover with an obstacle, in one tick.

    wheel: 1 to 4, 0 for the body
    rock_height_m: height of the rock, 0 for the ground
    rock_m: place of the rock, None for the ground
    at_m: x, y of the point
    """

    wheel: int
    rock_height_m: float
    rock_m: tuple[float, float] | None
    at_m: tuple[float, float]


def what(wheel: int, rock_height_m: float) -> str:
    """Text for people: the part and its obstacle."""
    part = f"wheel {wheel}" if wheel else "body"
    return f"{part} on a rock of {rock_height_m:.2f} m" if rock_height_m else f"{part} on the ground"


@dataclass(frozen=True, slots=True)
class PlantState:
    """True state of the rover at `now_ns`.

    position_m: (3,) float64, base_link in the map frame
    quaternion_xyzw: (4,) float64, base_link in the map frame
    velocity_mps: (3,), of base_link, map axes
    angular_radps: (3,), base axes
    specific_force_mps2: (3,), reading of an ideal accelerometer at base_link, base axes, mean over the last tick
    wheels: true state of wheels 1 to 4
    touches: contacts of parts with obstacles, each pair once
    rockers_rad: left and right about +y, 0 is level
    """

    now_ns: int
    position_m: NDArray[np.float64]
    quaternion_xyzw: NDArray[np.float64]
    velocity_mps: NDArray[np.float64]
    angular_radps: NDArray[np.float64]
    specific_force_mps2: NDArray[np.float64]
    wheels: tuple[WheelTruth, ...]
    touches: tuple[Touch, ...] = ()
    rockers_rad: tuple[float, float] = (0.0, 0.0)

    @property
    def contact(self) -> str:
        """Contacts of this tick for people ("wheel 2 on a rock of 0.12 m; body on the ground"), or ''."""
        return "; ".join(what(touch.wheel, touch.rock_height_m) for touch in self.touches)

    @property
    def pose(self) -> Pose:
        """Pose of base_link in the map frame; angles intrinsic z-y-x."""
        x, y, z, w = self.quaternion_xyzw.tolist()
        roll_rad = elementary.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
        pitch_rad = elementary.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x))))
        yaw_rad = elementary.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        return Pose(*self.position_m.tolist(), roll_rad, pitch_rad, yaw_rad)
