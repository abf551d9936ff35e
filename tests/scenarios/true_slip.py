"""True slip of the rover, from the plant alone: the reference for SLIP_HIGH and NOT_MOVING.

    lacks    share of the wheels' way in the last second that the body did not make along it
    strays   turn of the body beyond that of the wheels within 1 m of driving

The wheels stand in mirror places. By the wheels, therefore, the rover's middle moves with the mean of the four hubs,
whatever its turn, and it turns by the hubs' mean moment over the places' mean square.
"""

from __future__ import annotations

import math
from collections import deque

from hil.plant.turns import inverse, rotate
from hil.records import PlantState
from onboard.config import Rover
from protocol.conventions import WHEEL_SIGNS

WINDOW_TICKS, TICK_S = 100, 0.01
LEAST_MPS = 0.04  # slower wheels do not show slip: they turn the rover on the spot, or start
STRAY_M = 1.0
ROVER = Rover()
PLACES_M = tuple((along * ROVER.half_wheelbase_m, across * ROVER.half_track_m) for along, across in WHEEL_SIGNS)
SQUARE_M2 = sum(a * a + b * b for a, b in PLACES_M)


class TrueSlip:
    """Estimator of the true slip; `update` each tick."""

    def __init__(self) -> None:
        self._ways: deque[tuple[float, float]] = deque(maxlen=WINDOW_TICKS)  # of the wheels, of the body along it
        self._strays: deque[tuple[float, float]] = deque([(0.0, 0.0)])  # (way driven, excess of the turn) since 1 m

    def update(self, state: PlantState) -> None:
        """Process one tick."""
        u, w, turn_radps = wheels_twist(state)
        ahead, left, _ = rotate(inverse(state.quaternion_xyzw.tolist()), state.velocity_mps.tolist())
        speed = math.hypot(u, w)
        self._ways.append((speed, (ahead * u + left * w) / speed if speed > 0.0 else 0.0))
        if speed > LEAST_MPS:
            way_m, excess_rad = self._strays[-1]
            way_m += speed * TICK_S
            self._strays.append((way_m, excess_rad + (float(state.angular_radps[2]) - turn_radps) * TICK_S))
            while self._strays[0][0] < way_m - STRAY_M:
                self._strays.popleft()

    @property
    def lacks_ratio(self) -> float:
        """Share that the body lacks: over 1 if it went back; 0 before a second has passed, and for slow wheels."""
        wheels, body = (sum(way[k] for way in self._ways) / WINDOW_TICKS for k in (0, 1))
        return 1.0 - body / wheels if len(self._ways) == WINDOW_TICKS and wheels > LEAST_MPS else 0.0

    @property
    def strays_rad(self) -> float:
        """Largest difference of the excess turn between now and any moment within the last 1 m."""
        now_rad = self._strays[-1][1]
        return max(abs(now_rad - excess_rad) for _, excess_rad in self._strays)


def wheels_twist(state: PlantState) -> tuple[float, float, float]:
    """Return (v_x, v_y, omega) in base axes by the wheels' true rates and angles."""
    u = w = moment = 0.0
    for (a, b), wheel in zip(PLACES_M, state.wheels):
        rim = ROVER.wheel_radius_m * wheel.rate_radps
        along, across = rim * math.cos(wheel.steer_rad), rim * math.sin(wheel.steer_rad)
        u, w, moment = u + along, w + across, moment + a * across - b * along
    return u / len(PLACES_M), w / len(PLACES_M), moment / SQUARE_M2
