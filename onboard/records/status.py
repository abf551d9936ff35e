"""Status records that the shell passes to the core: ports, CAN bus, record, ticks, computer; and requests to save."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple


class PortState(IntEnum):
    """State of a port."""

    CLOSED = 0
    OPEN = 1
    ERROR = 2


class BusTrouble(IntEnum):
    """Kinds of error frames of a CAN controller or its driver."""

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
    """Status of the CAN bus; counts since the start of the run.

    state: ERROR if it is open and nothing passes (bus-off, interface down), CLOSED if only reopening helps.
    error: one line for people about a present error; empty if all is well.
    send_failures: frames that it did not take.
    openings: attempts to open it.
    error_frames: by BusTrouble.
    """

    state: PortState = PortState.OPEN
    error: str = ""
    send_failures: int = 0
    openings: int = 1
    error_frames: tuple[int, ...] = (0,) * len(BusTrouble)


BUS_CLOSED = "the bus is closed"
BUS_WORDS = {  # meaning of a controller's error frame, for people
    BusTrouble.BUS_OFF: "bus-off: the controller has left the bus after too many errors",
    BusTrouble.PASSIVE: "error-passive: over 127 errors; cable, termination, bit rate?",
    BusTrouble.WARNING: "error warning: over 95 errors",
    BusTrouble.BUS_ERROR: "errors on the wire; where no frame passes at all, the bit rate is another",
    BusTrouble.NO_ACK: "nobody acknowledges: no other node on the bus, or none with this bit rate",
    BusTrouble.OVERFLOW: "a buffer of the controller has overflowed",
    BusTrouble.OTHER: "an error frame of no known kind",
}


UNKEPT = "unkept"  # verdict of a command that runs before its mark is saved (onboard.drivers.link.saved_state)
EPOCH = "epoch"  # a Save of this name orders the link's port to put a key epoch in force and to save it
HALTS = "halts"  # saved name of the request ids that halted before a restart, JSON by station


class Save(NamedTuple):
    """Data that the core wants saved under a name, in place of the old data: whole, or not at all."""

    name: str
    data: bytes


class SaveResult(NamedTuple):
    """Result of a Save; error: empty if it is on the disk."""

    name: str
    error: str = ""


class Health(NamedTuple):
    """State of the shell in each tick.

    last_tick_ns: all work of the last tick.
    slipped_ticks: since the start.
    utc_ns: 0: not known.
    """

    last_tick_ns: int = 0
    slipped_ticks: int = 0
    utc_ns: int = 0


class Machine(NamedTuple):
    """Load figures of the computer, about once a second. NaN: not known.

    cpu_ratio: busy share of all its cores' time.
    process_ratio: cores that this program used.
    rss_bytes: resident memory of this program.
    free_memory_bytes: memory available to programs.
    temperature_c: of its hottest sensor.
    free_disk_bytes: least of the folders written to.
    """

    cpu_ratio: float
    process_ratio: float
    rss_bytes: float
    free_memory_bytes: float
    temperature_c: float
    free_disk_bytes: float


class Timing(NamedTuple):
    """Measured times of the shell's ticks. All empty or 0 in lock-step, unless a bench gives values.

    late_ns: time from its deadline to the start of this tick.
    group_ns: time of each row of core.schedule.GROUPS in the tick before.
    job_ns: run time of each job whose result is in these inputs, in their order.
    """

    late_ns: int = 0
    group_ns: tuple[int, ...] = ()
    job_ns: tuple[int, ...] = ()


class RecordedParts(IntEnum):
    """Parts of a tick that the record stores."""

    ALL = 0
    LEAN = 1  # enough for a replay and for people: inputs, the state's digest, events
    NOTHING = 2


class RecordTrouble(IntEnum):
    """Reason why the record cannot be written."""

    NONE = 0
    FULL = 1  # no room on the disk, or less than has to stay free
    FAILED = 2  # refused for any other reason: read-only, gone, broken


class RecordStatus(NamedTuple):
    """Status of the record.

    keeps: what is stored of this tick.
    trouble: present error.
    error: one line for people while it cannot be written.
    lost_ticks: ticks of which nothing was stored, since the start of the run.
    """

    keeps: RecordedParts = RecordedParts.ALL
    trouble: RecordTrouble = RecordTrouble.NONE
    error: str = ""
    lost_ticks: int = 0
