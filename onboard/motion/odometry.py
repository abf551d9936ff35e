"""Wheel odometry: the least-squares inverse of `kinematics`, with its residual.

Each wheel measures the motion of its hub: u = s * cos(delta), w = s * sin(delta), s = r * (encoder's increment). With

    u_i = v_x - omega * b_i,    w_i = v_y + omega * a_i

four wheels give 8 equations for 3 unknowns. The normal equations are solved in closed form, for any two or more wheels:

    omega = (m - (A * W - B * U) / n) / (Q - (A^2 + B^2) / n),  v_x = (U + omega * B) / n,  v_y = (W - omega * A) / n
    U, W, A, B = sums of u, w, a, b;  m = sum of (a * w - b * u);  Q = sum of (a^2 + b^2)

The equations are linear, so increments of single ticks add up to the right total even if a frame came a tick late. The
*residual* is the root mean square speed by which the wheels disagree: slip, or a wheel that does not steer.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from onboard.config import Rover
from onboard.motion.kinematics import wheel_places
from onboard.motion.wheel_health import SOUND, Wheels
from onboard.native.elementary import cos, sin, total
from onboard.records import Twist, WheelState

WINDOW_NS = 200_000_000  # twist and residual are means over this
STANDING_MPS = 0.001  # mean of the window below which the rover stands (encoders may flicker by a step)
STANDING_STEP_M = 0.0002  # and in the newest tick
STANDING_STEER_RAD = 0.02  # steering of all wheels in the window: wheels that steer may shift the rover
WRAP_GUARD_RAD = math.pi  # a jump of the encoder larger than this in one tick is not motion


class OdometryStep(NamedTuple):
    """Motion since the last call, in base_link axes.

    dx_m, dy_m, dyaw_rad: increments.
    twist, residual_mps: mean twist and residual of the window.
    wheels: number of wheels used; below 2 the increments are 0 and without meaning.
    standing: True if the rover neither drives nor steers.
    rolled_m: mean distance rolled by the rims, turning on the spot included.
    """

    dx_m: float
    dy_m: float
    dyaw_rad: float
    twist: Twist
    residual_mps: float
    wheels: int
    standing: bool
    rolled_m: float = 0.0


class Odometry:
    """Wheel odometry from encoder increments. A wheel that is None, stale or unfit is left out and restarts later."""

    def __init__(self, rover: Rover, stale_ns: int = 30_000_000) -> None:
        self._places = wheel_places(rover)
        self._radius_m = rover.wheel_radius_m
        self._stale_ns = stale_ns
        self._last: list[WheelState | None] = [None] * 4
        self._hubs: list[list[float] | None] = [None] * 4  # motion of each hub in the window; None: not in all of it
        self._window_ns = -1
        self._twist = Twist()
        self._residual_mps = 0.0
        self._slow = False
        self._steers_rad: list[float | None] = [None] * 4  # at the window's start; None: unknown

    def update(self, wheels: Sequence[WheelState | None], now_ns: int, health: Wheels = SOUND) -> OdometryStep:
        """Process the wheels' newest states and return the motion since the last call.

        health: a wheel that does not measure its hub's motion (`tells_way`) is left out.
        """
        n, moved = 0, False
        sum_u = sum_w = sum_a = sum_b = sum_m = sum_q = rolled = 0.0
        for k, state in enumerate(wheels):
            last = self._last[k]
            if state is None or state.age_ns > self._stale_ns or not health[k].tells_way:
                self._last[k] = self._hubs[k] = None
                continue
            self._last[k] = state
            if last is None or abs(state.position_rad - last.position_rad) > WRAP_GUARD_RAD:
                self._hubs[k] = None
                continue
            n += 1
            a, b = self._places[k]
            sum_a += a
            sum_b += b
            sum_q += a * a + b * b
            turned = state.position_rad - last.position_rad
            if turned == 0.0:
                continue
            moved = True
            rolled += abs(turned) * self._radius_m
            s, delta = turned * self._radius_m, 0.5 * (state.steer_rad + last.steer_rad)
            u, w = s * cos(delta), s * sin(delta)
            sum_u += u
            sum_w += w
            sum_m += a * w - b * u
            hub = self._hubs[k]
            if hub is not None:
                hub[0] += u
                hub[1] += w
        dx = dy = dyaw = 0.0
        if moved and n >= 2:
            dx, dy, dyaw = solve(n, (sum_u, sum_w, sum_m), (sum_a, sum_b, sum_q))
        if now_ns - self._window_ns >= WINDOW_NS:
            self._close_window(now_ns)
        standing = self._slow and abs(dx) + abs(dy) + abs(dyaw) < STANDING_STEP_M
        return OdometryStep(dx, dy, dyaw, self._twist, self._residual_mps, n, standing, rolled / max(n, 1))

    def _close_window(self, now_ns: int) -> None:
        if self._window_ns >= 0:
            seconds = (now_ns - self._window_ns) * 1e-9
            hubs = [None if hub is None else (hub[0] / seconds, hub[1] / seconds) for hub in self._hubs]
            found = body_twist(hubs, self._places)
            self._twist, self._residual_mps = found if found is not None else (Twist(), 0.0)
            vx, vy, yaw = self._twist
            slow = abs(vx) + abs(vy) + abs(yaw) < STANDING_MPS
            self._slow = found is not None and slow and self._steered_rad() < STANDING_STEER_RAD
        self._window_ns = now_ns
        self._hubs = [None if last is None else [0.0, 0.0] for last in self._last]
        self._steers_rad = [None if last is None else last.steer_rad for last in self._last]

    def _steered_rad(self) -> float:
        """Steering of all wheels from start to end of the window, because the noise of single ticks would add up."""
        return total(
            abs(last.steer_rad - before)
            for last, before in zip(self._last, self._steers_rad)
            if last is not None and before is not None
        )


def solve(n: int, right: tuple[float, float, float], left: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return (v_x, v_y, omega) from the sums U, W, m and A, B, Q of n >= 2 wheels (see the head of this file)."""
    sum_u, sum_w, sum_m = right
    sum_a, sum_b, sum_q = left
    yaw = (sum_m - (sum_a * sum_w - sum_b * sum_u) / n) / (sum_q - (sum_a * sum_a + sum_b * sum_b) / n)
    return (sum_u + yaw * sum_b) / n, (sum_w - yaw * sum_a) / n, yaw


def body_twist(
    hubs_mps: Sequence[tuple[float, float] | None], places_m: Sequence[tuple[float, float]]
) -> tuple[Twist, float] | None:
    """Least-squares twist and residual (m/s, root mean square over the wheels) from the velocities of the hubs.

    A wheel that is None is left out. Returns None if fewer than two wheels are left.
    """
    used = [(a, b, hub[0], hub[1]) for (a, b), hub in zip(places_m, hubs_mps) if hub is not None]
    n = len(used)
    if n < 2:
        return None
    right = (total(r[2] for r in used), total(r[3] for r in used), total(r[0] * r[3] - r[1] * r[2] for r in used))
    left = (total(r[0] for r in used), total(r[1] for r in used), total(r[0] * r[0] + r[1] * r[1] for r in used))
    vx, vy, yaw = solve(n, right, left)
    rests = ((u - vx + yaw * b, w - vy - yaw * a) for a, b, u, w in used)
    square = total(x * x + y * y for x, y in rests)
    return Twist(vx, vy, yaw), math.sqrt(square / n)
