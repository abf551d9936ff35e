"""Common base of the ends of a scanner's cable: one client, a backlog, counts; for a single-threaded loop.

`poll`, `write` and `put` never block; the arrival or loss of a client is a state. Bytes that a slow reader does not
take wait in the backlog; beyond BACKLOG whole scans (of `write`, whole writes) are dropped and counted, never cut. For
the lock-step `received` and `sent` count the bytes of this `epoch`; each client begins a new one.
"""

from __future__ import annotations

import select
import time
from abc import ABC, abstractmethod

from hil.devices.lidar.sensor import Piece

BACKLOG = 1 << 18
POLL_LIMIT = 1 << 16
REPLIES_BACKLOG = 1 << 20  # for a client that sends requests without end and never reads


class Cable(ABC):
    """Base class of both ends: counts, backlog and waiting. `address` is the value of onboard's lidar.address."""

    def __init__(self) -> None:
        self.address = ""
        self.epoch = self.received = self.sent = self.dropped = 0
        self._refusing = self._dropping = False
        self._backlog = bytearray()

    @property
    def hung_up(self) -> bool:
        """True if waiting on fileno() is useless: no client has the terminal open."""
        return False

    @property
    def waits_to_send(self) -> bool:
        """True if bytes for the client wait in the backlog."""
        return bool(self._backlog)

    @property
    @abstractmethod
    def connected(self) -> bool:
        """True if a client is connected, as of the last poll or write."""

    @abstractmethod
    def fileno(self) -> int:
        """Descriptor to wait on for input, -1 if there is none."""

    @abstractmethod
    def disconnect(self) -> None:
        """Disconnect the client, as if the cable were unplugged."""

    @abstractmethod
    def close(self) -> None:
        """Free the port or the terminal."""

    def refuse(self, refusing: bool) -> None:
        """Refuse new clients while True (a sensor that boots)."""
        self._refusing = refusing

    def poll(self) -> bytes:
        """Accept a waiting client and return the bytes since the last call; at most about POLL_LIMIT at once."""
        self._accept()
        self._flush()
        received = bytearray()
        while len(received) < POLL_LIMIT and (piece := self._read()):
            received += piece
        self.received += len(received)
        return bytes(received)

    def poll_exactly(self, total_bytes: int, limit_s: float) -> bytes:
        """Call poll() until `total_bytes` of this epoch were received; returns fewer if the client disconnects.

        Raises TimeoutError if they do not arrive within `limit_s` of wall time.
        """
        end_s, received = time.monotonic() + limit_s, self.poll()
        while self.received < total_bytes and self.connected:
            if not self._wait(end_s):
                raise TimeoutError(f"{self.address}: {total_bytes} bytes were announced, {self.received} came")
            received += self.poll()
        return received

    def wait_client(self, limit_s: float) -> bool:
        """Wait for a client for at most `limit_s` of wall time; True if one is connected. Its bytes stay unread."""
        end_s = time.monotonic() + limit_s
        self._accept()
        while not self.connected and self._wait(end_s):
            self._accept()
        return self.connected

    def write(self, data: bytes) -> int:
        """Send or queue; returns the number of bytes accepted: all, or 0 without a client or with a full backlog."""
        if not self.connected:
            self._backlog.clear()
            return 0
        if len(self._backlog) > BACKLOG:
            self.dropped += 1
            return 0
        self._backlog += data
        self._flush()
        self.sent += len(data)
        return len(data)

    def put(self, piece: Piece) -> None:
        """Send or queue a piece of a reply or scan; a scan that begins with a full backlog is dropped."""
        if piece.begins:
            self._dropping = len(self._backlog) > (BACKLOG if piece.scan else REPLIES_BACKLOG)
            self.dropped += self._dropping
        if self.connected and not self._dropping:
            self._backlog += piece.data
            self._flush()
            self.sent += len(piece.data)

    def _began(self) -> None:
        self.epoch += 1
        self._dropping = False
        self.received = self.sent = 0
        self._backlog.clear()

    def _wait(self, end_s: float) -> bool:
        left_s = end_s - time.monotonic()
        waiting = select.poll()
        if self.fileno() >= 0:
            waiting.register(self.fileno(), select.POLLIN)
        if left_s > 0 and any(event & select.POLLHUP for _, event in waiting.poll(left_s * 1000)):
            time.sleep(min(left_s, 0.002))  # a terminal without client is always "ready"
        return left_s > 0

    @abstractmethod
    def _accept(self) -> None:
        """Accept a waiting client, if there is one."""

    @abstractmethod
    def _read(self) -> bytes:
        """Bytes that the client sent, b'' for none."""

    @abstractmethod
    def _flush(self) -> None:
        """Send the bytes that the line takes now."""
