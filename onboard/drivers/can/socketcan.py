"""CAN bus of the kernel: socketcan through python-can, non-blocking, filtered by the blocks of the DBC."""

from __future__ import annotations

import errno
import select
import socket
import time

import can
from can.interfaces.socketcan import SocketcanBus
from can.typechecking import CanFilter

from onboard.drivers.can.base import CanBus, NoCanError
from onboard.records import Frame
from protocol.generated.can_codec import TABLE

_BLOCK_MASK = 0x7F0


def dbc_filters() -> list[CanFilter]:
    """Kernel filters: every block of 16 ids with an id of the DBC; its other ids pass too and are counted."""
    blocks = sorted({can_id & _BLOCK_MASK for can_id in TABLE})
    return [{"can_id": block, "can_mask": _BLOCK_MASK, "extended": False} for block in blocks]


class KernelBus(CanBus):
    """The kernel's bus. Its stamps are of the time of day: a frame's age counts back from the moment of the read.

    No frame is older than the read before this one. This bound limits the error of a stamp to one tick if the system's
    clock was set in between; without it every wheel could be years old, and the rover in SAFE.
    """

    def __init__(self, bus: can.BusABC) -> None:
        super().__init__(bus)
        self._before_ns = 0

    def read(self, stamp_ns: int) -> list[Frame]:
        """Read as CanBus.read, and store the time as the bound of the next read."""
        frames = super().read(stamp_ns)
        self._before_ns = stamp_ns
        return frames

    def fileno(self) -> int:
        """Descriptor for poll(); -1 when closed."""
        return int(self._bus.fileno())

    def _wait(self, limit_s: float) -> None:
        select.select([self.fileno()], [], [], limit_s)

    def _stamp_ns(self, message: can.Message, stamp_ns: int) -> int:
        age_ns = int((time.time() - message.timestamp) * 1e9)
        return max(self._before_ns, stamp_ns - max(0, age_ns))


def open_socketcan(interface: str, filtered: bool) -> CanBus:
    """Open an interface of this machine. Raises OSError with what to do; NoCanError on a kernel without AF_CAN."""
    if not hasattr(socket, "AF_CAN"):
        raise NoCanError(f"socketcan:{interface}: this Python knows no AF_CAN; use socketcand:HOST:PORT/BUS")
    try:
        bus = SocketcanBus(interface, can_filters=dbc_filters() if filtered else None)
    except (can.CanError, OSError) as error:
        kind = NoCanError if getattr(error, "errno", None) == errno.EAFNOSUPPORT else OSError
        raise kind(
            f"socketcan:{interface} cannot be opened ({error}). For a virtual interface: `modprobe vcan; ip link add "
            f"dev {interface} type vcan; ip link set {interface} up`. A kernel without AF_CAN: run a socketcand server "
            "(the bench has one) and use socketcand:HOST:PORT/BUS"
        ) from error
    bus.socket.setblocking(False)  # python-can asks select() first; this applies if its answer is wrong
    return KernelBus(bus)
