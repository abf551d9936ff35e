"""The scanner's byte port: a TCP socket or a tty behind one interface, bytes and their arrival time, nothing else.

A port never raises for what a cable does: end of stream, reset, unplugged are `state` ERROR until `connect()` is
called again. Counts (`received`, `sent`) are of this `epoch`; each connection that comes about begins a new one.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import select
import socket
import termios
import time
import tty
from abc import ABC, abstractmethod

from onboard.config import ConfigError
from onboard.records import Chunk, PortState

_PIECE = 65536


class LidarPort(ABC):
    """What TCP and tty have in common: a non-blocking descriptor. Subclasses say how it is opened."""

    def __init__(self, address: str) -> None:
        self.address = address
        self.state = PortState.CLOSED
        self.epoch = 0
        self.received = 0
        self.sent = 0
        self._fd = -1
        self._pending = bytearray()  # read, but beyond what read_exactly was asked for
        self._unsent = bytearray()

    @abstractmethod
    def connect(self) -> None:
        """One attempt, without waiting; while an attempt is under way, look whether it came through."""

    def fileno(self) -> int:
        """The descriptor to wait on, -1 while closed."""
        return self._fd

    def read(self, stamp_ns: int) -> tuple[Chunk, ...]:
        """Whatever is there, as one Chunk stamped `stamp_ns`; empty if nothing is."""
        self._advance()
        self._fill()
        if not self._pending:
            return ()
        data = bytes(self._pending)
        self._pending.clear()
        return (Chunk(stamp_ns, data),)

    def read_exactly(self, total_bytes: int, limit_s: float) -> bytes:
        """Wait until `total_bytes` of this epoch came, and return those not yet returned; later ones are kept back.

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
        """Wait until an attempt of connect() is decided, at most `limit_s` of wall time. The state then."""
        end_s = time.monotonic() + limit_s
        self._advance()
        while self.state is PortState.CLOSED and self._fd >= 0 and self._wait(end_s):
            self._advance()
        return self.state

    def write(self, data: bytes) -> None:
        """Send all of it; what the line does not take now goes with the next call of read or write."""
        if self.state is PortState.OPEN:
            self._unsent += data
            self.sent += len(data)
            self._flush()

    def close(self) -> None:
        """Let go of the port."""
        self._drop(PortState.CLOSED)

    # -- inside ------------------------------------------------------------------------------------------------

    def _advance(self) -> None:
        """Settle an attempt under way (TCP), and send what waits."""
        self._flush()

    def _opened(self) -> None:
        self.state = PortState.OPEN
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

    def _fill(self, at_most: int | None = None) -> None:
        left = _PIECE * 16 if at_most is None else at_most
        while self.state is PortState.OPEN and left > 0:
            try:
                piece = os.read(self._fd, min(left, _PIECE))
            except (BlockingIOError, InterruptedError):
                return
            except OSError:
                piece = b""
            if not piece:
                self._drop(PortState.ERROR)
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
            except OSError:
                self._drop(PortState.ERROR)

    def _wait(self, end_s: float) -> bool:
        left_s = end_s - time.monotonic()
        if left_s > 0:
            waiting = select.poll()
            waiting.register(self._fd, select.POLLIN if self.state is PortState.OPEN else select.POLLOUT)
            waiting.poll(left_s * 1000)
        return left_s > 0


class _TcpPort(LidarPort):
    def __init__(self, address: str, host: str, port: int) -> None:
        super().__init__(address)
        self._peer = (host, port)
        self._socket: socket.socket | None = None

    def connect(self) -> None:
        if self._socket is None and self._fd < 0:
            self._start()
        self._advance()

    def _start(self) -> None:
        attempt = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        attempt.setblocking(False)
        attempt.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        attempt.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        self.state = PortState.CLOSED
        try:
            attempt.connect(self._peer)
        except (BlockingIOError, InterruptedError):
            pass
        except OSError:
            attempt.close()
            self.state = PortState.ERROR
            return
        self._socket, self._fd = attempt, attempt.fileno()

    def _advance(self) -> None:
        if self._socket is not None:
            waiting = select.poll()
            waiting.register(self._fd, select.POLLOUT)
            if not waiting.poll(0):
                return
            if self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR):
                self._drop(PortState.ERROR)
                return
            self._fd, self._socket = self._socket.detach(), None
            self._opened()
        super()._advance()

    def _drop(self, state: PortState) -> None:
        if self._socket is not None:
            self._socket.close()
            self._socket, self._fd = None, -1
        super()._drop(state)


class _TtyPort(LidarPort):
    def __init__(self, address: str, path: str) -> None:
        super().__init__(address)
        self._path = path

    def connect(self) -> None:
        if self._fd >= 0:
            return
        try:
            self._fd = os.open(self._path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
            fcntl.ioctl(self._fd, termios.TIOCEXCL)
            tty.setraw(self._fd)
        except (OSError, termios.error):
            self._drop(PortState.ERROR)
            return
        self._opened()


def open_port(address: str) -> LidarPort:
    """The port of an address, not connected yet. Raises ConfigError where it is neither tcp:HOST:PORT nor tty:PATH."""
    kind, _, rest = address.partition(":")
    if kind == "tcp":
        host, _, port = rest.rpartition(":")
        if host and port.isdigit() and 0 < int(port) < 65536:
            return _TcpPort(address, host, int(port))
    if kind == "tty" and rest.startswith("/"):
        return _TtyPort(address, rest)
    raise ConfigError(f"lidar.address = {address!r} should be tcp:HOST:PORT (tcp:192.168.0.10:10940) "
                      "or tty:PATH (tty:/dev/ttyACM0)")
