"""The kernel's CAN interfaces and the bus inside one process, by python-can; only this file knows it."""

from __future__ import annotations

import select
import socket
import time
from collections.abc import Sequence

import can
from can.interfaces.socketcan import SocketcanBus
from can.interfaces.virtual import VirtualBus

from onboard.drivers.can_bus import CanBus, Heard, Kind
from onboard.records import Frame, PortState


class PythonCanBus(CanBus):
    """Any bus of python-can."""

    def __init__(self, bus: can.BusABC) -> None:
        super().__init__()
        self._bus = bus

    def write(self, frames: Sequence[Frame]) -> int:
        """See CanBus."""
        failures = 0
        for frame in frames:
            try:
                message = can.Message(arbitration_id=frame.can_id, data=frame.data, is_extended_id=False)
                self._bus.send(message, timeout=0)
            except (can.CanError, OSError):
                failures += 1
        self.sent += len(frames) - failures
        return failures

    def close(self) -> None:
        """See CanBus."""
        self.state = PortState.CLOSED
        self._bus.shutdown()

    def _receive(self) -> Heard | None:
        if self.state is PortState.CLOSED:
            return None
        try:
            message = self._bus.recv(0)
        except (can.CanError, OSError):
            self.state = PortState.ERROR
            return None
        if message is None:
            return None
        foreign = message.is_remote_frame or message.is_extended_id
        kind = Kind.ERROR if message.is_error_frame else Kind.FOREIGN if foreign else Kind.DATA
        return Heard(message.arbitration_id, bytes(message.data), kind, message.timestamp)

    def _wait(self, limit_s: float) -> None:
        time.sleep(min(limit_s, 0.0005))


class KernelBus(PythonCanBus):
    """An interface of the kernel. Its stamps are wall time: a frame's age counts back from the moment it is read."""

    def _wait(self, limit_s: float) -> None:
        select.select([self._bus.fileno()], [], [], limit_s)

    def _stamp_ns(self, heard: Heard, stamp_ns: int) -> int:
        return stamp_ns - max(0, int((time.time() - heard.stamp_s) * 1e9))


def open_virtual(name: str) -> CanBus:
    """A bus that all who name it in this process share."""
    return PythonCanBus(VirtualBus(name))


def open_socketcan(interface: str) -> CanBus:
    """An interface of the kernel. Raises OSError with what to do about it."""
    if not hasattr(socket, "AF_CAN"):
        raise OSError(f"socketcan:{interface}: this Python knows no AF_CAN; use socketcand:HOST:PORT/BUS")
    try:
        return KernelBus(SocketcanBus(interface))
    except (can.CanError, OSError) as error:
        raise OSError(
            f"socketcan:{interface} cannot be opened ({error}). For a virtual interface: `modprobe vcan; ip link add "
            f"dev {interface} type vcan; ip link set {interface} up`. A kernel without AF_CAN: run a socketcand server "
            "(the bench has one) and use socketcand:HOST:PORT/BUS"
        ) from error
