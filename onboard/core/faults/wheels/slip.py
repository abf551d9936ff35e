"""SLIP_HIGH and NOT_MOVING: the wheels' odometry against gyro, accelerometer and registrations.

    shortfall   1 - (the body's speed along the odometry's, by `body_speed`) / (the odometry's speed); turning on the
                spot 1 - (the gyro's rate) / (the odometry's)
    SLIP_HIGH   shortfall over 0.4 for 1 s of driving, or the gyro's turn differs from the odometry's by 8 degrees
                within 1 m of driving along, or the filter's slip ratio, which registrations correct, is over 0.4.
                Ends after 3 s below 0.25
    NOT_MOVING  shortfall over 0.7 for 0.3 s, and from then on for 3 s turning wheels, no shaking of the gyro after
                the first 1.5 s, no thrust forwards, and no turn on the spot by the gyro. A rover that slides before it
                stops shakes: the gyro's quiet 1.5 s may come within 5 s. Ends after half a second of standing

Turns on the spot do not count in that 1 m: over 1 m of rim travel the rover turns by 130 degrees, and sound ground
takes 5 to 9 degrees of them; and wheels that steer turn the rover without any travel. The shortfall covers these turns.
"""

from __future__ import annotations

import math
from collections import deque

from onboard.core.faults.wheels.body_speed import DRIVING_S, SLOW_S, SUSPECT_S, BodySpeed
from onboard.core.faults.wheels.seen import LEAST_MPS, TICK_S, WheelInputs, speed_mps
from onboard.core.faults.wheels.shaking import Shaking
from onboard.native.elementary import total
from onboard.records import Twist

LEAST_RADPS = 0.04  # slower turns are not judged; SLIP_HIGH itself lets a turn go on at 0.06
HIGH, CALM, STOPPED, THRUST = 0.4, 0.25, 0.7, -0.3
SUSPECT = 0.35  # from here on the odometry pulls the body's speed less
HIGH_TICKS, CALM_TICKS, STOPPED_TICKS, STILL_TICKS, STOOD_TICKS = 100, 300, 30, 300, 50
SUSPECT_TICKS = 500  # longest suspicion; a stop not found by then is dropped
SHAKING_RADPS = 0.006  # sensor noise 0.001, digging wheels 0.005, rough ground under a moving rover more
SETTLE_TICKS = 150  # a stopped rover rocks for this time
ASTRAY_RAD = math.radians(8.0)  # a sound rover on rough ground: 3.7 degrees; turned by a stone: 6.8
ASTRAY_M, PIECES = 0.25, 4


class SlipWatch:
    """Watch of slip; call `update` each tick.

    high, still: SLIP_HIGH and NOT_MOVING are active.
    shortfall: of the tick, ratio; 0 if it is not judged.
    """

    def __init__(self) -> None:
        self.high = self.still = False
        self.shortfall = 0.0
        self.body, self._shaking = BodySpeed(), Shaking()
        self._high = self._calm = self._short = self._stopped = self._stood = self._suspect = self._doubted = 0
        self._turns: deque[float] = deque(maxlen=PIECES)
        self._turn_rad = self._way_m = 0.0

    def update(self, seen: WheelInputs, strays: bool) -> None:
        """Process one tick; without an IMU nothing is judged. strays: only the ground can turn the rover off course."""
        if seen.imu is None:
            return
        self._suspect = self._suspect + 1 if self.shortfall > SUSPECT else 0
        self.body.update(seen.imu, seen.step.twist, seen.step.standing, self._tau_s(seen.step.twist))
        self._shaking.update(seen.imu)
        if not strays:
            self._turns.clear()
        elif speed_mps(seen.step.twist) > LEAST_MPS:
            self._stray(seen)
        self._stood = self._stood + 1 if seen.step.standing else 0
        if self._judge(seen):
            self._high = self._high + 1 if self.shortfall > HIGH else 0
            self._short = self._short + 1 if self.shortfall > STOPPED else 0
            self._stop(seen.step.twist)
        elif self._stood >= STOOD_TICKS:
            self._high = self._short = self._stopped = 0
            self._turns.clear()
        self._conclude(seen)

    def _tau_s(self, twist: Twist) -> float:
        """Time constant with which the odometry pulls the body's speed."""
        if speed_mps(twist) <= LEAST_MPS:
            return SLOW_S
        return SUSPECT_S if 0 < self._suspect < SUSPECT_TICKS else DRIVING_S

    def _judge(self, seen: WheelInputs) -> bool:
        """Set `shortfall`; return False if the wheels are too slow to judge."""
        twist = seen.step.twist
        speed = speed_mps(twist)
        self.shortfall = 0.0
        if seen.step.standing:
            return False
        if speed > LEAST_MPS:
            along = (self.body.vx_mps * twist.vx_mps + self.body.vy_mps * twist.vy_mps) / speed
            self.shortfall = 1.0 - along / speed if self.body.known else 0.0
            return self.body.known
        if abs(twist.yaw_radps) > LEAST_RADPS:
            self.shortfall = 1.0 - seen.turn_radps / twist.yaw_radps
            return True
        return False

    def _stop(self, twist: Twist) -> None:
        """Count the ticks since the body seems to have stopped while the wheels turn."""
        shakes = self._stopped > SETTLE_TICKS and self._shaking.now_radps > SHAKING_RADPS
        turns = speed_mps(twist) <= LEAST_MPS and self.shortfall < CALM
        if self._stopped == 0:
            self._stopped, self._doubted = int(self._short >= STOPPED_TICKS), 0
        elif turns or self.shortfall < THRUST or self._doubted >= SUSPECT_TICKS:
            self._stopped = 0
        else:
            self._stopped = SETTLE_TICKS if shakes else self._stopped + 1
            self._doubted += 1

    def _conclude(self, seen: WheelInputs) -> None:
        slips = self._high >= HIGH_TICKS or abs(total(self._turns)) > ASTRAY_RAD or seen.slip_ratio > HIGH
        self._calm = 0 if slips or self.shortfall > CALM else self._calm + 1
        self.high = slips or (self.high and self._calm < CALM_TICKS)
        self.still = (self.still or self._stopped >= STILL_TICKS) and self._stood < STOOD_TICKS

    def _stray(self, seen: WheelInputs) -> None:
        self._turn_rad += seen.turn_radps * TICK_S - seen.step.dyaw_rad
        self._way_m += seen.step.rolled_m
        if self._way_m >= ASTRAY_M:
            self._turns.append(self._turn_rad)
            self._turn_rad = self._way_m = 0.0
