"""One motion of the drive: steer, move by an amount, stop at its end, stand for a while."""

from __future__ import annotations

import math
from collections.abc import Sequence

from onboard.bringup.calibrate.plan import DriveStep
from onboard.config import Config
from onboard.motion import odometry
from onboard.motion.kinematics import stopped, wheel_commands
from onboard.records import WheelCommand, WheelState
from protocol.conventions import TICK_NS

REST_NS = 1_000_000_000
RAMP_RADPS2 = 1.0  # acceleration of the drives
TICK_S = TICK_NS * 1e-9


class Roll:
    """Motion run by `tick` until `done`. A distance is measured by the wheels, a turn by the gyro."""

    def __init__(self, step: DriveStep, config: Config, orders: Sequence[WheelCommand]) -> None:
        self.orders: tuple[WheelCommand, ...] = tuple(orders)
        self.done = False
        self._step, self._config = step, config
        self._gone = 0.0
        self._held = self._arrived = False
        self._still_ns = 0
        rim_mps = step.speed * (_reach_m(config) if step.turns else 1.0)
        self._brake = 0.5 * step.speed * rim_mps / config.rover.wheel_radius_m / RAMP_RADPS2

    @property
    def progress_ratio(self) -> float:
        """Share of the amount."""
        return min(1.0, self._gone / self._step.amount)

    def tick(self, wheels: Sequence[WheelState | None], motion: odometry.OdometryStep, turn_radps: float) -> None:
        """Compute new orders from the motion of the wheels and the rover's yaw rate."""
        self._gone += abs(turn_radps) * TICK_S if self._step.turns else math.hypot(motion.dx_m, motion.dy_m)
        self._arrived = self._arrived or self._gone >= self._step.amount - self._brake
        if not self._arrived:
            self.orders, self._held = wheel_commands(
                self._step.twist, wheels, self.orders, self._config.rover, self._config.motion, self._held
            )
            return
        self.orders = stopped(self.orders)
        self._still_ns = self._still_ns + TICK_NS if motion.standing else 0
        self.done = self._still_ns >= REST_NS


def _reach_m(config: Config) -> float:
    return math.hypot(config.rover.half_wheelbase_m, config.rover.half_track_m)
