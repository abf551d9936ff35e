"""Path following laws: pose of the rover relative to its leg to twist (Eq. 38 to 40).

`pose-carrot`: the velocity points at the carrot in body axes (crab and backwards allowed); the body turns to the path's
own yaw, read v / K_p ahead, which removes the lag.

`carrot`: the chapter's law without its mixing of body heading and wheel angle (Eq. 38 to 40 corrected): the body drives
ahead at cruise speed and turns by omega = clip(K_p * wrap(bearing - theta)). For a small distance y from a straight
path y'' + K_p y' + (K_p v / L) y = 0: damping 1/2 sqrt(K_p L / v). It drives the path as one leg, cuts corners,
and uses the stations' yaw only at the end.

`pure-pursuit`: the arc through the carrot that is tangent to the body's heading, omega = 2 v sin(alpha) / L, driven
backwards where the path's yaw points back, slower in tight arcs (regulated). Damping 1/sqrt(2) at any speed.

`roll` cannot be configured: it is the law of a rover with one fixed steering that may not be dragged. With h the
wheel's heading, (ahead, across) its place in axes along h, e the distance to the left and s the path length, per metre

    e' = sin(h - psi) - ahead * h',   h' = k - e / l^2 - (2 / l + ahead / l^2) * (h - h_0)
    on a bend kappa of the way:       sin(h_0 - psi) = ahead * kappa,   k = kappa / (cos(h_0 - psi) - across * kappa)

so the characteristic is (x + 1/l)^2: critically damped within l. The wheel trails (ahead <= 0): base_link then leads it
like the drawbar of a cart. A fixed wheel in front throws base_link off by (1 + ahead/l)^2 l/e for each radian that it
has to turn, so such a rover drives with its other end in front.

Bearings and distances are taken in the plane on which the rover stands: on a slope they differ from the map's.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from onboard.config import Motion
from onboard.motion.route import Leg
from onboard.motion.speed import Conditions, speed_limit
from onboard.native.elementary import asin, atan2, cos, hypot, sin
from onboard.records import Pose, Twist
from protocol.conventions import wrap_rad

ROLL_M = 0.35  # l of the rolling law
BESIDE_M = 0.1  # a wheel this little ahead or behind may roll either way
STEEPEST_SINE = 0.9
TIGHTEST_PM = 2.5  # curvature of the fixed wheel's path


class Sight(NamedTuple):
    """Input of a law.

    leg: the leg.
    along_m: path length of the rover along the leg.
    carrot_m: path length of the carrot along the leg.
    left_m: distance to the left of the leg.
    pose: pose of the rover.
    speed_mps: speed limit now.
    """

    leg: Leg
    along_m: float
    carrot_m: float
    left_m: float
    pose: Pose
    speed_mps: float


class Aim(NamedTuple):
    """Output of a law: the twist, and the heading error. A large error stops the rover for a turn on the spot."""

    twist: Twist
    error_rad: float


def in_plane(pose: Pose, dx_m: float, dy_m: float) -> tuple[float, float]:
    """Project a step in the map onto the rover's plane along the vertical; return (ahead, left) in body axes."""
    sy, cy = sin(pose.yaw_rad), cos(pose.yaw_rad)
    sp, cp, sr, cr = (f(a) for a in (pose.pitch_rad, pose.roll_rad) for f in (sin, cos))
    ahead, left = cy * dx_m + sy * dy_m, cy * dy_m - sy * dx_m
    w = left / cr
    return (ahead - sp * sr * w) / cp, w


def _carrot(sight: Sight) -> tuple[float, float]:
    x, y, _ = sight.leg.at(sight.carrot_m)
    return in_plane(sight.pose, x - sight.pose.x_m, y - sight.pose.y_m)


def _clip(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))


def pose_carrot(sight: Sight, motion: Motion) -> Aim:
    """Law `pose-carrot`: towards the carrot, with the path's yaw."""
    ahead, left = _carrot(sight)
    yaw = sight.leg.at(sight.along_m + sight.speed_mps / motion.heading_gain_hz)[2]
    error = wrap_rad(yaw - sight.pose.yaw_rad)
    speed = sight.speed_mps * max(0.3, 1.0 - abs(error) / motion.point_turn_start_rad)
    direction, rate = atan2(left, ahead), _clip(motion.heading_gain_hz * error, motion.yaw_rate_limit_radps)
    return Aim(Twist(speed * cos(direction), speed * sin(direction), rate), error)


def chapter_carrot(sight: Sight, motion: Motion) -> Aim:
    """Law `carrot`: straight ahead, turning to the carrot: Eq. 39 with the body's heading."""
    ahead, left = _carrot(sight)
    error = atan2(left, ahead)
    rate = _clip(motion.heading_gain_hz * error, motion.yaw_rate_limit_radps)
    return Aim(Twist(sight.speed_mps, 0.0, rate), error)


def pure_pursuit(sight: Sight, motion: Motion) -> Aim:
    """Law `pure-pursuit`: the arc through the carrot, ahead or backwards."""
    ahead, left = _carrot(sight)
    way = sight.leg.bearing_rad(sight.along_m)
    sense = -1.0 if abs(wrap_rad(sight.leg.at(sight.along_m)[2] - way)) > math.pi / 2 else 1.0
    error = atan2(sense * left, sense * ahead)
    distance = hypot(ahead, left)
    curvature = 2.0 * sin(error) / distance if distance > 0.0 else 0.0
    speed = min(sight.speed_mps, speed_limit(Conditions(curvature_pm=curvature), motion))
    return Aim(Twist(sense * speed, 0.0, curvature * speed), error)


def roll(sight: Sight, wheel: tuple[float, float, float]) -> Aim:
    """Law `roll`: roll the wheel (a_m, b_m, angle_rad) of fixed steering and return base_link to the leg."""
    a, b, angle = wheel
    here = sight.leg.bearing_rad(sight.along_m)
    place = a * cos(angle) + b * sin(angle)
    backwards = abs(wrap_rad(sight.pose.yaw_rad + angle - here)) > math.pi / 2 if abs(place) < BESIDE_M else place > 0.0
    if backwards:
        angle, place = angle + math.pi, -place
    c, s = cos(angle), sin(angle)
    off = wrap_rad(sight.pose.yaw_rad + angle - here)
    turned = asin(_clip(wrap_rad(sight.leg.bearing_rad(sight.along_m + place) - here), STEEPEST_SINE))
    error = wrap_rad(turned - off)
    bend = sight.leg.curvature_pm(sight.along_m + place)
    curvature = bend / max(0.3, cos(turned) - bend * (b * c - a * s))
    curvature += (2.0 / ROLL_M + place / (ROLL_M * ROLL_M)) * error - sight.left_m / (ROLL_M * ROLL_M)
    rate = sight.speed_mps * _clip(curvature, TIGHTEST_PM)
    return Aim(Twist(sight.speed_mps * c + rate * b, sight.speed_mps * s - rate * a, rate), error)


Law = Callable[[Sight, Motion], Aim]
LAWS: dict[str, Law] = {"pose-carrot": pose_carrot, "carrot": chapter_carrot, "pure-pursuit": pure_pursuit}
