"""TABLE of the MAVLink mode numbers that the gateway accepts. Every other number is denied with this list.

    base mode            custom mode      sub mode      sent by
    CUSTOM_MODE_ENABLED  100 + our mode   0             programs that know this rover
    CUSTOM_MODE_ENABLED  4 (AUTO)         3, 4 or 5     programs that know PX4 (px4_custom_mode.h), MAVSDK among them

ArduPilot numbers its rover modes from 0 to 17 and reserves 30; PX4 numbers its main modes from 1. Our modes are 1 to 6.
One number must not mean HOLD there and an emergency stop here, so ours begin at 100.
"""

from __future__ import annotations

from enum import IntEnum

from ground.gateway.frames import mavlink as m
from protocol.tables.modes import Mode

_FIRST = 100
_AUTO = 4  # PX4_CUSTOM_MAIN_MODE_AUTO


class Auto(IntEnum):
    """Sub modes of PX4's AUTO that have a meaning here (PX4_CUSTOM_SUB_MODE_AUTO_*)."""

    LOITER = 3
    MISSION = 4
    RTL = 5


SETTABLE = (Mode.STANDBY, Mode.SAFE, Mode.ESTOP)
_LIST = ", ".join(
    (*(f"{_FIRST + mode} {mode.name}" for mode in SETTABLE), *(f"{_AUTO}/{sub.value} AUTO.{sub.name}" for sub in Auto))
)


def custom_mode(mode: Mode) -> int:
    """Return the custom mode of one of our modes, for HEARTBEAT and DO_SET_MODE."""
    return _FIRST + mode


def unpacked(packed: int) -> tuple[int, int]:
    """Split SET_MODE's number into custom and sub mode: PX4 has the main mode in bits 16 to 23, the sub mode above."""
    if packed & 0xFFFF or not packed:
        return packed, 0
    return packed >> 16 & 0xFF, packed >> 24


def asked_mode(base: float, custom: float, sub: float) -> Mode | Auto:
    """Return the mode named by parameters 1 to 3 of DO_SET_MODE; a sub mode of NaN counts as 0.

    Raises ValueError with the list of modes.
    """
    flagged = base in range(256) and int(base) & m.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    sub = 0 if sub != sub else sub
    if flagged and custom == _AUTO and sub in set(Auto):
        return Auto(int(sub))
    if flagged and sub == 0 and custom - _FIRST in SETTABLE:
        return Mode(int(custom) - _FIRST)
    raise ValueError(f"mode {custom:g}/{sub:g} is not taken; custom modes here: {_LIST}")
