"""Events over the link, both ends: stored and retransmitted until the ground has acknowledged them.

    rover: EventSender                                     ground: EventReceiver
      |  EVENT serial 7, again after 2 s, 4 s, ... 30 s  -->  |  new or known, by serial
      |  <---- acknowledgement, at most one a second          |  all up to `base`, and bits of those after it

An acknowledgement is a Kind.REPORT datagram going up: base u32, then bits (bit n: serial base + 1 + n). The rover
stores at most CAPACITY events and drops older ones; the ground does not wait for those.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import Any

from protocol import WireError
from protocol.visible import visible

CAPACITY = 512
TEXT_BYTES = 112
_BASE = struct.Struct("<I")
_FIRST_NS, _LONGEST_NS, _ACK_NS = 2_000_000_000, 30_000_000_000, 1_000_000_000


class EventSender:
    """Retransmission queue of event frames by serial number, from 1; over CAPACITY it drops and counts the oldest."""

    def __init__(self) -> None:
        self.serial, self.dropped = 0, 0
        self._waiting: dict[int, tuple[bytes, int, int]] = {}  # serial -> frame, due_ns, wait_ns
        self._next_ns = 1 << 62

    def __len__(self) -> int:
        return len(self._waiting)

    def add(self, frame: bytes, now_ns: int) -> None:
        """Store a frame under the next serial. The frame carries that serial: `serial` + 1 before the call."""
        self.serial += 1
        self._waiting[self.serial] = (frame, now_ns, _FIRST_NS)
        self._next_ns = min(self._next_ns, now_ns)
        if len(self._waiting) > CAPACITY:
            del self._waiting[next(iter(self._waiting))]
            self.dropped += 1

    def due(self, now_ns: int) -> Iterator[tuple[int, bytes]]:
        """Yield serial and frame of each due event, oldest first. Call `sent` for each one that was sent."""
        if now_ns < self._next_ns:
            return
        for serial, (frame, due_ns, _) in list(self._waiting.items()):
            if due_ns <= now_ns:
                yield serial, frame
        self._next_ns = min((row[1] for row in self._waiting.values()), default=1 << 62)

    def sent(self, serial: int, now_ns: int) -> None:
        """Schedule the retransmission of a sent frame; the interval doubles each time, up to 30 s."""
        frame, _, wait_ns = self._waiting[serial]
        self._waiting[serial] = (frame, now_ns + wait_ns, min(2 * wait_ns, _LONGEST_NS))

    def hurry(self, now_ns: int) -> None:
        """Make all stored events due now, because contact is back."""
        self._waiting = {s: (frame, now_ns, _FIRST_NS) for s, (frame, _, _) in self._waiting.items()}
        self._next_ns = now_ns

    def acknowledge(self, payload: bytes) -> None:
        """Delete the events that the ground has acknowledged. Raises WireError("ack") on a malformed payload."""
        if not _BASE.size <= len(payload) <= _BASE.size + CAPACITY // 8:
            raise WireError("ack", f"{len(payload)} B")
        base, bits = _BASE.unpack_from(payload)[0], int.from_bytes(payload[_BASE.size :], "little")
        for serial in list(self._waiting):
            if serial <= base or bits >> (serial - base - 1) & 1:
                del self._waiting[serial]


class EventReceiver:
    """Ground's end for one boot of the rover. Create a new receiver for a new boot."""

    def __init__(self) -> None:
        self._base, self._later = 0, set[int]()
        self._news, self._acked_ns = False, -(1 << 62)

    def receive(self, serial: int) -> bool:
        """Register a received serial; return True if it is new."""
        self._news = True
        if serial <= self._base or serial in self._later:
            return False
        self._later.add(serial)
        self._base = max(self._base, serial - CAPACITY)
        while self._base + 1 in self._later:
            self._base += 1
        self._later = {s for s in self._later if s > self._base}
        return True

    def send(self, now_ns: int) -> list[bytes]:
        """Return the acknowledgement if events arrived since the last one, at most once a second."""
        if not self._news or now_ns - self._acked_ns < _ACK_NS:
            return []
        self._news, self._acked_ns = False, now_ns
        bits = sum(1 << s - self._base - 1 for s in self._later)
        return [_BASE.pack(self._base) + bits.to_bytes((bits.bit_length() + 7) // 8, "little")]


def texts(message: Any) -> tuple[str, str]:
    """Name and text of a decoded EVENT message, control characters visible (pymavlink's attribute is ASCII only)."""
    raw = message._name_raw, message._text_raw
    name, text = (visible(one.decode(errors="replace")) for one in raw)
    return name, text
