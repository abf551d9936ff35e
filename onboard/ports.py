"""What the shell tells of its ports, CAN bus and record more than others, of its ticks and of its computer."""

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


UNKEPT = "unkept"  # verdict of a command that was not to wait any longer for its mark (onboard.drivers.link_memory)
EPOCH = "epoch"  # a Save of this name asks the link's port to put a key epoch in force, and to keep it
HALTS = "halts"  # under this name the core is told, as JSON by station, the request ids that halted before a restart


class Save(NamedTuple):
    """What the core asks to be kept under a name, in place of what was kept under it: whole, or not at all."""

    name: str
    data: bytes


class Saved(NamedTuple):
    """What became of a Save; `error` empty: it is on the disk."""

    name: str
    error: str = ""


class Health(NamedTuple):
    """What the shell tells of itself each tick. last_tick_ns: all work of a tick; slipped_ticks: since the start."""

    last_tick_ns: int = 0
    slipped_ticks: int = 0
    utc_ns: int = 0


class Machine(NamedTuple):
    """What the computer tells of itself, about once a second. NaN: it does not say.

    cpu_ratio: share of all its cores' time at work. process_ratio: cores that this program took. rss_bytes: resident
    memory of this program. temperature_c: of its hottest sensor. free_disk_bytes: least of the folders written to.
    """

    cpu_ratio: float
    process_ratio: float
    rss_bytes: float
    free_memory_bytes: float
    temperature_c: float
    free_disk_bytes: float


class Timing(NamedTuple):
    """What the shell measured of its own ticks. All empty or 0 in lock-step, unless a bench gives something.

    late_ns: this tick began so long after its deadline. group_ns: what each row of core.schedule.GROUPS took in the
    tick before. job_ns: how long each job ran whose result is in these inputs, in their order.
    """

    late_ns: int = 0
    group_ns: tuple[int, ...] = ()
    job_ns: tuple[int, ...] = ()


class Keeps(IntEnum):
    """What the record keeps of a tick."""

    ALL = 0
    LEAN = 1  # what a replay needs and people read: inputs, the state's digest, events
    NOTHING = 2


class RecordTrouble(IntEnum):
    """Why the record cannot be written."""

    NONE = 0
    FULL = 1  # no room on the disk, or less than has to stay free
    FAILED = 2  # refused for any other reason: read-only, gone, broken


class RecordStatus(NamedTuple):
    """The record as the shell sees it.

    keeps: of this very tick. error: one line for people while it cannot be written. lost_ticks: of which nothing was
    kept, since the start of the run.
    """

    keeps: Keeps = Keeps.ALL
    trouble: RecordTrouble = RecordTrouble.NONE
    error: str = ""
    lost_ticks: int = 0
