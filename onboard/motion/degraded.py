"""Driving with a wheel whose steering or drive has failed.

              * turning centre               Steering fixed at phi on the wheel at (a, b): its hub moves along its rim,
               \\                             without side slip, exactly while the turning centre lies on its axle's
        axle    \\                            line. As a rule for the twist, with
        line     \\
             1 ===\\===== 4                        n = (-sin phi, cos phi, a cos phi + b sin phi):
              |    o     |
             2 ========= 3                        n . (v_x, v_y, omega) = 0

Two methods:

1. *Roll*: only twists with n . t = 0 (`rolling`). Needs no force. The fixed wheel is then a unicycle: the body trails
   it with a yaw that is phi off the direction of motion, over ground whose poses the planner has not checked.
2. *Drag*: the wanted twist unchanged; the other wheels pull the fixed one sideways. Path, yaw and turns on the spot are
   unchanged; needs a force of up to the friction of one wheel.

On the bench dragging follows a path to 5 cm at any angle while there is enough force, so dragging is the default. Where
`load_ratio` shows that the wheels would only dig, on a slope, the rover rolls. A stuck drive can only be dragged.
"""

from __future__ import annotations

import math

from onboard.config import Rover
from onboard.motion.kinematics import wheel_places
from onboard.motion.wheel_health import DriveHealth, Wheels
from onboard.native.elementary import cos, hypot, sin, tan, total
from onboard.records import Twist

SOIL_FRICTION = 0.7  # tangent of the friction angle of nominal soil
DRAG_LIMIT = 0.66  # of the load ratio: on the bench the rover still moves at 0.66 and digs in at 0.68
STUCK_SPEED_RATIO = 0.7  # ratio of the speed while a drive is dragged: a wheel that catches is detected in time


def constraint(a_m: float, b_m: float, angle_rad: float) -> tuple[float, float, float]:
    """Normal n of the wheel at (a, b) with its steering fixed: its side slip is n . (v_x, v_y, omega), m/s."""
    c, s = cos(angle_rad), sin(angle_rad)
    return -s, c, a_m * c + b_m * s


def rolling(twist: Twist, wheels: Wheels, rover: Rover) -> Twist:
    """Return the closest twist for which each wheel of fixed steering rolls without side slip; unchanged if all steer.

    Closest: the least sum of squares over the four hubs' changes of velocity, which weighs omega by the wheels' arm.
    With three fixed wheels whose axles do not meet in one point the result is zero motion.
    """
    arm = hypot(rover.half_wheelbase_m, rover.half_track_m)
    normals: list[list[float]] = []
    for (a, b), health in zip(wheel_places(rover), wheels):
        if health.steer_fixed_rad is None:
            continue
        n1, n2, n3 = constraint(a, b, health.steer_fixed_rad)
        normal = _without([n1, n2, n3 / arm], normals)
        size = math.sqrt(total(part * part for part in normal))
        if size > 1e-9:  # otherwise it adds no new constraint
            normals.append([part / size for part in normal])
    if not normals:
        return twist
    vx, vy, rim = _without([twist.vx_mps, twist.vy_mps, twist.yaw_radps * arm], normals)
    return Twist(vx, vy, rim / arm)


def _without(vector: list[float], normals: list[list[float]]) -> list[float]:
    """Remove the components of a vector along orthonormal vectors."""
    for normal in normals:
        part = total(p * q for p, q in zip(vector, normal))
        vector = [p - part * q for p, q in zip(vector, normal)]
    return vector


def load_ratio(twist: Twist, wheels: Wheels, rover: Rover, tilt_rad: float) -> float:
    """Ratio of the force that a motion needs to the force that the wheels can push with.

    Above 1 the motion is impossible; inf if no wheel pushes.
    Each wheel carries a quarter of the weight and pushes or resists with SOIL_FRICTION times it: a sound wheel pushes
    along its motion, one of fixed steering pushes along its rim and resists sideways, a stuck drive resists. The slope
    counts as climbed straight up.
    """
    needed, pushing = 4.0 * tan(tilt_rad) / SOIL_FRICTION, 0.0
    for (a, b), health in zip(wheel_places(rover), wheels):
        u, w = twist.vx_mps - twist.yaw_radps * b, twist.vy_mps + twist.yaw_radps * a
        speed, fixed = hypot(u, w), health.steer_fixed_rad
        across = 0.0
        if fixed is not None and speed > 0.0:
            across = abs(w * cos(fixed) - u * sin(fixed)) / speed
        if health.drive is DriveHealth.STUCK:
            needed += 1.0
            continue
        needed += across
        if health.drive is DriveHealth.GOOD:
            pushing += math.sqrt(max(0.0, 1.0 - across * across))
    return needed / pushing if pushing > 0.0 else math.inf


def fixed_wheel(wheels: Wheels, rover: Rover) -> tuple[float, float, float] | None:
    """(a_m, b_m, angle_rad) of the one wheel whose steering is fixed; None if none or more than one is."""
    found = [
        (a, b, health.steer_fixed_rad)
        for (a, b), health in zip(wheel_places(rover), wheels)
        if health.steer_fixed_rad is not None
    ]
    return found[0] if len(found) == 1 else None


def speed_ratio(wheels: Wheels) -> float:
    """Ratio of the speed to drive at with these wheels to the usual speed."""
    return STUCK_SPEED_RATIO if any(health.drive is DriveHealth.STUCK for health in wheels) else 1.0
