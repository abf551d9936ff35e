"""Rules of the bus guard: a small state machine over frames. It sends EMERGENCY_STOP_GUARD and nothing else.

    frames of the computer -> the rules below -> the first offence latches -> EMERGENCY_STOP at once, then at 10 Hz
    RESET_REQUEST, both steps with one nonce -> released, with empty counters

| offence   | when                                                                                   |
|-----------|----------------------------------------------------------------------------------------|
| RATE      | within 0.2 s, an order comes more than 1.5 times its number by the DBC, and 2 more     |
| RANGE     | a good frame orders what this rover cannot do, or what the DBC does not allow          |
| COUNTER   | 8 orders of one id within 1 s do not follow the one before: a second master, or replay |
| CHECKSUM  | 8 orders of one id within 1 s fail their checksum                                      |
| HEARTBEAT | motion is ordered without a heartbeat of the computer for 0.35 s                       |
| ENABLE    | motion is ordered while DRIVE_ENABLE is off, or was not sent for 0.35 s                |
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from enum import IntEnum
from typing import Any, NamedTuple

from onboard.config import Rover
from onboard.records import Frame
from protocol.can.guard import Every, Guard, Sender
from protocol.generated.can_codec import TABLE, StopReason, WheelMode

STOP, RESET_REQUEST, DRIVE_ENABLE, HEARTBEAT = 0x01F, 0x020, 0x100, 0x300
WHEEL_ORDERS = (0x101, 0x102, 0x103, 0x104)
REPEAT_NS = 100_000_000
SILENT_NS = 350_000_000  # three and a half heartbeats at 10 Hz
MOVING_NS = 100_000_000  # an order of motion is in force for this time: the wheels' own timeout
RATE_WINDOW_NS, RATE_FACTOR, RATE_MORE = 200_000_000, 1.5, 2
ODD_WINDOW_NS, ODD_FRAMES = 1_000_000_000, 8
MARGIN = 1e-3  # above a limit, for the DBC's resolution
ORDERS = {can_id: row for can_id, row in TABLE.items() if row.sender == "COMPUTER" and not row.event}


class Offence(IntEnum):
    """Reason of a stop by the guard; bits 12 to 15 of the stop's `detail`, with the id below."""

    RATE = 1
    RANGE = 2
    COUNTER = 3
    CHECKSUM = 4
    HEARTBEAT = 5
    ENABLE = 6


class Verdict(NamedTuple):
    """The offence that latched, with its text for people."""

    offence: Offence
    can_id: int
    text: str

    @property
    def detail(self) -> int:
        """Detail field of the frame, 16 bits."""
        return self.offence << 12 | self.can_id


class _Window:
    """Counter of stamps in a sliding window."""

    def __init__(self, span_ns: int) -> None:
        self._span_ns = span_ns
        self._stamps: deque[int] = deque()

    def add(self, stamp_ns: int) -> int:
        """Add a stamp; return how many are within the window before it."""
        self._stamps.append(stamp_ns)
        while self._stamps[0] <= stamp_ns - self._span_ns:
            self._stamps.popleft()
        return len(self._stamps)


