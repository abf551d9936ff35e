"""How much of the wheels' way the body really lacks, from the plant alone: what SLIP_HIGH and NOT_MOVING are held to.

The wheels stand in mirror places, so by their word the rover's middle goes as the mean of the four hubs, whatever it
turns. Its true velocity is taken along that, in the rover's own axes; both are summed over the last second.
"""

from __future__ import annotations

import math
from collections import deque

from hil.records import PlantState
from hil.turns import inverse, rotate
from onboard.config import Rover

WINDOW_TICKS = 100
LEAST_MPS = 0.04  # slower wheels say nothing of slip: they turn the rover on the spot, or start
RADIUS_M = Rover().wheel_radius_m


class TrueSlip:
    """`update` each tick. lacks_ratio: 0 as long as the wheels' way of the last second is under LEAST_MPS."""

    def __init__(self) -> None:
        self._ways: deque[tuple[float, float]] = deque(maxlen=WINDOW_TICKS)  # of the wheels, of the body along it

    def update(self, state: PlantState) -> None:
        """Takes one tick."""
        hubs = [(RADIUS_M * w.rate_radps, w.steer_rad) for w in state.wheels]
        u = sum(rim * math.cos(steer) for rim, steer in hubs) / len(hubs)
        w = sum(rim * math.sin(steer) for rim, steer in hubs) / len(hubs)
        ahead, left, _ = rotate(inverse(state.quaternion_xyzw.tolist()), state.velocity_mps.tolist())
        speed = math.hypot(u, w)
        self._ways.append((speed, (ahead * u + left * w) / speed if speed > 0.0 else 0.0))

    @property
    def lacks_ratio(self) -> float:
        """Share of the wheels' way in the last second that the body did not make; over 1 where it went back."""
        wheels, body = (sum(way[k] for way in self._ways) / WINDOW_TICKS for k in (0, 1))
        return 1.0 - body / wheels if len(self._ways) == WINDOW_TICKS and wheels > LEAST_MPS else 0.0
