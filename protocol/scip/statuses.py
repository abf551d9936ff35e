"""Meanings of the two status characters: one table by command, one for all commands."""

from __future__ import annotations

_SCAN = {
    "01": "first step is not a number", "02": "last step is not a number", "03": "cluster is not a number",
    "04": "last step is beyond the sensor's", "05": "last step lies before the first", "06": "interval is not a number",
    "07": "number of scans is not a number", "10": "the laser is off", "98": "measuring again after an error",
    "99": "a scan",
    **{f"{k:02d}": "stopped to verify an error" for k in range(21, 50)},
    **{f"{k:02d}": "hardware trouble" for k in range(50, 98)},
}  # fmt: skip

BY_COMMAND: dict[str, dict[str, str]] = {
    **dict.fromkeys(("MD", "MS", "ME", "ND", "NE", "GD", "GS", "GE", "HD", "HE", "%MD", "%ME"), _SCAN),
    "BM": {"01": "the laser does not work", "02": "the laser is on already"},
    "RB": {"01": "once more within 1 s to reboot"},
    "TM": {"01": "unknown time command", "02": "time adjustment is on already", "03": "time adjustment is off already",
           "04": "not in time adjustment"},
    "SS": {"01": "bit rate is not a number", "02": "no such bit rate", "03": "this is the bit rate already",
           "04": "this model has no bit rate"},
    "CR": {"01": "speed is not a number", "02": "no such speed", "03": "this is the speed already",
           "04": "this model has one speed"},
    "HS": {"01": "unknown sensitivity", "02": "it has this sensitivity already",
           "03": "this model has one sensitivity"},
    "DB": {"01": "fault is not a number", "02": "no such fault", "03": "this is simulated already",
           "04": "this model simulates no faults", "05": "not while measuring"},
}  # fmt: skip
BY_COMMAND["%TM"] = BY_COMMAND["TM"]

FOR_ALL: dict[str, str] = {
    "00": "done", "0A": "error in the sensor", "0B": "buffer is full, or the command was repeated",
    "0C": "too few characters", "0D": "too many characters", "0E": "unknown command", "0F": "not for this model",
    "0G": "string of more than 16 characters", "0H": "string with a letter that is not allowed",
    "0I": "sensor waits for firmware", "0L": "sensor is in an abnormal state", "0M": "sensor is not stable yet",
    "10": "denied in this state",
}  # fmt: skip

_AS_ASKED = {("BM", "02"), ("TM", "02"), ("TM", "03"), ("%TM", "02"), ("%TM", "03"), ("SS", "03"), ("SS", "04"),
             ("SS", "0F"), ("CR", "03"), ("HS", "02"), ("RB", "01")}  # fmt: skip


def meaning(code: str, status: str) -> str:
    """Return the meaning of `status` in a reply to command `code` ("BM", "%TM"), in a few words."""
    return BY_COMMAND.get(code, {}).get(status) or FOR_ALL.get(status) or "a status that no manual lists"


def succeeded(code: str, status: str) -> bool:
    """True if the sensor is now in the requested state: "00", it was so already, or the model has no such setting."""
    return status == "00" or (code, status) in _AS_ASKED


_STATES: dict[str, str] = {
    "000": "standby", "001": "booting", "002": "time adjustment", "003": "single scans", "004": "streaming",
    "005": "asleep", "006": "waking", "100": "unstable, from standby", "102": "unstable, from time adjustment",
    "103": "unstable, from single scans", "104": "unstable, from streaming", "900": "error",
}  # fmt: skip


def state_text(code: str) -> str:
    """Return a state code of %ST with its meaning: "000: standby"."""
    return f"{code}: {_STATES.get(code, 'a state that no manual lists')}"
