"""Emulated node of the scanner's tilt axis: clock, segments of constant rate, lag, encoder.

    angle        start_1                     Segments come as TILT_COMMAND at least 0.2 s ahead; the node holds the
      |  \\         |                          running one and the next two. Start times are bus time, which it knows
      |    \\_______\\                         from TIME_SYNC; its stamps are its own free-running clock's.
      |  end_0 = start_1  \\ ...
      +---------------------- bus time

The true angle is linear between knots KNOT_NS apart. The encoder is on the motor. The scanner follows the motor; with
backlash it stays where it is when the motor turns back, until the play is taken up. Not modelled: acceleration limit
other than the lag.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hil.devices.can.errors import USUAL, TiltErrors
from hil.devices.can.node import Node, Noise
from hil.records import PlantState
from onboard.native import elementary
from onboard.records import Frame
from protocol.can.guard import Every
from protocol.generated import can_codec
from protocol.generated.can_codec import TiltMode, TiltState

COMMAND, TIME_SYNC, FEEDBACK = 0x120, 0x080, 0x1C0
KNOT_NS = 2_500_000
FAST_NS, PARKED_NS = 5_000_000, 100_000_000
SLEW_RADPS = math.radians(31.875)
GAP_MS = 5.0
PENDING = 2
HISTORY = 16384  # knots; when it is full, half of them, 20 s, stay


class Segment(NamedTuple):
    """One constant-rate segment in bus time."""

    start_ms: float
    start_rad: float
    end_rad: float
    rate_radps: float

    @property
    def end_ms(self) -> float:
        """End time."""
        return self.start_ms + 1000.0 * abs(self.end_rad - self.start_rad) / max(self.rate_radps, 1e-6)

    def angle_rad(self, at_ms: float) -> float:
        """Commanded angle; constant before the start and after the end."""
        way = self.end_rad - self.start_rad
        done = max(0.0, at_ms - self.start_ms) / 1000.0 * self.rate_radps
        return self.end_rad if done >= abs(way) else self.start_rad + math.copysign(done, way)


class TiltNode(Node):
    """Emulated tilt axis.

    encoder_step_rad: resolution of the reported angle; 0 for none
    stalled: fault: the axis does not move
    clock_jump_us: fault: added to the node's clock
    silent: fault, see Node
    """

    def __init__(self, rng: np.random.Generator, errors: TiltErrors = USUAL.tilt) -> None:
        super().__init__("TILT", {TIME_SYNC, COMMAND}, rng)
        self.stalled = False
        self.clock_jump_us = 0
        self.encoder_step_rad = errors.encoder_step_rad
        self._follow = 1.0 - elementary.exp(-KNOT_NS / 1e9 / errors.lag_s)
        self._play_rad = errors.backlash_rad / 2
        self.gap = False
        self._rate_error = float(rng.uniform(-errors.rate_error_ratio, errors.rate_error_ratio))
        self._clock_us = int(rng.integers(1 << 24))
        self._delay = Noise(rng)
        self._bus_minus_node_us: float | None = None
        self._park_rad, self._park_radps = 0.0, SLEW_RADPS
        self._running: Segment | None = None
        self._next: list[Segment] = []
        self._set_rad = self._angle_rad = self._scanner_rad = self._way_rad = 0.0
        self._knots_ns = 0
        self._times_ns = np.zeros(HISTORY)
        self._angles_rad = np.zeros(HISTORY)
        self._times_ns[0], self._filled = -1e9, 2
        self._parked = Every(PARKED_NS)

    @property
    def state(self) -> TiltState:
        """State in TILT_FEEDBACK."""
        if self.latched:
            return TiltState.RESET_ARMED if self.armed else TiltState.EMERGENCY_STOP
        if self._running is not None:
            return TiltState.GAP if self.gap else TiltState.SWEEPING
        moving = bool(self._next) or abs(self._park_rad - self._angle_rad) > 1e-3
        return TiltState.MOVING if moving and not self.stalled else TiltState.PARKED

    def angles_at(self, times_ns: NDArray[np.int64]) -> NDArray[np.float64]:
        """True tilt angle, (n,) float64 in rad, at times of the last 20 s, (n,) int64; constant after the last knot."""
        n = self._filled
        return np.interp(np.asarray(times_ns, dtype=np.float64), self._times_ns[:n], self._angles_rad[:n])

    def step(self, now_ns: int, truth: PlantState) -> None:
        """Move the axis to `now_ns` and sample the encoder. The plant does not act on the axis."""
        if self.silent:
            self._set_rad = self._angle_rad
        while self._knots_ns + KNOT_NS <= now_ns:
            self._knots_ns += KNOT_NS
            limit = self._limit_radps() * (KNOT_NS / 1e9)
            wanted = self._wanted_rad(self._knots_ns) - self._set_rad
            before_rad = self._angle_rad
            if not (self.stalled or self.silent or self.latched):
                self._set_rad += max(-limit, min(limit, wanted))
                self._angle_rad += self._follow * (self._set_rad - self._angle_rad)
            self._way_rad = self._angle_rad - before_rad
            low_rad, high_rad = self._angle_rad - self._play_rad, self._angle_rad + self._play_rad
            self._scanner_rad = min(max(self._scanner_rad, low_rad), high_rad)
            self._remember(self._knots_ns, self._scanner_rad)
            if self._knots_ns % FAST_NS == 0 and not self.silent:
                self._sample(self._knots_ns)
        self.beat(now_ns)

    def _limit_radps(self) -> float:
        return SLEW_RADPS if self._running or self._next else self._park_radps

    def _wanted_rad(self, at_ns: int) -> float:
        """Commanded angle; starts the next segment when its time has come."""
        if self._bus_minus_node_us is None or not (self._running or self._next):
            return self._park_rad
        bus_ms = (self._node_us(at_ns) + self._bus_minus_node_us) / 1000.0
        while self._next and self._next[0].start_ms <= bus_ms:
            self._begin(self._next.pop(0))
        if self._running is None:
            return self._next[0].start_rad
        if bus_ms >= self._running.end_ms:
            self._park_rad, self._park_radps = self._running.end_rad, SLEW_RADPS
            if not self._next:
                self._running = None
                return self._park_rad
            self.gap |= self._next[0].start_ms > self._running.end_ms + GAP_MS
        return self._running.angle_rad(bus_ms)

    def _begin(self, segment: Segment) -> None:
        self.gap |= abs(segment.start_rad - self._set_rad) > math.radians(0.3)
        self._running = segment

    def order(self, can_id: int, values: NamedTuple, now_ns: int) -> None:
        """Handle TIME_SYNC or TILT_COMMAND."""
        if can_id == TIME_SYNC and isinstance(values, can_codec.TimeSyncFrame):
            self._bus_minus_node_us = values.bus_time_us - self._node_us(now_ns)
        elif isinstance(values, can_codec.TiltCommandFrame) and not self.latched:
            if values.mode == TiltMode.SWEEP:
                self._queue(values, now_ns)
            else:
                self._hold(values.end_rad if values.mode == TiltMode.PARK else self._angle_rad)
                self._park_radps = values.rate_radps or SLEW_RADPS

    def _queue(self, values: can_codec.TiltCommandFrame, now_ns: int) -> None:
        if self._bus_minus_node_us is None:
            return
        bus_ms = (self._node_us(now_ns) + self._bus_minus_node_us) / 1000.0
        start_ms = bus_ms + (values.start_ms - bus_ms + 32768.0) % 65536.0 - 32768.0
        segment = Segment(float(round(start_ms)), values.start_rad, values.end_rad, values.rate_radps)
        newest = self._next[-1] if self._next else self._running
        if newest is not None and segment.start_ms <= newest.start_ms:
            return  # a repeat
        if segment.end_ms < bus_ms:
            return  # a repeat of an ended segment
        if len(self._next) < PENDING:
            self.gap |= newest is not None and start_ms < bus_ms - GAP_MS
            self._next.append(segment)

    def _hold(self, angle_rad: float) -> None:
        self._running, self._next, self.gap, self._park_rad = None, [], False, angle_rad

    def stopped(self) -> None:
        """Hold the axis at its angle."""
        self._set_rad = self._angle_rad
        self._hold(self._angle_rad)

    def _node_us(self, at_ns: int) -> float:
        return self._clock_us + self.clock_jump_us + at_ns * (1.0 + self._rate_error) / 1000.0

    def _remember(self, at_ns: int, angle_rad: float) -> None:
        if self._filled == HISTORY:
            keep = HISTORY // 2
            self._times_ns[:keep], self._angles_rad[:keep] = self._times_ns[-keep:], self._angles_rad[-keep:]
            self._filled = keep
        self._times_ns[self._filled], self._angles_rad[self._filled] = at_ns, angle_rad
        self._filled += 1

    def _sample(self, stamp_ns: int) -> None:
        """Queue a TILT_FEEDBACK that arrives at `stamp_ns`, with the encoder's value 0.1 to 0.4 ms earlier."""
        state = self.state
        if state is TiltState.PARKED and not self._parked.due(stamp_ns):
            return
        delay_ns = 100_000 + int(min(300_000.0, abs(self._delay.next()) * 100_000.0))
        way = self._way_rad
        angle_rad = self._angle_rad - way * delay_ns / KNOT_NS
        if self.encoder_step_rad:
            angle_rad = round(angle_rad / self.encoder_step_rad) * self.encoder_step_rad
        node_us = int(self._node_us(stamp_ns - delay_ns)) & 0xFFFFFF
        rate_radps = max(-0.6, min(0.6, way * 1e9 / KNOT_NS))
        self.out.append(Frame(FEEDBACK, self.sender.encode(FEEDBACK, node_us, angle_rad, rate_radps, state), stamp_ns))
