"""CAN over TCP: python-can's socketcand client and its socket, for which it has no public access.

Limits of python-can 4.6.1 and their remedies here. It treats an end of file as "no message" for ever: the socket is
peeked when no message came. Its `send` blocks whatever its timeout: the frames are written here, to a non-blocking
socket, and a partly sent text is finished before anything new. Its connect spins for 10 s if nobody listens: a test
connection comes first.
"""

from __future__ import annotations

import logging
import select
import socket
from collections.abc import Sequence
from typing import Any

import can
from can.interfaces.socketcand.socketcand import SocketCanDaemonBus, convert_can_message_to_ascii_message

from onboard.drivers.can.base import CanBus, message_of
from onboard.drivers.can.errors import FULL, words_of
from onboard.records import Frame, PortState

_CONNECT_LIMIT_S = 2.0
_ENDED = "the socketcand server has closed the connection"


class DaemonBus(CanBus):
    """A bus behind a socketcand server."""

    def __init__(self, bus: Any) -> None:
        super().__init__(bus)
        self._socket: socket.socket = bus._SocketCanDaemonBus__socket
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket.sendall(b"< echo >")  # from here on the hub may send frames
        self._socket.setblocking(False)
        self._begun = b""  # rest of a tick's frames of which the socket has taken the first bytes

    def fileno(self) -> int:
        """Descriptor for poll(); -1 when closed."""
        return self._socket.fileno()

    def write(self, frames: Sequence[Frame]) -> int:
        """Send as CanBus.write; a tick's frames are sent in one piece, or not at all while an earlier tick's wait."""
        if self.state is PortState.CLOSED or not self._flushed() or not frames:
            return len(frames)
        text = "".join([convert_can_message_to_ascii_message(message_of(frame)) for frame in frames]).encode("ascii")
        taken = self._taken(text)
        if not taken:
            return len(frames)
        self._begun = text[taken:]
        self.sent += len(frames)
        return 0

    def _flushed(self) -> bool:
        """Send more of a partly sent text; return whether all of it has left."""
        if self._begun:
            self._begun = self._begun[self._taken(self._begun) :]
        return not self._begun

    def _taken(self, data: bytes) -> int:
        """Send; return the number of bytes that the socket took."""
        try:
            taken = self._socket.send(data)
        except BlockingIOError:
            taken = 0
        except OSError:
            self._end()
            return 0
        self._words["queue"] = words_of(FULL[0], "") if taken < len(data) else ""
        return taken

    def _receive(self) -> can.Message | None:
        message = super()._receive()
        if message is None and self.state is not PortState.CLOSED and self._ended():
            self._end()
        return message

    def _end(self) -> None:
        self.state, self._words["port"] = PortState.CLOSED, _ENDED

    def _ended(self) -> bool:
        """Return whether the other side closed the stream and all of it is read."""
        try:
            return self._socket.recv(1, socket.MSG_PEEK | socket.MSG_DONTWAIT) == b""
        except BlockingIOError:
            return False
        except OSError:
            return True

    def _wait(self, limit_s: float) -> None:
        select.select([self._socket], [], [], limit_s)


def open_socketcand(host: str, port: int, bus: str) -> CanBus:
    """Open a bus of a socketcand server, or of the bench's hub. Raises OSError with what to do."""
    logging.getLogger("can.interfaces.socketcand.socketcand").setLevel(logging.CRITICAL)
    where = f"socketcand:{host}:{port}/{bus}"
    try:
        socket.create_connection((host, port), _CONNECT_LIMIT_S).close()
        client: Any = SocketCanDaemonBus
        return DaemonBus(client(bus, host, port))
    except (can.CanError, OSError) as error:
        raise OSError(f"{where} cannot be opened ({error}); is the bench or a socketcand server running?") from error
