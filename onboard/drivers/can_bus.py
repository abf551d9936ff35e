"""The CAN bus behind one interface, chosen by a URI; the only place on board that knows python-can.

    socketcan:can0                         the rover; the kernel's stamps
    socketcand:127.0.0.1:29536/rover       a socketcand server or the bench's hub, where the kernel has no AF_CAN
    virtual:name                           inside one process

What python-can 4.6.1 does, and what is done about it here: its socketcand client sees an end of file as "no message"
for ever and would spin on it (the socket is peeked when nothing came); its `send` blocks whatever its timeout says (the
socket is asked first, and a tick's frames leave in one piece); its connect spins for 10 s when nobody listens (asked
first).
"""

from __future__ import annotations

import logging
import re
import select
import socket
import time
from collections.abc import Sequence
from typing import Any

import can
from can.interfaces.socketcan import SocketcanBus
from can.interfaces.socketcand.socketcand import SocketCanDaemonBus, convert_can_message_to_ascii_message
from can.interfaces.virtual import VirtualBus

from onboard.config import ConfigError
from onboard.records import Frame, PortState

FORMS = "socketcan:INTERFACE, socketcand:HOST:PORT/BUS or virtual:NAME"
_BUS_OFF, _RESTARTED = 0x40, 0x100  # linux/can/error.h
_CONNECT_LIMIT_S = 2.0


def open_bus(uri: str) -> CanBus:
    """The bus that a URI names.

    Raises ConfigError for a URI of another form, OSError with what to do when the bus cannot be opened.
    """
    kind, _, rest = uri.partition(":")
    if kind == "socketcan" and re.fullmatch(r"[\w.-]{1,15}", rest):
        return _open_socketcan(rest)
    if kind == "virtual" and rest:
        return CanBus(VirtualBus(rest))
    match = re.fullmatch(r"([^:/]+):(\d{1,5})/([\w.-]+)", rest)
    if kind == "socketcand" and match:
        return _open_socketcand(match[1], int(match[2]), match[3])
    raise ConfigError(f"can.uri = {uri!r} names no bus; write {FORMS}")


class CanBus:
    """One open bus. `received` and `sent` count frames since it was opened; `state` is what the last call saw.

    Error frames of the controller count in `received`, are not returned, and set `state`: ERROR at bus-off, OPEN again
    at a restart or with the next data frame. An interface that is down is ERROR likewise.
    """

    def __init__(self, bus: can.BusABC) -> None:
        self._bus = bus
        self.received = self.sent = self.error_frames = 0
        self.state = PortState.OPEN

    def fileno(self) -> int:
        """For poll(); -1 for a virtual bus."""
        return -1

    def read(self, stamp_ns: int) -> list[Frame]:
        """The frames that are there now, stamped `stamp_ns`; never waits."""
        frames: list[Frame] = []
        while (message := self._receive()) is not None:
            if self._counted(message):
                frames.append(Frame(message.arbitration_id, bytes(message.data), self._stamp_ns(message, stamp_ns)))
        return frames

    def read_upto(self, total: int, stamps_us: Sequence[int], limit_s: float) -> list[Frame]:
        """Lock-step: waits until `total` frames were received since the opening; `stamps_us`: one for each new frame.

        Returns fewer when the bus closes (see `state`). Raises TimeoutError with both counts after `limit_s`,
        ValueError when the stamps are not as many as the new frames.
        """
        if len(stamps_us) != max(0, total - self.received):
            raise ValueError(f"{len(stamps_us)} stamps for frames {self.received} to {total}")
        frames: list[Frame] = []
        deadline = time.monotonic() + limit_s
        for stamp_us in stamps_us:
            while (message := self._receive()) is None:
                left = deadline - time.monotonic()
                if self.state is PortState.CLOSED:
                    return frames
                if left <= 0:
                    raise TimeoutError(f"CAN: {self.received} of {total} frames came within {limit_s:g} s")
                self._wait(left)
            if self._counted(message):
                frames.append(Frame(message.arbitration_id, bytes(message.data), stamp_us * 1000))
        return frames

    def write(self, frames: Sequence[Frame]) -> int:
        """Sends what the bus takes at once, in order; the number of frames that it did not take."""
        failures = 0
        for frame in frames:
            try:
                self._bus.send(_message(frame), timeout=0)
            except (can.CanError, OSError):
                failures += 1
        self.sent += len(frames) - failures
        return failures

    def close(self) -> None:
        """Closes the bus; harmless when it is closed."""
        self.state = PortState.CLOSED
        self._bus.shutdown()

    def _receive(self) -> can.Message | None:
        """The next message that is there, else None; what the bus raises becomes the state."""
        if self.state is PortState.CLOSED:
            return None
        try:
            return self._bus.recv(0)
        except (can.CanError, OSError):
            self.state = PortState.ERROR
            return None

    def _wait(self, limit_s: float) -> None:
        """Waits until something may have come."""
        time.sleep(min(limit_s, 0.0005))

    def _stamp_ns(self, _message: can.Message, stamp_ns: int) -> int:
        return stamp_ns

    def _counted(self, message: can.Message) -> bool:
        """Books a message; whether it is a data frame of the rover's kind."""
        self.received += 1
        if message.is_error_frame:
            self.error_frames += 1
            if message.arbitration_id & _BUS_OFF:
                self.state = PortState.ERROR
            elif message.arbitration_id & _RESTARTED:
                self.state = PortState.OPEN
        elif self.state is PortState.ERROR:
            self.state = PortState.OPEN
        return not (message.is_error_frame or message.is_remote_frame or message.is_extended_id)


