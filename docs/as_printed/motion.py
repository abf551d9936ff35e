"""Eq. 29 to 40 as printed; the flight versions are `onboard.motion.kinematics` and `onboard.motion.follower`.

Angles are radians and not wrapped, as the equations leave them. Wheel i stands at (+-l, +-d) as in Eq. 31 and 32.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

WHEEL_SIGNS = ((1, 1), (-1, 1), (-1, -1), (1, -1))


@dataclass(frozen=True, slots=True)
class Vehicle:
    """Dimensions of the vehicle.

    l_m: half wheelbase l.
    d_m: half track d.
    r_m: wheel radius r.
    """

    l_m: float = 0.375
    d_m: float = 0.25
    r_m: float = 0.10


@dataclass(frozen=True, slots=True)
class BodyMotion:
    """Motion of the body.

    v_mps: speed v_0 along its heading.
    theta_rad: heading theta_0.
    rate_radps: rate of the heading.
    """

    v_mps: float
    theta_rad: float
    rate_radps: float


def eq_29(x_mps: float, y_mps: float, phi_rad: float) -> float:
    """Sideways speed that Eq. 29 (body, phi_0 = theta_0) and 30 (wheel, phi_i = theta_0 + delta_i) require to be 0."""
    return x_mps * math.sin(phi_rad) - y_mps * math.cos(phi_rad)


def offset_rates_mps(wheel: int, going: BodyMotion, vehicle: Vehicle) -> tuple[float, float]:
    """Rates of X_i and Y_i (Eq. 31, 32), wheels 0 to 3."""
    a, b = WHEEL_SIGNS[wheel][0] * vehicle.l_m, WHEEL_SIGNS[wheel][1] * vehicle.d_m
    sine, cosine = math.sin(going.theta_rad), math.cos(going.theta_rad)
    return (-a * sine - b * cosine) * going.rate_radps, (a * cosine - b * sine) * going.rate_radps


def eq_34(wheel: int, going: BodyMotion, vehicle: Vehicle) -> float:
    """Steering angle delta_i, radians. Raises ZeroDivisionError if the denominator is 0."""
    dx, dy = offset_rates_mps(wheel, going, vehicle)
    y, x = going.v_mps * math.sin(going.theta_rad) - dy, going.v_mps * math.cos(going.theta_rad) - dx
    return math.atan(y / x) - going.theta_rad


def eq_35(hub_mps: float, steer_rad: float, vehicle: Vehicle) -> float:
    """omega_i of a wheel whose hub moves at v_i, rad/s."""
    return hub_mps * math.cos(steer_rad) / vehicle.r_m


def eq_37(wheel: int, going: BodyMotion, steer_rad: float, vehicle: Vehicle) -> float:
    """omega_i of a wheel steered to delta_i, rad/s. Raises ZeroDivisionError if cos or sin of phi_i is 0."""
    dx, dy = offset_rates_mps(wheel, going, vehicle)
    phi = going.theta_rad + steer_rad
    if going.theta_rad <= math.pi / 4:
        moves, share = going.v_mps * math.cos(going.theta_rad) + dx, math.cos(phi)
    else:
        moves, share = going.v_mps * math.sin(going.theta_rad) + dy, math.sin(phi)
    return moves * math.cos(steer_rad) / (vehicle.r_m * share)


def eq_38_40(gain_hz: float, carrot_rad: float, steer_rad: float) -> float:
    """Rate of turn K_p (theta_d - delta_i), rad/s: the heading of Eq. 39 is a wheel's angle, not the body's."""
    return gain_hz * (carrot_rad - steer_rad)
