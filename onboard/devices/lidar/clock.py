"""Clock estimator for SCIP scanners: start times of scans from 24-bit millisecond stamps and frame arrivals.

The scanner turns evenly, so turns (counted by the stamps) are the ruler, finer than the milliseconds. An arrival is
late by a constant and by the delay that the link adds, never early. So the line under all arrivals has only the
constant delay:

    arrival - ruler |     .          .        late by the delay of the link
                    |  .     . .  .     .  .
                    |__.__.______.____.______  line under all arrivals: offset and drift of the sensor's clock
                    +------------------------ turns of the last WINDOW frames

The line is the edge of the lower convex hull at the mean turn (the one that leaves the least above it). An error of the
ruler's slope is in the line too, with the opposite sign, so it cancels.

The constant delay cannot be measured passively; it is `latency_ns`, from the stamped instant to the frame's first byte
without any queueing: 19.75 ms on the bench's ideal sensor, 23.7 ms in the log of a UTM-30LX. A TM1 exchange before the
stream (`seed`) bounds it: the counter had the reported value at some instant between request and reply. Within these
bounds the configured constant is used, outside of them their middle.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from onboard.devices.lidar.hull_fit import Frames, edge_under, height_under, line_at, total
from onboard.native.elementary import hypot
from onboard.records import F64
from protocol.scip import STAMP_MODULUS

WINDOW = 400  # frames: 10 s
_LINE = 80  # frames before a drift is fitted: 2 s; until then only the lowest arrival
_REFIT = 16
_GAP_NS = 1_000_000_000
_JUMP_MS = 400.0
_DRIFT_LIMIT = 500e-6
_TRUST = 33.0  # turns^2: (a stamp's 0.29 ms / the 0.05 ms by which motors differ from their nominal turn)^2
_TRUST_LEARNT = 3300.0  # a period measured before counts as known to 0.005 ms
_SPREAD = 4.0  # sigma of the line at its newest end / mean step between its lowest arrivals, by simulation


class ClockQuality(NamedTuple):
    """Quality of the clock estimate.

    offset_ns: onboard time minus the counter at its newest stamp.
    ppm: by how much the sensor's clock is slower than onboard time; 0 until a drift is fitted.
    sigma_ns: of a scan's time, without the constant delay.
    samples: frames in the estimate.
    jumps, reboots, repeated: counts since the start.
    """

    offset_ns: int = 0
    ppm: float = 0.0
    sigma_ns: float = math.inf
    samples: int = 0
    jumps: int = 0
    reboots: int = 0
    repeated: int = 0


class _Seed(NamedTuple):
    """Bounds of onboard time minus counter, from TM1 exchanges near the counter value `stamp_ms`."""

    stamp_ms: int
    low_ns: int
    high_ns: int


class LidarClock:
    """Clock estimator: stamps and arrivals in, onboard times out. turn_ms: nominal time of a turn."""

    def __init__(self, latency_ns: int, turn_ms: float = 25.0) -> None:
        self.jumps = 0
        self.reboots = 0
        self.repeated = 0
        self.latency_ns = float(latency_ns)
        self._stated_ns = float(latency_ns)
        self._frames = Frames(WINDOW)  # turns and stamps from 0, arrivals from the origin
        self._last: tuple[int, int] | None = None  # stamp and arrival of the newest frame, over all restarts
        self.restart(turn_ms)

    def restart(self, turn_ms: float | None = None) -> None:
        """Drop the frames for a new connection (turn_ms: the sensor's nominal turn). Counts and latency stay."""
        if turn_ms is not None:
            self._turn_ms, self._trust = turn_ms, _TRUST
            self._turn_ns = turn_ms * 1e6
        self._seed: _Seed | None = None
        self._clear()

    def _clear(self) -> None:
        self._frames.clear()
        self._origin_ns = 0
        self._first_ms = 0  # stamp of the frame whose turn is 0
        self._turn = 0
        self._time_ms = 0
        self._since_fit = 0
        self._ruler = (self._turn_ms, 0.0)  # ms a turn, ms at turn 0
        self._under = (0.0, 0.0)  # ns a turn, ns at turn 0
        self._sigma_ns = math.inf

    # -- results -----------------------------------------------------------------------------------------------

    @property
    def drift_ratio(self) -> float:
        """By how much the sensor's clock is slower than onboard time, by the present line; 0 until it is fitted."""
        return self._under[0] / (self._ruler[0] * 1e6) if len(self._frames) >= _LINE else 0.0

    @property
    def turn_ns(self) -> float:
        """Time of one turn in onboard time: nominal at first, then as measured."""
        return self._turn_ns

    @property
    def quality(self) -> ClockQuality:
        """Present quality of the estimate."""
        counts = (len(self._frames), self.jumps, self.reboots, self.repeated)
        if not self._frames:
            return ClockQuality(0, 0.0, math.inf, *counts)
        stamp_ms = (self._first_ms + self._time_ms) % STAMP_MODULUS
        onboard_ns = self._origin_ns + self._time_ms * 1e6 + self._line_ns(self._turn) - self.latency_ns
        return ClockQuality(round(onboard_ns - stamp_ms * 1e6), self.drift_ratio * 1e6, self._sigma_ns, *counts)

    # -- inputs ------------------------------------------------------------------------------------------------

    def seed(self, stamp_ms: int, sent_ns: int, received_ns: int) -> None:
        """Add a TM1 exchange: the counter was `stamp_ms` (cut to whole ms) between the request and its reply.

        Further exchanges on one connection narrow the bounds; one that contradicts them replaces them.
        """
        seed = self._seed
        count_ms = stamp_ms if seed is None else seed.stamp_ms + (stamp_ms - seed.stamp_ms) % STAMP_MODULUS
        low_ns, high_ns = sent_ns - (count_ms + 1) * 1_000_000, received_ns - count_ms * 1_000_000
        if seed is not None and max(low_ns, seed.low_ns) <= min(high_ns, seed.high_ns):
            self._seed = _Seed(seed.stamp_ms, max(low_ns, seed.low_ns), min(high_ns, seed.high_ns))
        else:
            self._seed = _Seed(stamp_ms, sent_ns - (stamp_ms + 1) * 1_000_000, received_ns - stamp_ms * 1_000_000)

    def observe(self, stamp_ms: int, rx_ns: int) -> int | None:
        """Return the onboard time of the instant that the stamp names; None for a repeated stamp (no new turn)."""
        if self._last is None:
            self._begin(stamp_ms, rx_ns)
        else:
            passed_ms, waited_ms = (stamp_ms - self._last[0]) % STAMP_MODULUS, (rx_ns - self._last[1]) * 1e-6
            if passed_ms == 0 and waited_ms < STAMP_MODULUS / 2:
                self.repeated += 1
                return None
            half = STAMP_MODULUS / 2
            off_ms = (passed_ms - waited_ms + half) % STAMP_MODULUS - half
            if abs(off_ms) > _JUMP_MS + _DRIFT_LIMIT * waited_ms:
                self._jumped(stamp_ms <= waited_ms + _JUMP_MS)
                self._begin(stamp_ms, rx_ns)
            elif not self._frames or waited_ms * 1e6 > _GAP_NS:
                self._begin(stamp_ms, rx_ns)
            else:
                self._turn += max(1, round(passed_ms / self._turn_ms))
                self._time_ms += passed_ms
        self._last = (stamp_ms, rx_ns)
        self._frames.append(self._turn, self._time_ms, rx_ns - self._origin_ns)
        self._since_fit += 1
        if len(self._frames) < _LINE or self._since_fit >= _REFIT:
            self._fit()
        return self._start_ns(rx_ns)

    def _jumped(self, from_zero: bool) -> None:
        """Count a break: the sensor restarted (its count is at most the time since its last frame), or it jumped."""
        if from_zero:
            self.reboots += 1
        else:
            self.jumps += 1
        if self._frames:  # a seed from after the last connection belongs to the new count
            self._seed = None

    def _begin(self, stamp_ms: int, rx_ns: int) -> None:
        self._clear()
        self._first_ms, self._origin_ns = stamp_ms, rx_ns

    # -- the estimate ------------------------------------------------------------------------------------------

    def _line_ns(self, turn: float) -> float:
        return self._under[0] * turn + self._under[1]

    def _start_ns(self, rx_ns: int) -> int:
        per_turn_ms, zero_ms = self._ruler
        ruler_ms = per_turn_ms * self._turn + zero_ms
        if not -0.75 <= ruler_ms - self._time_ms <= 1.75:  # the motor does not turn evenly now: use the stamp
            ruler_ms = self._time_ms + 0.5
        first_byte_ns = ruler_ms * 1e6 + self._line_ns(self._turn)
        return round(min(first_byte_ns, rx_ns - self._origin_ns) - self.latency_ns) + self._origin_ns

    def _fit(self) -> None:
        """Fit the ruler by least squares and the line under the arrivals, in preallocated columns."""
        self._since_fit = 0
        turns, stamps_ms, arrivals_ns = self._frames.columns()
        late_ns, off_ms, spare = self._frames.spare()
        np.add(stamps_ms, 0.5, out=off_ms)  # a stamp is cut to whole milliseconds
        count = len(turns)
        middle = total(turns, spare) / count
        spread = np.subtract(turns, middle, out=late_ns)
        weight = total(np.multiply(spread, spread, out=spare), spare) + self._trust
        along = total(np.multiply(spread, off_ms, out=spare), spare) + self._trust * self._turn_ms
        per_turn_ms = along / weight
        self._ruler = (per_turn_ms, total(off_ms, spare) / count - per_turn_ms * middle)
        off_ms -= line_at(turns, self._ruler, spare)
        spare *= 1e6
        np.subtract(arrivals_ns, spare, out=late_ns)
        if count < _LINE:
            slope_ns = self._turn_ns - per_turn_ms * 1e6 if self._trust == _TRUST_LEARNT else 0.0
            self._under = (slope_ns, height_under(turns, late_ns, slope_ns, spare))
        else:
            self._under = self._edge(turns, late_ns, middle, spare)
            self._turn_ms, self._trust = per_turn_ms, _TRUST_LEARNT
            self._turn_ns = per_turn_ms * 1e6 + self._under[0]
        np.subtract(late_ns, line_at(turns, self._under, spare), out=spare)
        self._judge(off_ms, spare)

    def _edge(self, turns: F64, late_ns: F64, middle: float, spare: F64) -> tuple[float, float]:
        slope_ns, height_ns = edge_under(turns, late_ns, middle, self._under[0], spare)
        limit_ns = _DRIFT_LIMIT * self._ruler[0] * 1e6
        if abs(slope_ns) > limit_ns:
            slope_ns = max(-limit_ns, min(limit_ns, slope_ns))
            height_ns = height_under(turns, late_ns, slope_ns, spare)
        return slope_ns, height_ns

    def _judge(self, off_ms: F64, above_ns: F64) -> None:
        """Set sigma from the steps between the lowest arrivals and the motor's unevenness; bound the latency.

        off_ms: offsets of the stamps from the ruler; above_ns: of the arrivals from the line. Both are overwritten.
        """
        count, blur_ms = len(off_ms), max(0.0, 1.0 - float(off_ms[off_ms.argmax()] - off_ms[off_ms.argmin()]))
        off_ms *= off_ms  # from the ruler, which goes through their mean, so the mean offset is 0
        uneven_ms2 = max(0.0, total(off_ms, off_ms) / count - 1 / 12)  # 1/12: variance of cutting to milliseconds
        low = min(count - 1, max(2, count // 20))
        for _ in range(low):
            above_ns[above_ns.argmin()] = math.inf  # sort and partition allocate 3 kB
        apart_ns = _SPREAD * float(above_ns[above_ns.argmin()]) / low if count >= 4 else math.inf
        self._sigma_ns = hypot(apart_ns, math.sqrt(uneven_ms2) * 1e6)
        if self._seed is not None:
            self._bound(self._seed, blur_ms * 0.5e6)
            self._seed = None if count >= _LINE else self._seed

    def _bound(self, seed: _Seed, blur_ns: float) -> None:
        """Use the configured latency, or the middle of the seed's bounds. blur_ns: unknown part of a millisecond."""
        half = STAMP_MODULUS // 2
        before_ms = (seed.stamp_ms - self._first_ms + half) % STAMP_MODULUS - half
        at_seed_ns = self._origin_ns + self._line_ns(before_ms / self._ruler[0])
        counter_ms = seed.stamp_ms - before_ms  # at turn 0, in the seed's count
        least_ns = at_seed_ns - counter_ms * 1e6 - seed.high_ns - blur_ns
        most_ns = at_seed_ns - counter_ms * 1e6 - seed.low_ns + blur_ns
        self.latency_ns = self._stated_ns if least_ns <= self._stated_ns <= most_ns else (least_ns + most_ns) / 2
