"""One wheel's steering against its rate-limited model: STEER_STUCK, and the offset of the reading.

model   the order, followed at the steering's rate from the pot's first reading
off     excess of the reading at wake-up, plus its jumps since: a steering cannot jump
stuck   the reading, less `off`, is more than 3 degrees from the model for 0.2 s
"""

from __future__ import annotations

import math
from collections import deque

from onboard.core.faults.wheels.blocks import ORDER_TICKS
from onboard.core.faults.wheels.seen import TICK_S, approach, works
from onboard.records import WheelCommand, WheelState

STUCK_RAD = math.radians(3.0)
STUCK_TICKS = 20
WAKE_TICKS = 150  # from the first reading; by then a steering that was left turned is back at zero
WAKE_RAD = math.radians(12.0)  # a larger difference is no offset
POT_RAD = 0.01  # noise of a reading, 20 sigma


class SteerWatch:
    """Watch of a steering; call `update` each tick.

    off_rad: offset of the reading.
    stuck_rad: angle at which the steering is stuck, or None.
    """

    def __init__(self, rate_radps: float) -> None:
        self.off_rad = 0.0
        self.stuck_rad: float | None = None
        self._step_rad = rate_radps * TICK_S
        self._model_rad: float | None = None
        self._last_rad = 0.0
        self._orders: deque[float] = deque(maxlen=ORDER_TICKS)
        self._ticks = self._astray = 0

    def update(self, order: WheelCommand, state: WheelState | None) -> None:
        """Process one tick; while the node does not run the model stays as it is."""
        self._orders.append(order.steer_rad)
        if not works(state):
            self._astray = 0
            return
        assert state
        reading = state.steer_rad
        if self._model_rad is None:
            self._model_rad = self._last_rad = reading
        self._model_rad = approach(self._model_rad, self._orders[0], self._step_rad)
        self._ticks += 1
        jump, self._last_rad = reading - self._last_rad, reading
        if abs(jump) > 2.0 * self._step_rad + POT_RAD:
            self.off_rad += jump
        away = reading - self.off_rad - self._model_rad
        if self._ticks <= WAKE_TICKS:
            if self._ticks == WAKE_TICKS and POT_RAD < abs(away) < WAKE_RAD:
                self.off_rad += away
            return
        self._astray = self._astray + 1 if abs(away) > STUCK_RAD else 0
        if self._astray >= STUCK_TICKS and self.stuck_rad is None:
            self.stuck_rad = reading - self.off_rad
