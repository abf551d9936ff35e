"""Bench's end of a CAN interface of the kernel, in place of its hub: `hil run --can socketcan:vcan0`.

The kernel delivers each frame to every socket of the interface but the sender's own, in order and at once; so counts
alone decide here too when a tick may run, and candump, cantools or Wireshark may listen. Any other sender on the
interface breaks the counts and so the run.
"""

from __future__ import annotations

import re
import select
import socket
import struct
import time
from collections.abc import Sequence

from onboard.records import Frame

_FRAME = struct.Struct("=IB3x8s")  # struct can_frame of linux/can.h
_ID, _ERROR = 0x1FFF_FFFF, 0x2000_0000


class NoInterfaceError(OSError):
    """The interface is missing or down, or this kernel has no CAN; the text names the remedy."""


class CanSocket:
    """One raw socket.

    sent, received: number of frames since it was opened
    uri: value for onboard's configuration
    """

    def __init__(self, uri: str) -> None:
        found = re.fullmatch(r"socketcan:([\w.-]{1,15})", uri)
        if not found:
            raise NoInterfaceError(f"{uri!r} names no interface of the kernel; write socketcan:INTERFACE")
        self.uri = uri
        self.sent = self.received = 0
        try:
            self._socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
            self._socket.bind((found[1],))
            self._socket.setblocking(False)
        except OSError as error:
            raise NoInterfaceError(
                f"{uri} cannot be opened ({error}); as root: `modprobe vcan; ip link add {found[1]} type vcan; "
                f"ip link set {found[1]} up`. On a kernel without CAN leave the option away: the bench has a hub"
            ) from error

    def poll(self) -> None:
        """Nothing to serve: the kernel does."""

    def write(self, frames: Sequence[Frame]) -> None:
        """Send the emulated nodes' frames in this order. Raises ConnectionError if the interface does not take them."""
        try:
            for frame in frames:
                self._socket.send(_FRAME.pack(frame.can_id, len(frame.data), frame.data))
                self.sent += 1
        except OSError as error:
            raise ConnectionError(f"{self.uri} takes no frame after {self.sent}: {error}") from error

    def wait(self, limit_s: float) -> None:
        """Block until a frame is there, at most `limit_s`."""
        select.select([self._socket], [], [], limit_s)

    def read(self, stamp_ns: int = 0) -> list[Frame]:
        """Frames of other senders that are there now, stamped `stamp_ns`. Raises ConnectionError as `write`."""
        frames: list[Frame] = []
        try:
            while True:
                frames.append(_unpack(self._socket.recv(_FRAME.size), stamp_ns))
                self.received += 1
        except BlockingIOError:
            return frames
        except OSError as error:
            raise ConnectionError(f"{self.uri} is gone after {self.received} frames: {error}") from error

    def write_error(self, classes: int, detail: int = 0, _stamp_ns: int = 0) -> None:
        """Send an error frame of SocketCAN's classes, as a controller's driver makes them; it counts as a frame.

        detail: byte 1 of its data.
        """
        self.write([Frame(_ERROR | classes, bytes([0, detail, 0, 0, 0, 0, 0, 0]))])

    def read_upto(self, _number: int, total: int, limit_s: float, stamp_ns: int = 0) -> list[Frame]:
        """Block until `total` frames of other senders came since the opening; returns the new ones, stamped `stamp_ns`.

        For lock-step. There is one client. Raises TimeoutError with both counts after `limit_s`, ConnectionError if the
        interface goes down or away.
        """
        frames: list[Frame] = []
        deadline = time.monotonic() + limit_s
        while self.received < total:
            try:
                frames.append(_unpack(self._socket.recv(_FRAME.size), stamp_ns))
                self.received += 1
            except BlockingIOError:
                left_s = deadline - time.monotonic()
                if left_s <= 0:
                    raise TimeoutError(
                        f"{self.uri}: {self.received} of {total} frames came within {limit_s:g} s"
                    ) from None
                select.select([self._socket], [], [], left_s)
            except OSError as error:
                raise ConnectionError(f"{self.uri} is gone after {self.received} of {total} frames: {error}") from error
        return frames

    def listen(self, wanted: bool) -> None:
        """Do nothing: any program may open the interface. Raises ConnectionError if a fault would refuse onboard."""
        if not wanted:
            raise ConnectionError(f"{self.uri}: no fault can unplug a CAN interface of the kernel; use the bench's hub")

    def disconnect(self, _number: int) -> None:
        """Raise ConnectionError, as listen(False)."""
        self.listen(False)

    def wait_client(self, _number: int, _limit_s: float) -> int:
        """Raise ConnectionError: the bench cannot detect that onboard has reopened its socket."""
        raise ConnectionError(f"{self.uri}: onboard opens its bus again, and only the bench's hub can wait for it")

    def close(self) -> None:
        """Close the socket; the interface stays."""
        self._socket.close()


def _unpack(data: bytes, stamp_ns: int) -> Frame:
    can_id, length, payload = _FRAME.unpack(data)
    return Frame(can_id & _ID, payload[:length], stamp_ns)
