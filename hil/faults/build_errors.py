"""Build errors of a rover against its drawing, which `onboard calibrate` estimates.

    built = BuildErrors(wheel_radius_ratio=1.02, steer_rad=(0.03, 0.0, 0.0, -0.02)).built(Rover())
    InMemory(Scenario(), built=built)             the world uses `built`, the flight program its own configuration

The bench builds plant, steering units, tilt unit and inertial sensor from the same keys that the flight program reads
from its configuration (`onboard.extrinsics`); so a configuration with the keys of `built` describes the rover exactly.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from hil.own_functions import generator
from onboard.config import Rover

Three = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class BuildErrors:
    """Errors against the drawing.

    wheel_radius_ratio: true wheel radius by that of the drawing
    steer_rad: steering zeros of wheels 1 to 4
    lidar_m: x, y, z
    lidar_rad, imu_rad: roll, pitch, yaw
    """

    wheel_radius_ratio: float = 1.0
    steer_rad: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    lidar_m: Three = (0.0, 0.0, 0.0)
    lidar_rad: Three = (0.0, 0.0, 0.0)
    imu_rad: Three = (0.0, 0.0, 0.0)

    def built(self, drawing: Rover) -> Rover:
        """Rover as built, from its drawing."""
        x, y, z = self.lidar_m
        mounted = {
            f"{unit}_{axis}_rad": angle
            for unit, angles in (("lidar", self.lidar_rad), ("imu", self.imu_rad))
            for axis, angle in zip(("roll", "pitch", "yaw"), angles)
        }
        steered = {f"steer_{n}_offset_rad": angle for n, angle in enumerate(self.steer_rad, 1)}
        return replace(
            drawing,
            wheel_radius_m=drawing.wheel_radius_m * self.wheel_radius_ratio,
            lidar_x_m=drawing.lidar_x_m + x,
            lidar_y_m=drawing.lidar_y_m + y,
            lidar_z_m=drawing.lidar_z_m + z,
            **mounted,
            **steered,
        )


def drawn(seed: int) -> BuildErrors:
    """Random errors of careful assembly, 1 sigma.

    Wheels 1 %, steering and scanner 1.5 degrees, inertial sensor 1 degree, scanner's place 5 mm, but 1 mm sideways,
    since that is taken from the drawing.
    """
    rng = generator([seed, 0xB01])

    def angles(count: int, sigma_deg: float) -> tuple[float, ...]:
        return tuple((math.radians(sigma_deg) * rng.standard_normal(count)).tolist())

    return BuildErrors(
        1.0 + 0.01 * float(rng.standard_normal()),
        angles(4, 1.5),  # type: ignore[arg-type]
        tuple((np.array([0.005, 0.001, 0.005]) * rng.standard_normal(3)).tolist()),
        angles(3, 1.5),
        angles(3, 1.0),
    )
