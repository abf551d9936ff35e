"""Monitor of a tilt axis that does not follow its order: distance moved in the last 0.25 s against the one ordered.

The slowest sweep moves 7 mrad in that time, some five steps of the encoder. The order is read LAG_NS late: it has to
cross the bus and the servo has to follow.
"""

from __future__ import annotations

import math
from collections import deque

from onboard.devices.tilt import Tilt

WINDOW_TICKS, LAG_NS = 25, 50_000_000
LEAST_RAD, MOVED_RATIO = 0.005, 0.3
BEHIND_RAD = 0.004  # an axis that is ahead of its order does not move either
FRESH_NS = 150_000_000  # a parked axis reports its angle at 10 Hz


class StallWatch:
    """Stall monitor; call `update` each tick. stalled: the axis lacks most of the ordered motion."""

    def __init__(self) -> None:
        self.stalled = False
        self._plan = -1
        self._ways: deque[tuple[float, float]] = deque(maxlen=WINDOW_TICKS + 1)

    def update(self, tilt: Tilt, now_ns: int) -> None:
        """Process one tick. A new plan, or an axis that does not report, restarts the window."""
        ordered_rad, told_rad = tilt.ordered_rad(now_ns - LAG_NS), tilt.angle_rad
        if tilt.plan != self._plan or ordered_rad is None or told_rad is None or now_ns - tilt.stamp_ns > FRESH_NS:
            self._plan, self.stalled = tilt.plan, False
            self._ways.clear()
            return
        self._ways.append((ordered_rad, told_rad))
        due_rad, moved_rad = (self._ways[-1][k] - self._ways[0][k] for k in (0, 1))
        behind_rad = math.copysign(1.0, due_rad) * (ordered_rad - told_rad)
        whole = len(self._ways) == self._ways.maxlen
        lacks = abs(due_rad) > LEAST_RAD and abs(moved_rad) < MOVED_RATIO * abs(due_rad)
        self.stalled = whole and lacks and behind_rad > BEHIND_RAD
