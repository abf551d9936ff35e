"""What of each wheel still works: found by the monitors, obeyed by kinematics and odometry."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Drive(Enum):
    """A wheel's drive."""

    GOOD = "good"
    FREE = "turns without torque: it rolls along and pushes nothing"
    STUCK = "does not turn: it is dragged"


@dataclass(frozen=True, slots=True)
class WheelHealth:
    """Of one wheel. steer_fixed_rad: the angle at which its steering is stuck, None where it steers.

    encoder: whether its rate may be believed.
    """

    drive: Drive = Drive.GOOD
    steer_fixed_rad: float | None = None
    encoder: bool = True

    @property
    def tells_way(self) -> bool:
        """Whether angle and encoder say where the hub went: not of a wheel that is dragged, along or sideways."""
        return self.encoder and self.drive is not Drive.STUCK and self.steer_fixed_rad is None


Wheels = tuple[WheelHealth, WheelHealth, WheelHealth, WheelHealth]  # 1 to 4, as protocol.conventions.WHEELS
SOUND: Wheels = (WheelHealth(),) * 4
