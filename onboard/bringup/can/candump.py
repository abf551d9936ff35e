"""Parser of one line of candump, as `candump -L` writes it for machines or `candump` for people.

    (1436509052.249713) vcan0 181#0011223344556677          -L, a file of `candump -l`; also with R or T at its end
     (1436509052.249713)  vcan0  RX - -  181   [8]  00 11   -t a, -x; -t d and -t z alike, -t A with a date
      vcan0  181   [8]  00 11 22 33 44 55 66 77             without times

In both, an id of eight digits is an extended or an error frame, and R a remote frame; `##` or [08] is CAN FD.
"""

from __future__ import annotations

import re
from datetime import datetime
from typing import NamedTuple

NS = 1_000_000_000
ERROR_FLAG = 0x20000000

_STAMP = r"(?:\((?:(?P<date>\d{4}-\d\d-\d\d \d\d:\d\d:\d\d)|(?P<seconds>\d+))\.(?P<fraction>\d+)\)\s+)?"
_COMPACT = re.compile(_STAMP + r"(?P<bus>\S+)\s+(?P<id>[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})#(?P<data>\S*)(?:\s+[RT])?")
_SPACED = re.compile(
    _STAMP + r"(?P<bus>\S+)\s+(?:[RT]X\s+\S\s+\S\s+)?(?P<id>[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})\s+"
    r"\[(?P<length>\d+)\]\s*(?P<data>remote request|(?:[0-9A-Fa-f]{2}(?:\s+|$))*)(?P<rest>.*)"
)


class ReceivedFrame(NamedTuple):
    """One frame received from a bus or a log.

    stamp_ns: time of reception, None if the log has no times.
    can_id: identifier.
    data: payload.
    kind: "data", or the kind of another frame.
    """

    stamp_ns: int | None
    can_id: int
    data: bytes
    kind: str = "data"


def parse(line: str) -> ReceivedFrame | None:
    """The frame of a line; None for an empty line. Raises ValueError for a line that candump does not write."""
    text = line.strip()
    if not text:
        return None
    if found := _COMPACT.fullmatch(text):
        return _compact(found)
    if found := _SPACED.fullmatch(text):
        return _spaced(found)
    raise ValueError("no line of candump")


def _compact(found: re.Match[str]) -> ReceivedFrame:
    stamp_ns, can_id, text = _stamp_ns(found), int(found["id"], 16), found["data"]
    if text.startswith("#"):
        return ReceivedFrame(stamp_ns, can_id, _bytes(text[2:]), "CAN FD frame")
    if text.startswith("R"):
        return ReceivedFrame(stamp_ns, can_id, b"", "remote frame")
    return ReceivedFrame(stamp_ns, can_id, _short(_bytes(text.replace(".", ""))), _kind(found["id"]))


def _spaced(found: re.Match[str]) -> ReceivedFrame:
    stamp_ns, can_id, text = _stamp_ns(found), int(found["id"], 16), found["data"]
    if text.startswith("remote"):
        return ReceivedFrame(stamp_ns, can_id, b"", "remote frame")
    data = _bytes(text)
    if len(data) != int(found["length"]):
        raise ValueError(f"{len(data)} bytes where [{found['length']}] is said")
    if len(found["length"]) == 2:
        return ReceivedFrame(stamp_ns, can_id, data, "CAN FD frame")
    if found["rest"] and not found["rest"].startswith(("'", "ERRORFRAME")):
        raise ValueError(f"{found['rest']!r} after its bytes")
    return ReceivedFrame(stamp_ns, can_id, _short(data), _kind(found["id"]))


def _bytes(text: str) -> bytes:
    try:
        return bytes.fromhex(text)
    except ValueError:
        raise ValueError("its bytes are no pairs of hexadecimal digits") from None


def _short(data: bytes) -> bytes:
    if len(data) > 8:
        raise ValueError(f"{len(data)} bytes in a classic frame")
    return data


def _kind(digits: str) -> str:
    if len(digits) == 3:
        return "data"
    return "error frame" if int(digits, 16) & ERROR_FLAG else "extended frame"


def _stamp_ns(found: re.Match[str]) -> int | None:
    """Time of a line; a date is read as UTC."""
    if not found["fraction"]:
        return None
    date, seconds = found["date"], found["seconds"]
    whole_s = int(datetime.fromisoformat(date + "+00:00").timestamp()) if date else int(seconds)
    return whole_s * NS + int(found["fraction"].ljust(9, "0")[:9])
