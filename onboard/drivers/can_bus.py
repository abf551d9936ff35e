"""The CAN bus behind one interface, chosen by a URI; each kind of bus loads its own driver when it is opened.

    socketcan:can0                         the rover; the kernel's stamps
    socketcand:127.0.0.1:29536/rover       a socketcand server or the bench's hub, where the kernel has no AF_CAN
    virtual:name                           inside one process
"""

from __future__ import annotations

import re
import time
from abc import ABC, abstractmethod
from collections.abc import Sequence
from enum import IntEnum
from typing import NamedTuple

from onboard.config import ConfigError
from onboard.records import Frame, PortState

FORMS = "socketcan:INTERFACE, socketcand:HOST:PORT/BUS or virtual:NAME"
_BUS_OFF, _RESTARTED = 0x40, 0x100  # linux/can/error.h


def open_bus(uri: str) -> CanBus:
    """The bus that a URI names.

    Raises ConfigError for a URI of another form, OSError with what to do when the bus cannot be opened.
    """
    kind, _, rest = uri.partition(":")
    if kind == "socketcan" and re.fullmatch(r"[\w.-]{1,15}", rest):
        from onboard.drivers.kernel_bus import open_socketcan  # python-can takes 0.1 s to load

        return open_socketcan(rest)
    if kind == "virtual" and rest:
        from onboard.drivers.kernel_bus import open_virtual

        return open_virtual(rest)
    match = re.fullmatch(r"([^:/]+):(\d{1,5})/([\w.-]+)", rest)
    if kind == "socketcand" and match:
        from onboard.drivers.socketcand import open_socketcand

        return open_socketcand(match[1], int(match[2]), match[3])
    raise ConfigError(f"can.uri = {uri!r} names no bus; write {FORMS}")


class Kind(IntEnum):
    """What a bus may hear: the rover's frames, the controller's error frames, and frames of another form."""

    DATA = 0
    ERROR = 1
    FOREIGN = 2


class Heard(NamedTuple):
    """One message of a bus. The id of an error frame is its flags; stamp_s: wall time, where the bus tells it."""

    can_id: int
    data: bytes
    kind: Kind = Kind.DATA
    stamp_s: float = 0.0


class CanBus(ABC):
    """One open bus. `received` and `sent` count frames since it was opened; `state` is what the last call saw.

    Error frames of the controller count in `received`, are not returned, and set `state`: ERROR at bus-off, OPEN again
    at a restart or with the next data frame. An interface that is down is ERROR likewise.
    """

    def __init__(self) -> None:
        self.received = self.sent = self.error_frames = 0
        self.state = PortState.OPEN

    def read(self, stamp_ns: int) -> list[Frame]:
        """The frames that are there now, stamped `stamp_ns`; never waits."""
        frames: list[Frame] = []
        while (heard := self._receive()) is not None:
            if self._counted(heard):
                frames.append(Frame(heard.can_id, heard.data, self._stamp_ns(heard, stamp_ns)))
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
            while (heard := self._receive()) is None:
                left = deadline - time.monotonic()
                if self.state is PortState.CLOSED:
                    return frames
                if left <= 0:
                    raise TimeoutError(f"CAN: {self.received} of {total} frames came within {limit_s:g} s")
                self._wait(left)
            if self._counted(heard):
                frames.append(Frame(heard.can_id, heard.data, stamp_us * 1000))
        return frames

    @abstractmethod
    def write(self, frames: Sequence[Frame]) -> int:
        """Sends what the bus takes at once, in order; the number of frames that it did not take."""

    @abstractmethod
    def close(self) -> None:
        """Closes the bus; harmless when it is closed."""

    @abstractmethod
    def _receive(self) -> Heard | None:
        """The next message that is there, else None; what goes wrong becomes the state."""

    @abstractmethod
    def _wait(self, limit_s: float) -> None:
        """Waits until something may have come."""

    def _stamp_ns(self, heard: Heard, stamp_ns: int) -> int:
        return stamp_ns

    def _counted(self, heard: Heard) -> bool:
        """Books a message; whether it is a data frame of the rover's kind."""
        self.received += 1
        if heard.kind is Kind.ERROR:
            self.error_frames += 1
            if heard.can_id & _BUS_OFF:
                self.state = PortState.ERROR
            elif heard.can_id & _RESTARTED:
                self.state = PortState.OPEN
        elif self.state is PortState.ERROR:
            self.state = PortState.OPEN
        return heard.kind is Kind.DATA
