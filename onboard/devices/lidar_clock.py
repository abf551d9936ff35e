"""When a scan really began: the sensor's 24-bit millisecond stamps and the arrivals of its frames, put together.

The scanner turns evenly, so turns (counted by the stamps) are the ruler, finer than the milliseconds; arrivals are late
by a constant and by what the link adds, never early, so the line under all of them has the constant delay alone:

    arrival - ruler |     .          .        late by what the link added
                    |  .     . .  .     .  .
                    |__.__.______.____.______  line under all arrivals: offset and drift of the sensor's clock
                    +------------------------ turns of the last WINDOW frames

The line is the edge of the lower convex hull at the mean turn (the one that leaves the least above it). The constant
delay cannot be seen passively; it is `latency_ns`, from the stamped instant to the frame's first byte when nothing is
late: 19.75 ms on the bench's ideal sensor, 23.7 ms in the log of a UTM-30LX.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from protocol.scip import STAMP_MODULUS

WINDOW = 400  # frames: 10 s
_LINE = 80  # frames before a drift is fitted: 2 s; until then the lowest arrival alone
_REFIT = 16
_GAP_NS = 1_000_000_000
_JUMP_MS = 400.0
_DRIFT_LIMIT = 500e-6


class LidarClock:
    """Stamps and arrivals in, onboard times out. turn_ms: nominal time of a turn."""

    def __init__(self, latency_ns: int, turn_ms: float = 25.0) -> None:
        self.jumps = 0
        self.repeated = 0
        self._latency_ns = latency_ns
        self.restart(turn_ms)

    def restart(self, turn_ms: float | None = None) -> None:
        """Forget all but the counts: after a pause, a jump, a new connection (then with the sensor's nominal turn)."""
        if turn_ms is not None:
            self._nominal_ms = turn_ms
        self._frames: deque[tuple[float, float, float]] = deque(maxlen=WINDOW)  # turn, stamp ms, arrival ns; all from 0
        self._turn_ms = self._nominal_ms
        self._stamp_ms = -1
        self._rx_ns = 0
        self._origin_ns = 0
        self._turn = 0
        self._time_ms = 0
        self._since_fit = 0
        self._ruler = (self._nominal_ms, 0.0)  # ms a turn, ms at turn 0
        self._under = (0.0, 0.0)  # ns a turn, ns at turn 0

    @property
    def drift_ratio(self) -> float:
        """How much slower the sensor's clock runs than ours, as the line has it now (0 until it is fitted)."""
        return self._under[0] / (self._ruler[0] * 1e6)

    def observe(self, stamp_ms: int, rx_ns: int) -> int | None:
        """Onboard time of the instant the stamp names. None for a repeated stamp (the frame is not a new turn)."""
        if self._stamp_ms < 0 or rx_ns - self._rx_ns > _GAP_NS:
            self._begin(stamp_ms, rx_ns)
        else:
            passed_ms = (stamp_ms - self._stamp_ms) % STAMP_MODULUS
            if passed_ms == 0:
                self.repeated += 1
                return None
            if abs(passed_ms - (rx_ns - self._rx_ns) * 1e-6) > _JUMP_MS:
                self.jumps += 1
                self._begin(stamp_ms, rx_ns)
            else:
                self._turn += max(1, round(passed_ms / self._turn_ms))
                self._time_ms += passed_ms
        self._stamp_ms, self._rx_ns = stamp_ms, rx_ns
        self._frames.append((float(self._turn), float(self._time_ms), float(rx_ns - self._origin_ns)))
        self._since_fit += 1
        if len(self._frames) < _LINE or self._since_fit >= _REFIT:
            self._fit()
        return self._start_ns(rx_ns)

    def _begin(self, stamp_ms: int, rx_ns: int) -> None:
        self.restart()
        self._stamp_ms, self._origin_ns = stamp_ms, rx_ns

    def _start_ns(self, rx_ns: int) -> int:
        per_turn_ms, zero_ms = self._ruler
        ruler_ms = per_turn_ms * self._turn + zero_ms
        if not -0.75 <= ruler_ms - self._time_ms <= 1.75:  # the motor does not turn evenly now: the stamp knows better
            ruler_ms = self._time_ms + 0.5
        first_byte_ns = ruler_ms * 1e6 + self._under[0] * self._turn + self._under[1]
        return round(min(first_byte_ns, rx_ns - self._origin_ns)) + self._origin_ns - self._latency_ns

    def _fit(self) -> None:
        self._since_fit = 0
        turns, stamps_ms, arrivals_ns = np.array(self._frames).T
        stamps_ms = stamps_ms + 0.5  # a stamp is cut to whole milliseconds
        if len(turns) < _LINE:
            self._ruler = (self._nominal_ms, float((stamps_ms - self._nominal_ms * turns).mean()))
            late_ns = arrivals_ns - (self._ruler[0] * turns + self._ruler[1]) * 1e6
            self._under = (0.0, float(late_ns.min()))
            return
        middle = turns.mean()
        spread = turns - middle
        per_turn_ms = float((spread * stamps_ms).sum() / (spread * spread).sum())
        self._ruler = (per_turn_ms, float(stamps_ms.mean() - per_turn_ms * middle))
        self._turn_ms = per_turn_ms
        late_ns = arrivals_ns - (per_turn_ms * turns + self._ruler[1]) * 1e6
        slope_ns, height_ns = _edge_under(turns.tolist(), late_ns.tolist(), float(middle))
        limit_ns = _DRIFT_LIMIT * per_turn_ms * 1e6
        if abs(slope_ns) > limit_ns:
            slope_ns = max(-limit_ns, min(limit_ns, slope_ns))
            height_ns = float((late_ns - slope_ns * turns).min())
        self._under = (slope_ns, height_ns)


def _edge_under(x: list[float], y: list[float], middle: float) -> tuple[float, float]:
    """(slope, value at 0) of the lower convex hull's edge over `middle`. x rises; at least two points."""
    hull: list[tuple[float, float]] = []
    for px, py in zip(x, y, strict=True):
        while len(hull) > 1:
            (ax, ay), (bx, by) = hull[-2], hull[-1]
            if (bx - ax) * (py - ay) > (by - ay) * (px - ax):
                break
            hull.pop()
        hull.append((px, py))
    at = next(k for k in range(1, len(hull)) if hull[k][0] >= middle)
    (ax, ay), (bx, by) = hull[at - 1], hull[at]
    slope = (by - ay) / (bx - ax)
    return slope, ay - slope * ax
