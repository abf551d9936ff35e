"""Tilt axis of the scanner as the computer sees it: its clock, the track of its angle, the sweeps ordered.

Node clock -> onboard time, the arrival envelope:

    arrival - node time                     Rule 1: the frames that waited least show the true offset, so the estimate
      |    .  .      .   . . .                      is the lower envelope of (arrival - node time).
      |  . __.___.___.______.__ envelope    Rule 2: it may rise by LEAK_PPM, more than the two clocks drift apart.
      +------------------------ time        Rule 3: a step of more than JUMP_US is another clock: start again.

A sweep is sent segment by segment, without gaps: each start time is the end of the segment before as the node will
compute it from the frame's own resolution, and each rate is rounded so that the sweep stays on its planned time.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from onboard.records import TiltTrack
from protocol.can.guard import Every
from protocol.generated.can_codec import TiltFeedbackFrame, TiltMode, TiltState

LEAK_PPM = 200
JUMP_US = 50_000
KEEP_NS = 40_000_000_000
ANGLE_STEP_RAD = math.radians(0.02)  # of TILT_COMMAND
RATE_STEP_RADPS = math.radians(0.125)
RATE_STEPS = 255
AHEAD_NS, LEAST_AHEAD_NS = 300_000_000, 200_000_000
REPEAT_NS = 100_000_000
PARK_RATE_RADPS = 160 * RATE_STEP_RADPS
SETTLE_NS = 50_000_000
_MS = 1_000_000


class SegmentLike(Protocol):
    """Segment of a sweep, such as perception.scan.sweep.TiltSegment."""

    @property
    def start_rad(self) -> float: ...  # noqa: D102
    @property
    def end_rad(self) -> float: ...  # noqa: D102
    @property
    def rate_radps(self) -> float: ...  # noqa: D102
    @property
    def duration_ns(self) -> int: ...  # noqa: D102


class TiltOrder(NamedTuple):
    """One TILT_COMMAND with its start and end in onboard time."""

    start_rad: float
    end_rad: float
    rate_radps: float
    start_ns: int
    end_ns: int
    mode: TiltMode

    def values(self) -> tuple[float, float, float, int, int]:
        """Fields of the frame."""
        return self.start_rad, self.end_rad, self.rate_radps, self.start_ns // _MS & 0xFFFF, self.mode


def _parked(angle_rad: float, now_ns: int) -> TiltOrder:
    return TiltOrder(angle_rad, angle_rad, PARK_RATE_RADPS, now_ns, now_ns, TiltMode.PARK)


def orders(segments: Sequence[SegmentLike], start_ns: int) -> list[TiltOrder]:
    """Return a sweep in the frame's resolution, its segments joined in angle and to the millisecond in time.

    Raises ValueError for an empty sweep, or a segment without motion or duration.
    """
    if not segments:
        raise ValueError("a sweep needs at least one segment")
    made: list[TiltOrder] = []
    at_ns = planned_ns = -(-start_ns // _MS) * _MS
    for number, segment in enumerate(segments):
        start, end = round(segment.start_rad / ANGLE_STEP_RAD), round(segment.end_rad / ANGLE_STEP_RAD)
        planned_ns += segment.duration_ns
        if start == end or planned_ns <= at_ns:
            raise ValueError(f"segment {number} of the sweep, {segment!r}, has no motion or no time")
        way_rad = abs(end - start) * ANGLE_STEP_RAD
        steps = max(1, min(RATE_STEPS, round(way_rad / ((planned_ns - at_ns) / 1e9) / RATE_STEP_RADPS)))
        end_ns = at_ns + math.ceil(way_rad / (steps * RATE_STEP_RADPS) * 1000.0 - 1e-6) * _MS
        made.append(
            TiltOrder(
                start * ANGLE_STEP_RAD, end * ANGLE_STEP_RAD, steps * RATE_STEP_RADPS, at_ns, end_ns, TiltMode.SWEEP
            )
        )
        at_ns = end_ns
    return made


class Tilt:
    """Tilt axis: feedback in, orders out."""

    def __init__(self) -> None:
        self.state: TiltState | None = None
        self.angle_rad: float | None = None
        self.rate_radps = 0.0
        self.stamp_ns = 0
        self.clock_jumps = 0
        self._node_us = self._offset_us = 0.0
        self._times_ns: list[int] = []
        self._angles_rad: list[float] = []
        self._sweep: list[TiltOrder] = []
        self._sent = -1  # segments of the sweep sent; -1 before the order to park at its start
        self._order: TiltOrder | None = None
        self.plan = 0  # number of the newest order: a sweep, or an angle to park at
        self._from_rad = 0.0  # angle of the axis when it was ordered to park
        self._repeat = Every(REPEAT_NS)

    @property
    def moving(self) -> bool:
        """True if the node reports that the axis moves."""
        return self.state in (TiltState.MOVING, TiltState.SWEEPING, TiltState.GAP)

    def feedback(self, values: TiltFeedbackFrame, stamp_ns: int) -> None:
        """Process one TILT_FEEDBACK that arrived at `stamp_ns`."""
        time_ns = self._onboard_ns(values.node_time_us, stamp_ns)
        if self._times_ns and time_ns <= self._times_ns[-1]:
            time_ns = self._times_ns[-1] + 1
        self._times_ns.append(time_ns)
        self._angles_rad.append(values.angle_rad)
        self.angle_rad, self.rate_radps = values.angle_rad, values.rate_radps
        known = values.state <= max(TiltState)  # a state that the DBC does not have is no sweep
        self.state, self.stamp_ns = TiltState(values.state) if known else TiltState.OFF, stamp_ns
        if self._times_ns[0] < time_ns - 2 * KEEP_NS:
            old = bisect_left(self._times_ns, time_ns - KEEP_NS)
            del self._times_ns[:old], self._angles_rad[:old]

    def track(self, since_ns: int) -> TiltTrack:
        """Samples from `since_ns` on, of the last 40 s at least; empty if there are none."""
        first = bisect_left(self._times_ns, since_ns)
        return TiltTrack(
            np.array(self._times_ns[first:], dtype=np.int64), np.array(self._angles_rad[first:], dtype=np.float64)
        )

    def sweep(self, segments: Sequence[SegmentLike], start_ns: int) -> None:
        """Park at the start angle, then sweep from `start_ns`; postponed if nearer than 0.2 s. ValueError: `orders`."""
        self._sweep, self._sent, self._order = orders(segments, start_ns), -1, None
        self.plan += 1

    def park(self, angle_rad: float, now_ns: int) -> None:
        """End a sweep and hold the axis at an angle; an order already in force is not sent again out of turn."""
        limit = 4095 * ANGLE_STEP_RAD
        angle_rad = max(-limit, min(limit, angle_rad))
        self._sweep, self._sent = [], -1
        if self._order is not None and self._order.mode is TiltMode.PARK and self._order.end_rad == angle_rad:
            return
        self._order = _parked(angle_rad, now_ns)
        self.plan += 1
        self._from_rad = self.angle_rad if self.angle_rad is not None else angle_rad
        self._repeat.now()

    def ordered_rad(self, at_ns: int) -> float | None:
        """Angle ordered for a time, by the orders sent so far; None before the first."""
        for sent in reversed(self._sweep[: max(0, self._sent)]):
            if at_ns >= sent.start_ns:
                share = min(1.0, (at_ns - sent.start_ns) / (sent.end_ns - sent.start_ns))
                angle_rad: float = sent.start_rad + share * (sent.end_rad - sent.start_rad)
                return angle_rad
        if self._sweep:
            return self._sweep[0].start_rad
        if self._order is None or self._order.mode is not TiltMode.PARK:
            return None
        way_rad = self._order.end_rad - self._from_rad
        made_rad = max(0, at_ns - self._order.start_ns) / 1e9 * self._order.rate_radps
        return self._from_rad + math.copysign(min(abs(way_rad), made_rad), way_rad)

    def sweep_done(self, now_ns: int) -> bool:
        """Return whether the last sweep has ended and its last samples are in; False if none was begun."""
        return bool(self._sweep) and self._sent == len(self._sweep) and now_ns >= self._sweep[-1].end_ns + SETTLE_NS

    def send(self, now_ns: int) -> tuple[float, float, float, int, int] | None:
        """Return the values of the TILT_COMMAND that is due, or None."""
        if self._sweep and self._sent < 0:  # end any other sweep that the node still has
            self._sent = 0
            return _parked(self._sweep[0].start_rad, now_ns).values()
        if self._sent == 0:
            self._postpone(now_ns)
        if self._next_is_due(now_ns):
            self._order = self._sweep[self._sent]
            self._sent += 1
            self._repeat = Every(REPEAT_NS, now_ns + REPEAT_NS)
            return self._order.values()
        if self._order is None or not self._repeat.due(now_ns):
            return None
        if self._order.mode is TiltMode.SWEEP and now_ns > self._order.end_ns + SETTLE_NS:
            # a start time older than half its window would be read as a future one
            self._order = _parked(self._order.end_rad, now_ns)
        return self._order.values()

    def _next_is_due(self, now_ns: int) -> bool:
        if not 0 <= self._sent < len(self._sweep):
            return False
        return self._sent == 0 or now_ns >= self._sweep[self._sent].start_ns - AHEAD_NS

    def digest(self) -> tuple[float | int, ...]:
        """Values of this state that go into the state digest."""
        angle_rad = -10.0 if self.angle_rad is None else self.angle_rad
        return angle_rad, self.stamp_ns, self._offset_us, len(self._times_ns), self._sent, len(self._sweep)

    def _postpone(self, now_ns: int) -> None:
        late_ns = now_ns + LEAST_AHEAD_NS - self._sweep[0].start_ns
        if late_ns > 0:
            late_ns = -(-late_ns // _MS) * _MS
            self._sweep = [o._replace(start_ns=o.start_ns + late_ns, end_ns=o.end_ns + late_ns) for o in self._sweep]

    def _onboard_ns(self, node_time_us: int, stamp_ns: int) -> int:
        """Convert a node's time to onboard time (rules 1 to 3)."""
        arrival_us = stamp_ns / 1000.0
        elapsed_us = arrival_us - self.stamp_ns / 1000.0
        expected_us = self._node_us + elapsed_us
        step_us = (node_time_us - expected_us + 8388608.0) % 16777216.0 - 8388608.0
        if not self._times_ns or abs(step_us) > JUMP_US:
            self.clock_jumps += bool(self._times_ns)
            self._node_us = float(node_time_us)
            self._offset_us = arrival_us - self._node_us
        else:
            self._node_us = expected_us + step_us
            self._offset_us = min(self._offset_us + elapsed_us * (LEAK_PPM / 1e6), arrival_us - self._node_us)
        return round((self._node_us + self._offset_us) * 1000.0)
