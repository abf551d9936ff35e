"""Inverse kinematics of four steered wheels: angles, rates, and steering before driving (replaces Eq. 34, 35, 37).

            x, v_x
              ^                        wheel i stands at (a_i, b_i) = (+-l, +-d)
      1 ======|====== 4                u_i = v_x - omega * b_i        speed of its hub along x
        \\     |     /                  w_i = v_y + omega * a_i        and along y
         |    |    |                   delta_i = atan2(w_i, u_i)      steering angle, counter-clockwise
  y <----|----o    |   2l              rate_i  = hypot(w_i, u_i) / r
  v_y    |  omega  |
        /           \\                 delta_i and delta_i +- pi, with the rate's sign turned, are the same motion:
      2 ============= 3                the one within the steering range nearest to the measured angle is taken.
              2d

1. A wheel slower than 1 mm/s keeps its last angle: its direction is noise.
2. If a wheel is too fast, all slow down: one factor on the whole twist, so the centre of turning stays.
3. Steer before drive: while any wheel is further than `steer_hold_rad` from its angle all wheels stand, until all are
   within `steer_release_rad`; in between the rates are scaled by the smallest cosine of the errors.
4. A wheel whose steering is fixed is commanded to its present angle, turns as its hub moves along it, and is not waited
   for. A stuck drive is commanded to stand (its motor would only heat up); a free one is commanded to roll along, like
   a sound one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from onboard.config import Motion, Rover
from onboard.motion.wheel_health import SOUND, DriveHealth, Wheels
from onboard.native.elementary import atan2, cos, hypot, sin
from onboard.records import Twist, WheelCommand, WheelMode, WheelState
from protocol.conventions import WHEEL_SIGNS, wrap_rad

SLOWEST_MPS = 0.001

WheelCommands = tuple[WheelCommand, WheelCommand, WheelCommand, WheelCommand]


def wheel_places(rover: Rover) -> tuple[tuple[float, float], ...]:
    """(a_m, b_m) of wheels 1 to 4 in base_link (Eq. 31, 32)."""
    return tuple((sa * rover.half_wheelbase_m, sb * rover.half_track_m) for sa, sb in WHEEL_SIGNS)


def wheel_commands(
    twist: Twist,
    measured: Sequence[WheelState | None],
    previous: Sequence[WheelCommand],
    rover: Rover,
    motion: Motion,
    held: bool,
    wheels: Wheels = SOUND,
) -> tuple[WheelCommands, bool]:
    """Return commands for wheels 1 to 4, and True if the drive waits for the steering (pass it to the next call).

    measured: newest state of each wheel; for None (unknown) its last commanded angle is used.
    previous: last commands.
    held: second result of the last call.
    wheels: state of each wheel (rule 4).
    """
    vx, vy, yaw = twist
    radius = rover.wheel_radius_m
    half_length, half_track = rover.half_wheelbase_m, rover.half_track_m
    angles, rates, worst, fastest = [], [], 0.0, rover.wheel_rate_limit_radps
    for (sign_a, sign_b), state, last, health in zip(WHEEL_SIGNS, measured, previous, wheels):
        u = vx - yaw * sign_b * half_track
        w = vy + yaw * sign_a * half_length
        speed = math.sqrt(u * u + w * w)
        now = last.steer_rad if state is None else state.steer_rad
        if health.steer_fixed_rad is not None:
            angle = now = health.steer_fixed_rad
            rate = (u * cos(angle) + w * sin(angle)) / radius
        elif speed < SLOWEST_MPS:
            angle = last.steer_rad
            rate = (u * cos(angle) + w * sin(angle)) / radius
        else:
            angle, sign = nearest_steering(atan2(w, u), now, rover.steer_limit_rad)
            rate = sign * speed / radius
        if health.drive is DriveHealth.STUCK:
            rate = 0.0
        angles.append(angle)
        rates.append(rate)
        worst = max(worst, abs(angle - now))
        fastest = max(fastest, abs(rate))
    held = worst > (motion.steer_release_rad if held else motion.steer_hold_rad)
    factor = 0.0 if held else cos(worst) * rover.wheel_rate_limit_radps / fastest
    run = WheelMode.RUN
    one, two, three, four = (WheelCommand(run, angle, rate * factor) for angle, rate in zip(angles, rates))
    return (one, two, three, four), held


def nearest_steering(direction_rad: float, measured_rad: float, limit_rad: float) -> tuple[float, int]:
    """Return (steering angle, sign of the rate) that moves a wheel in a direction with the least steering.

    With a range of less than a quarter turn to each side some directions cannot be reached: the angle is then limited
    to the range, and the wheel drags.
    """
    turned = direction_rad - math.pi if direction_rad > 0.0 else direction_rad + math.pi
    ahead = abs(direction_rad) <= limit_rad
    if ahead != (abs(turned) <= limit_rad):
        return (direction_rad, 1) if ahead else (turned, -1)
    first, second = (direction_rad, 1), (turned, -1)
    if not ahead:
        first = (math.copysign(min(abs(direction_rad), limit_rad), direction_rad), 1)
        second = (math.copysign(min(abs(turned), limit_rad), turned), -1)
        missed = [abs(wrap_rad(first[0] - direction_rad)), abs(wrap_rad(second[0] - turned))]
        return first if missed[0] <= missed[1] else second
    return first if abs(direction_rad - measured_rad) <= abs(turned - measured_rad) else second


def stopped(previous: Sequence[WheelCommand]) -> WheelCommands:
    """Commands for standing: HOLD, no rate, steering angles unchanged."""
    one, two, three, four = (WheelCommand(WheelMode.HOLD, last.steer_rad, 0.0) for last in previous)
    return one, two, three, four


def wheel_angles(twist: Twist, rover: Rover) -> tuple[float | None, ...]:
    """Direction of motion of each hub, in (-pi, pi]; None if the hub is slower than 1 mm/s."""
    vx, vy, yaw = twist
    half_length, half_track = rover.half_wheelbase_m, rover.half_track_m
    found: list[float | None] = []
    for sign_a, sign_b in WHEEL_SIGNS:
        u, w = vx - yaw * sign_b * half_track, vy + yaw * sign_a * half_length
        found.append(atan2(w, u) if hypot(u, w) >= SLOWEST_MPS else None)
    return tuple(found)
