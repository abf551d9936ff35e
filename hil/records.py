"""The bench's own records: the truth that onboard never sees, and what the emulated nodes exchange with the plant."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from onboard.records import Pose


class WheelTruth(NamedTuple):
    """One wheel as it really is. torque_nm: drive torque at the wheel; sinkage and load where the wheel meets soil."""

    steer_rad: float
    position_rad: float
    rate_radps: float
    torque_nm: float
    load_n: float = 0.0


class WheelDrive(NamedTuple):
    """What a wheel node's motor drivers ask of the plant: targets after the node's own ramps and timeouts."""

    steer_rad: float
    rate_radps: float


class Turn(NamedTuple):
    """One turn of the scanner as its rays truly went, by arrays that nobody writes to any more.

    now_ns: of its last beam. sweep: number of the running sweep from 1, 0 outside one. origins_m, directions: (n, 3) in
    the map frame. ranges_m: (n,), inf where nothing was met.
    """

    now_ns: int
    sweep: int
    origins_m: NDArray[np.float64]
    directions: NDArray[np.float64]
    ranges_m: NDArray[np.float64]


class Touch(NamedTuple):
    """A part of the rover on what it must not touch, in one tick.

    wheel: 1 to 4, 0: the body. rock_height_m, rock_m: of the rock; 0 and None: the ground. at_m: x, y of the point.
    """

    wheel: int
    rock_height_m: float
    rock_m: tuple[float, float] | None
    at_m: tuple[float, float]


def what(wheel: int, rock_height_m: float) -> str:
    """What touches what, for people."""
    part = f"wheel {wheel}" if wheel else "body"
    return f"{part} on a rock of {rock_height_m:.2f} m" if rock_height_m else f"{part} on the ground"


@dataclass(frozen=True, slots=True)
class PlantState:
    """The rover as it really is at `now_ns`.

    position_m (3,), quaternion_xyzw (4,): base_link in the map frame, float64. velocity_mps (3,): of base_link, map
    axes. angular_radps (3,): base axes. specific_force_mps2 (3,): what an ideal accelerometer at base_link feels, base
    axes, mean over the last tick. touches: of parts with what they must not touch, each pair once.
    rockers_rad: left and right about +y, 0 level.
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
        """'' or what touches in this tick ("wheel 2 on a rock of 0.12 m; body on the ground")."""
        return "; ".join(what(touch.wheel, touch.rock_height_m) for touch in self.touches)

    @property
    def pose(self) -> Pose:
        """base_link in the map frame; angles intrinsic z-y-x."""
        x, y, z, w = self.quaternion_xyzw.tolist()
        roll_rad = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
        pitch_rad = math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x))))
        yaw_rad = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        return Pose(*self.position_m.tolist(), roll_rad, pitch_rad, yaw_rad)
