"""Speed limit of the rover: one rule for all path following laws."""

from __future__ import annotations

import math
from typing import NamedTuple

from onboard.config import Motion

GENTLE_RAD, STEEP_RAD = math.radians(10.0), math.radians(20.0)  # slopes of first slowing and of lowest speed
STEEP_RATIO = 0.6  # slip more than doubles between the two angles: the wheels dig less when they turn slowly
NEAR_M = 0.2  # distance to a blocked pose below which the rover slows down
TOUCHING_RATIO = 0.6
FULL_SPEED_RADIUS_M = 0.5  # in tighter curves the speed falls with the radius


class Conditions(NamedTuple):
    """Conditions of the path.

    slope_rad: slope of the ground.
    clearance_m: distance to the nearest blocked pose, inf if none is near.
    curvature_pm: curvature, 1/m.
    """

    slope_rad: float = 0.0
    clearance_m: float = math.inf
    curvature_pm: float = 0.0


def speed_limit(conditions: Conditions, motion: Motion) -> float:
    """Speed limit, m/s: cruise speed, less on slopes, near obstacles and in curves.

    In a curve the yaw rate stays within its limit.
    """
    slope, clearance, curvature = abs(conditions.slope_rad), conditions.clearance_m, abs(conditions.curvature_pm)
    steep = min(1.0, max(0.0, (slope - GENTLE_RAD) / (STEEP_RAD - GENTLE_RAD)))
    near = 1.0 - min(1.0, max(0.0, clearance / NEAR_M))
    ratio = (1.0 - (1.0 - STEEP_RATIO) * steep) * (1.0 - (1.0 - TOUCHING_RATIO) * near)
    if curvature * FULL_SPEED_RADIUS_M > 1.0:
        ratio /= curvature * FULL_SPEED_RADIUS_M
    speed = motion.cruise_mps * ratio
    return min(speed, motion.yaw_rate_limit_radps / curvature) if curvature > 0.0 else speed
