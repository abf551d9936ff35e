"""TABLE of modes, phases, events and transitions. This is the only place where they are listed.

BOOT --booted--> STANDBY --goto, mission, return, scan--> AUTONOMOUS --arrived, scanned, failed, stop--> STANDBY
                    |  \\--------- turn, drive ------> TELEOP --------- moved, failed, stop ---------> STANDBY
                    +---- safe, fault (from everywhere) -----> SAFE --resume--> STANDBY
                    +---- emergency_stop (from everywhere) --> ESTOP (latched) --reset--> STANDBY
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple


class Mode(IntEnum):
    """Mode of the rover; numbers are on the wire and never reused."""

    BOOT = 0
    STANDBY = 1
    AUTONOMOUS = 2
    SAFE = 3
    ESTOP = 4
    TELEOP = 5
    SEQUENCE = 6


class Phase(IntEnum):
    """Phase within AUTONOMOUS; ARRIVED and FAILED stay until the next goto."""

    NONE = 0
    SCANNING = 1
    MAPPING = 2
    PLANNING = 3
    DRIVING = 4
    TURNING = 5
    ARRIVED = 6
    FAILED = 7
    BACKING_OFF = 8


class ModeRow(NamedTuple):
    """One mode.

    mode: number and name.
    wheels: state of the wheels in this mode: off, hold or run.
    meaning: text for the docs.
    """

    mode: Mode
    wheels: str
    meaning: str


TABLE = (
    ModeRow(Mode.BOOT, "off", "the computer comes up; devices are asked for their state"),
    ModeRow(Mode.STANDBY, "hold", "ready for a command"),
    ModeRow(Mode.AUTONOMOUS, "run", "on the way to a goal by itself: scan, map, plan, drive"),
    ModeRow(Mode.SAFE, "hold", "a fault or the operator ended all motion; resume returns to STANDBY"),
    ModeRow(Mode.ESTOP, "off", "latched; only reset leaves it"),
    ModeRow(Mode.TELEOP, "run", "a move of the operator's, with its bounds; no map is asked"),
    ModeRow(Mode.SEQUENCE, "run", "steps that were uploaded, one after the other; what they move is part of it"),
)


class Transition(NamedTuple):
    """One transition: in `state`, `event` leads to `next`."""

    state: Mode
    event: str
    next: Mode
    meaning: str


_B, _S, _A, _F, _E, _T = Mode.BOOT, Mode.STANDBY, Mode.AUTONOMOUS, Mode.SAFE, Mode.ESTOP, Mode.TELEOP
_Q = Mode.SEQUENCE
_NEW = "what it was about is replaced; the rover stops first"
_ENDED = "a response of the fault table ended in SAFE"
TRANSITIONS = (
    Transition(_B, "booted", _S, "all devices were asked; the rover stands"),
    Transition(_S, "goto", _A, "the mission begins with a scan"),
    Transition(_A, "goto", _A, "the goal is replaced; the rover stops and scans"),
    Transition(_S, "mission", _A, "to the first of several goals"),
    Transition(_A, "mission", _A, _NEW),
    Transition(_S, "return", _A, "back to the start of the run"),
    Transition(_A, "return", _A, _NEW),
    Transition(_A, "returned", _S, "the rover is back at the start of the run"),
    Transition(_S, "scan", _A, "one scan, for the map"),
    Transition(_A, "scanned", _S, "the scan is in the map"),
    Transition(_S, "turn", _T, "a turn on the spot"),
    Transition(_T, "turn", _T, _NEW),
    Transition(_S, "drive", _T, "a bounded move"),
    Transition(_T, "drive", _T, _NEW),
    Transition(_T, "moved", _S, "the turn is done, or a bound of the move is reached"),
    Transition(_T, "failed", _S, "a fault ended the move"),
    Transition(_T, "stop", _S, "the rover stops; the move is given up"),
    Transition(_A, "stop", _S, "the rover stops; the goal is given up"),
    Transition(_S, "stop", _S, "nothing moves already"),
    Transition(_A, "arrived", _S, "the goal is reached"),
    Transition(_A, "failed", _S, "no way to the goal, or a limit of the mission"),
    Transition(_A, "link_lost", _S, "no authenticated contact for too long; the leg was finished"),
    Transition(_B, "safe", _F, "by command"),
    Transition(_S, "safe", _F, "by command"),
    Transition(_A, "safe", _F, "by command"),
    Transition(_S, "sequence_run", _Q, "the first step begins"),
    Transition(_Q, "sequence_abort", _S, "the rover stops; the sequence is given up"),
    Transition(_Q, "ended", _S, "the last step is done, or one failed and says stop"),
    Transition(_Q, "stop", _S, "the rover stops; the sequence is given up"),
    Transition(_Q, "link_lost", _S, "no authenticated contact for too long; the leg was finished"),
    Transition(_T, "safe", _F, "by command"),
    Transition(_Q, "safe", _F, "by command"),
    *(Transition(mode, "fault", _F, _ENDED) for mode in (_B, _S, _A, _T, _Q)),
    Transition(_F, "resume", _S, "the operator takes the rover out of SAFE"),
    *(Transition(mode, "emergency_stop", _E, "wheels off, latched") for mode in (_B, _S, _A, _F, _T, _Q)),
    Transition(_E, "reset", _S, "the operator releases the latch"),
)


def next_mode(mode: Mode, event: str) -> Mode | None:
    """Return the mode after `event` in `mode`; None if the event does nothing in this mode (the mode stays)."""
    for row in TRANSITIONS:
        if row.state == mode and row.event == event:
            return row.next
    return None


class EventRow(NamedTuple):
    """One kind of event; severity is debug, info, warning, error or critical."""

    name: str
    severity: str
    meaning: str


EVENTS = (
    EventRow("MODE", "info", "the mode changed"),
    EventRow("PHASE", "info", "the phase changed"),
    EventRow("REGISTERED", "info", "the pose was corrected by the map"),
    EventRow("REGISTRATION_REFUSED", "warning", "a registration was outside the gate"),
    EventRow("DECISION", "info", "the mission rule chose, with its reason"),
    EventRow("SIGHT", "warning", "the scanner sees less, or more again: the level of the answer, and what was lost"),
    EventRow("HAZARD", "warning", "what the drive guard has seen, and where"),
    EventRow("ARRIVED", "info", "the goal is reached"),
    EventRow("RETURNED", "info", "the rover is back at the start of the run"),
    EventRow("SCANNED", "info", "the scan that was asked for is in the map"),
    EventRow("FAILED", "error", "the mission ended without reaching the goal"),
    EventRow("FAULT", "warning", "a row of the fault table became active"),
    EventRow("FAULT_CLEARED", "info", "a row of the fault table is no longer active"),
    EventRow("FAULT_MASKED", "warning", "a row of the fault table is masked, or its mask has ended"),
    EventRow("MAP_CLEARED", "info", "the rover's own map is forgotten"),
    EventRow("FENCE", "info", "a fence was added or cleared, or those kept cannot be read"),
    EventRow("PARAMETER", "info", "a parameter was changed, or one that was kept is not taken"),
    EventRow("STATE", "warning", "what outlives the program cannot be kept, is kept again, or was found at the start"),
    EventRow("REBOOT", "warning", "the flight program ends and starts again"),
    EventRow("CAN", "warning", "what the CAN port or its controller says of itself has changed"),
    EventRow("LEASE", "info", "the control lease: who holds it now, or asks for it"),
    EventRow("KEYS", "info", "another key epoch is in force"),
    EventRow("CONTACTS", "info", "the contact windows were set or cleared"),
    EventRow("LINK_REFUSED", "warning", "datagrams failed their checks; how many of which kind"),
)
SEVERITIES = ("debug", "info", "warning", "error", "critical")
