"""STEER_OFFSET: decides by the gyro if a steering reading off its order is wrong, or if the wheel really stands so.

A reading that is wrong by o turns the odometry: the wheel's part in omega is m / Q, m = s * (a * sin d - b * cos d), so

    x = -o * s * (a * cos d + b * sin d) / Q      is the gyro's rate in excess of the odometry, if the reading is wrong

and 0 if it is right. x and the gyro's excess are summed over 0.25 m of driving each; their regression decides. At 6
degrees x is 2.9 degrees a metre, while a sound rover's excess walks by 0.4 degrees in half a metre. Turns on the spot
do not count: there x is almost zero, and wheel slip takes degrees of the turn.
"""

from __future__ import annotations

import math

from onboard.core.faults.wheels.seen import LEAST_MPS, TICK_S, WheelInputs, speed_mps
from onboard.native.elementary import cos, sin

LEAST_RAD = math.radians(1.5)  # a smaller offset is ignored
BLOCK_M, FIRST_M, LAST_M = 0.25, 1.0, 5.0
TELLING_RAD = math.radians(3.0)  # sum of |x| that decides
FAINT_RAD = math.radians(1.0)  # sum of |x| that decides from LAST_M on


class OffsetWatch:
    """Watch of one wheel at (a_m, b_m).

    off_rad: offset of the reading. A new value makes the verdict open again.
    verdict: True if the reading is wrong, False if the wheel really stands so, None if open.
    """

    def __init__(self, place_m: tuple[float, float], q_m2: float) -> None:
        self._place_m, self._q_m2 = place_m, q_m2
        self.verdict: bool | None = None
        self.off_rad = 0.0
        self._restart()

    @property
    def open(self) -> bool:
        """True while a reading is off and the reason is not known yet."""
        return self.verdict is None and abs(self.off_rad) >= LEAST_RAD

    def update(self, off_rad: float, rim_m: float, seen: WheelInputs, n: int) -> None:
        """Process one tick. off_rad: offset of the reading of wheel `n` (from 0); rim_m: distance its rim rolled."""
        if off_rad != self.off_rad:
            self.off_rad, self.verdict = off_rad, None
            self._restart()
        state = seen.wheels[n]
        if not self.open or state is None or speed_mps(seen.step.twist) <= LEAST_MPS:
            return
        a, b = self._place_m
        self._x -= off_rad * rim_m * (a * cos(state.steer_rad) + b * sin(state.steer_rad)) / self._q_m2
        self._y += seen.turn_radps * TICK_S - seen.step.dyaw_rad
        self._block_m += abs(rim_m)
        if self._block_m >= BLOCK_M:
            self._close()

    def _restart(self) -> None:
        self._x = self._y = self._block_m = self._way_m = self._told_rad = self._xx = self._xy = 0.0

    def _close(self) -> None:
        self._xx += self._x * self._x
        self._xy += self._x * self._y
        self._told_rad += abs(self._x)
        self._way_m += self._block_m
        self._x = self._y = self._block_m = 0.0
        least = TELLING_RAD if self._way_m < LAST_M else FAINT_RAD
        if self._way_m >= FIRST_M and self._told_rad >= least:
            self.verdict = self._xy > 0.5 * self._xx
