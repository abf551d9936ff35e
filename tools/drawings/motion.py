"""Pictures of docs/motion.md, from the flight code."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from onboard.config import Motion, Rover
from onboard.motion.degraded import rolling
from onboard.motion.follower import Follower
from onboard.motion.kinematics import nearest_steering, wheel_angles, wheel_places
from onboard.motion.wheel_health import SOUND, WheelHealth
from onboard.records import F64, Path, Pose, Twist
from pictures.wheels import Turning, carrots, turning

ROVER = Rover()
FIXED_RAD = math.radians(-25.0)
ARC = Twist(0.12, 0.0, 0.2)
START_M = 0.05
LENGTH_M = 8.0


def _turning(title: str, twist: Twist, fixed: int | None = None) -> Turning:
    """Steering angles of the wheels for a twist, each turned as little as possible."""
    angles = [nearest_steering(angle or 0.0, 0.0, ROVER.steer_limit_rad)[0] for angle in wheel_angles(twist, ROVER)]
    return Turning(title, np.array(wheel_places(ROVER)), np.array(angles), twist, fixed)


def turns() -> Figure:
    """An arc, a crab, a point turn, and the remaining arc with wheel 1 fixed."""
    wheels = (WheelHealth(steer_fixed_rad=FIXED_RAD), *SOUND[1:])
    left = rolling(ARC, wheels, ROVER)
    return turning(
        [
            _turning("an arc", ARC),
            _turning("a crab: axles side by side", Twist(0.1, 0.06, 0.0)),
            _turning("a turn on the spot", Twist(0.0, 0.0, 0.2)),
            _turning("wheel 1 fixed: the closest arc that rolls", left, fixed=0),
        ]
    )


def beside(**settings: Any) -> F64:
    """Path length and distance (k, 2), m, of a rover without slip that starts 5 cm off a straight path."""
    follower = Follower(ROVER, Motion(**settings))
    path = Path(np.column_stack([np.linspace(0.0, 40.0, 801), np.zeros(801), np.zeros(801)]))
    x, y, yaw, rows = 0.0, START_M, 0.0, []
    while x < LENGTH_M:
        rows.append((x, y))
        vx, vy, rate = follower.twist(path, Pose(x, y, yaw_rad=yaw), len(rows) * 50_000_000)
        middle = yaw + 0.025 * rate
        x += 0.05 * (vx * math.cos(middle) - vy * math.sin(middle))
        y += 0.05 * (vx * math.sin(middle) + vy * math.cos(middle))
        yaw += 0.05 * rate
    return np.array(rows)


def overshoot() -> Figure:
    """Figure 11b: the chapter's carrot at three look-aheads, and the laws at the rover's own settings."""
    ways = []
    for ahead_m in (1.0, 0.5, 0.2):
        line = beside(law="carrot", heading_gain_hz=0.22, look_ahead_m=ahead_m)
        ways.append((f"L = {ahead_m:g} m: overshoot {-line[:, 1].min() / START_M:.3f}", line))
    return carrots(ways, [(law, beside(law=law)) for law in ("carrot", "pure-pursuit", "pose-carrot")])


DRIVEN: dict[str, Callable[[], Figure]] = {"motion-turning.png": turns, "motion-overshoot.png": overshoot}
