"""What the shell tells of a port, and of the CAN bus more than of the others."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple


class PortState(IntEnum):
    """A port as the shell sees it."""

    CLOSED = 0
    OPEN = 1
    ERROR = 2


class BusTrouble(IntEnum):
    """Kinds of error frame that a CAN controller or its driver tells of."""

    BUS_OFF = 0
    PASSIVE = 1
    WARNING = 2
    ACTIVE = 3  # good again
    RESTARTED = 4
    BUS_ERROR = 5  # bit, form, stuff or CRC errors on the wire
    NO_ACK = 6
    OVERFLOW = 7
    OTHER = 8


class BusStatus(NamedTuple):
    """The CAN bus as the shell sees it; counts since the start of the run.

    state: ERROR when it is open and nothing passes (bus-off, interface down), CLOSED when only opening it anew helps.
    error: one line for people, what is wrong now; empty while all is well. send_failures: frames that it did not take.
    openings: attempts to open it. error_frames: by BusTrouble.
    """

    state: PortState = PortState.OPEN
    error: str = ""
    send_failures: int = 0
    openings: int = 1
    error_frames: tuple[int, ...] = (0,) * len(BusTrouble)


BUS_CLOSED = "the bus is closed"
BUS_WORDS = {  # what a controller's error frame means for people
    BusTrouble.BUS_OFF: "bus-off: the controller has left the bus after too many errors",
    BusTrouble.PASSIVE: "error-passive: over 127 errors; cable, termination, bit rate?",
    BusTrouble.WARNING: "error warning: over 95 errors",
    BusTrouble.BUS_ERROR: "errors on the wire; where no frame passes at all, the bit rate is another",
    BusTrouble.NO_ACK: "nobody acknowledges: no other node on the bus, or none with this bit rate",
    BusTrouble.OVERFLOW: "a buffer of the controller has overflowed",
    BusTrouble.OTHER: "an error frame of no known kind",
}


class Save(NamedTuple):
    """What the core asks to be kept under a name, in place of what was kept under it: whole, or not at all."""

    name: str
    data: bytes


class Saved(NamedTuple):
    """What became of a Save; `error` empty: it is on the disk."""

    name: str
    error: str = ""
