"""Health of each wheel: set by the monitors, used by kinematics and odometry."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class DriveHealth(Enum):
    """State of a wheel's drive."""

    GOOD = "good"
    FREE = "turns without torque: it rolls along and pushes nothing"
    STUCK = "does not turn: it is dragged"


@dataclass(frozen=True, slots=True)
class WheelHealth:
    """Health of one wheel.

    drive: state of the drive.
    steer_fixed_rad: angle at which the steering is stuck, None if it steers.
    encoder: True if its rate is valid.
    """

    drive: DriveHealth = DriveHealth.GOOD
    steer_fixed_rad: float | None = None
    encoder: bool = True

    @property
    def tells_way(self) -> bool:
        """True if angle and encoder measure the hub's motion; False for a wheel that is dragged, along or sideways."""
        return self.encoder and self.drive is not DriveHealth.STUCK and self.steer_fixed_rad is None


Wheels = tuple[WheelHealth, WheelHealth, WheelHealth, WheelHealth]  # 1 to 4, as protocol.conventions.WHEELS
SOUND: Wheels = (WheelHealth(),) * 4
