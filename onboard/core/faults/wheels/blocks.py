"""One wheel's drive in blocks of 0.2 s: rate owed, measured and reported, and current drawn.

owed    rate (rad/s): the order as the node ramps it, at 1 rad/s2, two ticks late
turned  rate by the encoder's position;   told  rate reported in the feedback;   current (A), mean
"""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

from onboard.core.faults.wheels.seen import TICK_S, approach, works
from onboard.records import WheelCommand, WheelState
from protocol.conventions import TICK_NS

SLEW_RADPS2 = 1.0  # of the drives, 10-navigation section 2
BLOCK_TICKS, BLOCKS = 20, 3
ORDER_TICKS = 2  # from an order to the feedback that shows it
LEAP_RAD = 0.02  # a jump: the position is this far from the one that the told rate gives


class Block(NamedTuple):
    """Means over 0.2 s.

    owed_radps, turned_radps, told_radps: rates as above.
    current_a: None if no status came.
    ramp_radps2: rate of change of `owed`.
    """

    owed_radps: float
    turned_radps: float
    told_radps: float
    current_a: float | None
    ramp_radps2: float


class WheelBlocks:
    """The last three blocks of one wheel; call `update` each tick, True when it closes a block.

    Ticks without a frame wait for the next frame, which gives the rotation over all of them. So does a tick in which
    the position jumps: a frame damaged on the wire is gone with the next one, an encoder that jumped stays there.
    """

    def __init__(self) -> None:
        self.blocks: deque[Block] = deque(maxlen=BLOCKS)
        self._owed_radps = self._waiting_owed = 0.0
        self._waiting = 0
        self._orders: deque[float] = deque([0.0] * ORDER_TICKS, maxlen=ORDER_TICKS)
        self._last_rad: float | None = None
        self._leapt = False
        self._begin()

    def update(self, order: WheelCommand, state: WheelState | None, current_a: float | None) -> bool:
        """Process one tick. A wheel whose node does not run owes nothing, and its blocks are cleared."""
        late = self._orders[0]
        self._orders.append(order.rate_radps)
        if not works(state):
            self._owed_radps, self._last_rad, self._leapt = 0.0, None, False
            self.blocks.clear()
            self._begin()
            return False
        assert state
        self._owed_radps = approach(self._owed_radps, late, SLEW_RADPS2 * TICK_S)
        self._waiting_owed += self._owed_radps
        self._waiting += 1
        if current_a is not None:
            self._current += current_a
            self._currents += 1
        if state.age_ns >= TICK_NS:  # no frame: the next one covers this tick too, or the node is silent
            return False
        turned_rad = 0.0 if self._last_rad is None else state.position_rad - self._last_rad
        self._leapt = not self._leapt and _leaps(turned_rad, state.rate_radps, self._waiting)
        if self._leapt:
            return False
        self._turned += turned_rad
        self._last_rad = state.position_rad
        self._owed += self._waiting_owed
        self._told += state.rate_radps * self._waiting
        self._ticks += self._waiting
        self._waiting, self._waiting_owed = 0, 0.0
        if self._ticks < BLOCK_TICKS:
            return False
        self._close()
        return True

    def _begin(self) -> None:
        self._ticks = self._currents = self._waiting = 0
        self._waiting_owed = 0.0
        self._owed = self._turned = self._told = self._current = 0.0
        self._first_radps = self._owed_radps

    def _close(self) -> None:
        n = self._ticks
        self.blocks.append(
            Block(
                self._owed / n,
                self._turned / (n * TICK_S),
                self._told / n,
                self._current / self._currents if self._currents else None,
                abs(self._owed_radps - self._first_radps) / (n * TICK_S),
            )
        )
        self._begin()


def _leaps(turned_rad: float, told_radps: float, ticks: int) -> bool:
    """Return whether the position is farther off than a frame one tick early or late explains."""
    return abs(turned_rad - told_radps * ticks * TICK_S) > LEAP_RAD + abs(told_radps) * TICK_S