class _SocketcanBus(CanBus):
    """The kernel's bus. Its stamps are wall time: a frame's age counts back from the moment it is read."""

    def fileno(self) -> int:
        return int(self._bus.fileno())

    def _wait(self, limit_s: float) -> None:
        select.select([self.fileno()], [], [], limit_s)

    def _stamp_ns(self, message: can.Message, stamp_ns: int) -> int:
        return stamp_ns - max(0, int((time.time() - message.timestamp) * 1e9))


class _SocketcandBus(CanBus):
    """python-can's socketcand client and its socket, which it gives no door to."""

    def __init__(self, bus: Any) -> None:
        super().__init__(bus)
        self._socket: socket.socket = bus._SocketCanDaemonBus__socket
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket.sendall(b"< echo >")  # from here on the hub may send frames

    def fileno(self) -> int:
        return self._socket.fileno()

    def write(self, frames: Sequence[Frame]) -> int:
        """As CanBus.write; a tick's frames go out in one piece or, when the socket's buffer is full, not at all."""
        if not frames or self.state is PortState.CLOSED:
            return len(frames)
        text = "".join([convert_can_message_to_ascii_message(_message(frame)) for frame in frames]).encode("ascii")
        try:
            if not select.select([], [self._socket], [], 0)[1]:
                return len(frames)
            self._socket.sendall(text)
        except OSError:
            self.state = PortState.CLOSED
            return len(frames)
        self.sent += len(frames)
        return 0

    def _receive(self) -> can.Message | None:
        message = super()._receive()
        if message is None and self.state is not PortState.CLOSED and self._ended():
            self.state = PortState.CLOSED
        return message

    def _ended(self) -> bool:
        """Whether the other side closed the stream and all of it is read."""
        try:
            return self._socket.recv(1, socket.MSG_PEEK | socket.MSG_DONTWAIT) == b""
        except BlockingIOError:
            return False
        except OSError:
            return True

    def _wait(self, limit_s: float) -> None:
        select.select([self._socket], [], [], limit_s)


def _message(frame: Frame) -> can.Message:
    return can.Message(arbitration_id=frame.can_id, data=frame.data, is_extended_id=False)


def _open_socketcan(interface: str) -> CanBus:
    if not hasattr(socket, "AF_CAN"):
        raise OSError(f"socketcan:{interface}: this Python knows no AF_CAN; use socketcand:HOST:PORT/BUS")
    try:
        return _SocketcanBus(SocketcanBus(interface))
    except (can.CanError, OSError) as error:
        raise OSError(
            f"socketcan:{interface} cannot be opened ({error}). For a virtual interface: `modprobe vcan; ip link add "
            f"dev {interface} type vcan; ip link set {interface} up`. A kernel without AF_CAN: run a socketcand server "
            "(the bench has one) and use socketcand:HOST:PORT/BUS"
        ) from error


def _open_socketcand(host: str, port: int, bus: str) -> CanBus:
    logging.getLogger("can.interfaces.socketcand.socketcand").setLevel(logging.CRITICAL)
    where = f"socketcand:{host}:{port}/{bus}"
    try:
        socket.create_connection((host, port), _CONNECT_LIMIT_S).close()
        client: Any = SocketCanDaemonBus
        return _SocketcandBus(client(bus, host, port))
    except (can.CanError, OSError) as error:
        raise OSError(f"{where} cannot be opened ({error}); is the bench or a socketcand server running?") from error