class BusGuard:
    """Guard, active from `start_ns` on. verdict: reason of the present stop; None if there is none."""

    def __init__(self, rover: Rover, start_ns: int = 0) -> None:
        self._rover = rover
        self._sender = Sender()
        self._repeat = Every(REPEAT_NS)
        self.verdict: Verdict | None = None
        self._clean(start_ns)

    def _clean(self, now_ns: int) -> None:
        self._books = Guard()
        self._rates = {can_id: _Window(RATE_WINDOW_NS) for can_id in ORDERS}
        self._odd = {can_id: (_Window(ODD_WINDOW_NS), _Window(ODD_WINDOW_NS)) for can_id in ORDERS}
        self._beat_ns = self._enable_ns = now_ns
        self._enabled = True
        self._moving: tuple[int, int] | None = None  # id and stamp of the last order that moves a wheel
        self._armed: int | None = None  # nonce of the first step of a reset

    def step(self, now_ns: int, frames: Sequence[Frame]) -> list[Frame]:
        """Process the frames since the last call, stamped on this clock; return the frames to send now."""
        for frame in frames:
            if frame.can_id in ORDERS or frame.can_id == RESET_REQUEST:
                self._take(frame)
        if self.verdict is None:
            self._latch(self._while_moving(now_ns))
        if self.verdict is None or not self._repeat.due(now_ns):
            return []
        return [Frame(STOP, self._sender.encode(STOP, StopReason.GUARD, self.verdict.detail), now_ns)]

    def _take(self, frame: Frame) -> None:
        before = self._books.counts(frame.can_id)
        values = self._books.receive(frame)
        after = self._books.counts(frame.can_id)
        if frame.can_id == RESET_REQUEST:
            if values is not None:
                self._reset(values, frame.stamp_ns)
            return
        if values is not None:
            self._note(frame, values)
        if self.verdict is None:
            strange = (after.lost + after.repeated > before.lost + before.repeated, after.crc > before.crc)
            refused = after.out_of_range > before.out_of_range
            self._latch(self._judge(frame, strange) or self._range(frame.can_id, values, refused))

    def _latch(self, verdict: Verdict | None) -> None:
        if verdict is not None:
            self.verdict = verdict
            self._repeat.now()

    def _note(self, frame: Frame, values: Any) -> None:
        """Record the orders that the rules about motion need."""
        can_id, stamp_ns = frame.can_id, frame.stamp_ns
        if can_id == HEARTBEAT:
            self._beat_ns = stamp_ns
        elif can_id == DRIVE_ENABLE:
            self._enable_ns, self._enabled = stamp_ns, bool(values.enable)
        elif can_id in WHEEL_ORDERS and values.mode == WheelMode.RUN and values.rate_radps != 0.0:
            self._moving = can_id, stamp_ns

    def _judge(self, frame: Frame, strange: tuple[bool, bool]) -> Verdict | None:
        """Judge the rate of an id, its counters and checksums."""
        can_id, stamp_ns = frame.can_id, frame.stamp_ns
        row = ORDERS[can_id]
        most = int(RATE_FACTOR * RATE_WINDOW_NS / row.cycle_ns) + RATE_MORE
        count = self._rates[can_id].add(stamp_ns)
        if count > most:
            text = f"{row.name} came {count} times within {RATE_WINDOW_NS / 1e9:g} s, {most} are allowed"
            return Verdict(Offence.RATE, can_id, text)
        for odd, window, offence, words in zip(
            strange, self._odd[can_id], (Offence.COUNTER, Offence.CHECKSUM), ("out of sequence", "damaged")
        ):
            if odd and window.add(stamp_ns) >= ODD_FRAMES:
                text = f"{row.name} came {words} {ODD_FRAMES} times within {ODD_WINDOW_NS / 1e9:g} s"
                return Verdict(offence, can_id, text)
        return None

    def _range(self, can_id: int, values: Any, refused: bool) -> Verdict | None:
        """Judge a value that the DBC refuses in a frame with a good checksum, or that this rover cannot do."""
        name = ORDERS[can_id].name
        if refused:
            return Verdict(Offence.RANGE, can_id, f"{name} holds a value that the DBC does not allow")
        if values is None or can_id not in WHEEL_ORDERS:
            return None
        rover = self._rover
        for what, value, limit in (
            ("steer_rad", values.steer_rad, rover.steer_limit_rad),
            ("rate_radps", values.rate_radps, rover.wheel_rate_limit_radps),
        ):
            if abs(value) > limit + MARGIN:
                return Verdict(Offence.RANGE, can_id, f"{name}.{what} = {value:.3f}, this rover has {limit:.3f}")
        return None

    def _while_moving(self, now_ns: int) -> Verdict | None:
        """Judge motion without heartbeat or without DRIVE_ENABLE."""
        if self._moving is None or now_ns - self._moving[1] > MOVING_NS:
            return None
        can_id = self._moving[0]
        name = ORDERS[can_id].name
        if now_ns - self._beat_ns > SILENT_NS:
            text = f"{name} orders motion, the computer has not beaten for {(now_ns - self._beat_ns) / 1e9:.2f} s"
            return Verdict(Offence.HEARTBEAT, can_id, text)
        if not self._enabled or now_ns - self._enable_ns > SILENT_NS:
            said = "says no" if not self._enabled else f"is {(now_ns - self._enable_ns) / 1e9:.2f} s old"
            return Verdict(Offence.ENABLE, can_id, f"{name} orders motion, DRIVE_ENABLE {said}")
        return None

    def _reset(self, values: Any, stamp_ns: int) -> None:
        """Release after two steps with one nonce, as on every node."""
        if values.step == 1:
            self._armed = values.nonce
        elif self._armed == values.nonce and self.verdict is not None:
            self.verdict = None
            self._clean(stamp_ns)
