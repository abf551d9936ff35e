"""The scanner's port over TCP."""

from __future__ import annotations

import errno
import os
import select
import socket

from onboard.drivers.lidar.byte_port import LidarPort
from onboard.records import PortState

_DEAF_MS = 3000  # bytes without acknowledgement for this time: the cable is out


class TcpPort(LidarPort):
    """Port of a scanner with Ethernet. A pulled cable is detected by sent bytes or, in silence, by keepalive."""

    def __init__(self, address: str, host: str, port: int) -> None:
        super().__init__(address)
        self._peer = (host, port)
        self._socket: socket.socket | None = None

    def connect(self) -> None:
        """Make one attempt without waiting (a host name's look-up may wait: give a numeric address)."""
        if self._socket is None and self._fd < 0:
            self._start()
        self._advance()

    def _start(self) -> None:
        attempt = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        attempt.setblocking(False)
        attempt.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        attempt.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        for option, seconds in ((socket.TCP_KEEPIDLE, 2), (socket.TCP_KEEPINTVL, 1), (socket.TCP_KEEPCNT, 3)):
            attempt.setsockopt(socket.IPPROTO_TCP, option, seconds)
        attempt.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, _DEAF_MS)
        self.state = PortState.CLOSED
        try:
            attempt.connect(self._peer)
        except (BlockingIOError, InterruptedError):
            pass
        except OSError as error:
            attempt.close()
            self._fail(self._why(error.errno or 0, error.strerror or str(error)))
            return
        self._socket, self._fd = attempt, attempt.fileno()

    def _advance(self) -> None:
        if self._socket is not None:
            waiting = select.poll()
            waiting.register(self._fd, select.POLLOUT)
            if not waiting.poll(0):
                return
            if number := self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR):
                self._fail(self._why(number, os.strerror(number)))
                return
            self._fd, self._socket = self._socket.detach(), None
            self._opened()
        super()._advance()

    def _drop(self, state: PortState) -> None:
        if self._socket is not None:
            self._socket.close()
            self._socket, self._fd = None, -1
        super()._drop(state)

    def _why(self, number: int, text: str) -> str:
        host, port = self._peer
        if number == errno.ECONNREFUSED:
            return f"{host} refuses port {port}: another client holds the sensor, or the address is wrong"
        return f"{host}:{port} does not answer ({text}): are power, cable and address right? Try: ping {host}"
