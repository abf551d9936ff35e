"""Non-blocking port of bytes: the common part of a scanner's TCP and tty; gives bytes and their arrival time.

`read` returns BYTES_PER_S at most, BURST_BYTES after a pause: more than any scanner sends. The rest waits in the
kernel, whose buffers are bounded. A port never raises for errors of a cable: at end of stream, reset or unplugging
`state` is ERROR until `connect()` is called again. The counts `received` and `sent` belong to this `epoch`; each
successful connection starts a new epoch.
"""

from __future__ import annotations

import contextlib
import os
import select
import time
from abc import ABC, abstractmethod

from onboard.drivers.budget import Budget
from onboard.records import Chunk, PortState

_PIECE = 65536


class LidarPort(ABC):
    """Common part of TCP and tty: a non-blocking descriptor. Subclasses open it.

    error: one line for people: why the last attempt or the connection failed and what to do; empty if all is well.
    """

    BYTES_PER_S, BURST_BYTES = 2_000_000, 131_072  # three echoes of 1081 beams, 40 scans a second: 880,000

    def __init__(self, address: str) -> None:
        self.address = address
        self.state = PortState.CLOSED
        self.error = ""
        self.epoch = 0
        self.received = 0
        self.sent = 0
        self._fd = -1
        self._pending = bytearray()  # read beyond the bytes requested by read_exactly
        self._unsent = bytearray()
        self._budget = Budget(self.BYTES_PER_S, self.BURST_BYTES)

    @abstractmethod
    def connect(self) -> None:
        """Start one attempt without waiting; while one is under way, check its result."""

    def fileno(self) -> int:
        """The descriptor to wait on, -1 while closed."""
        return self._fd

    def read(self, stamp_ns: int) -> tuple[Chunk, ...]:
        """Return the bytes available within the budget as one Chunk stamped `stamp_ns`; empty if there are none."""
        self._advance()
        before = self.received
        self._fill(self._budget.grant(stamp_ns))
        self._budget.spend(max(0, self.received - before))
        if not self._pending:
            return ()
        data = bytes(self._pending)
        self._pending.clear()
        return (Chunk(stamp_ns, data),)

    def read_exactly(self, total_bytes: int, limit_s: float) -> bytes:
        """Wait until `total_bytes` of this epoch came; return those not yet returned and store later ones.

        Returns fewer if the stream ended. Raises TimeoutError if they did not come within `limit_s` of wall time.
        """
        end_s = time.monotonic() + limit_s
        start = self.received - len(self._pending)
        while True:
            self._advance()
            self._fill(total_bytes - self.received)
            over = self.state is not PortState.OPEN and self._fd < 0
            if self.received >= total_bytes or over:
                break
            if not self._wait(end_s):
                raise TimeoutError(f"{total_bytes} bytes were announced on {self.address}, {self.received} came")
        size = max(0, min(total_bytes, self.received) - start)
        data = bytes(self._pending[:size])
        del self._pending[:size]
        return data

    def wait_open(self, limit_s: float) -> PortState:
        """Wait until an attempt of connect() is decided, at most `limit_s` of wall time; return the state."""
        end_s = time.monotonic() + limit_s
        self._advance()
        while self.state is PortState.CLOSED and self._fd >= 0 and self._wait(end_s):
            self._advance()
        return self.state

    def write(self, data: bytes) -> None:
        """Send all of it; bytes that the line does not take now are sent by the next call of read or write."""
        if self.state is PortState.OPEN:
            self._unsent += data
            self.sent += len(data)
            self._flush()

    def close(self) -> None:
        """Close the port."""
        self._drop(PortState.CLOSED)

    # -- inside ------------------------------------------------------------------------------------------------

    def _advance(self) -> None:
        """Check an attempt under way (TCP), and send waiting bytes."""
        self._flush()

    def _opened(self) -> None:
        self.state = PortState.OPEN
        self.error = ""
        self.epoch += 1
        self.received = self.sent = 0
        self._pending.clear()
        self._unsent.clear()

    def _drop(self, state: PortState) -> None:
        if self._fd >= 0:
            with contextlib.suppress(OSError):
                os.close(self._fd)
        self._fd = -1
        self._unsent.clear()
        self.state = state

    def _fill(self, at_most: int) -> None:
        left = at_most
        while self.state is PortState.OPEN and left > 0:
            try:
                piece = os.read(self._fd, min(left, _PIECE))
            except (BlockingIOError, InterruptedError):
                return
            except OSError as error:
                self._fail(f"{self.address} is gone: {error.strerror}; it is opened again when it is back")
                return
            if not piece:
                self._fail(f"{self.address} is gone: unplugged, or closed by the other side; it is opened again")
                return
            self._pending += piece
            self.received += len(piece)
            left -= len(piece)

    def _flush(self) -> None:
        while self._unsent and self.state is PortState.OPEN:
            try:
                del self._unsent[: os.write(self._fd, self._unsent)]
            except (BlockingIOError, InterruptedError):
                return
            except OSError as error:
                self._fail(f"{self.address} is gone: {error.strerror}; it is opened again when it is back")

    def _fail(self, error: str) -> None:
        self._drop(PortState.ERROR)
        self.error = error

    def _wait(self, end_s: float) -> bool:
        left_s = end_s - time.monotonic()
        if left_s > 0:
            waiting = select.poll()
            waiting.register(self._fd, select.POLLIN if self.state is PortState.OPEN else select.POLLOUT)
            waiting.poll(left_s * 1000)
        return left_s > 0
