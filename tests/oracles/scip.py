"""Whether a measurement frame satisfies every check of SCIP, said slowly and plainly, by the text of the standard.

Written apart from protocol.scip and without it: bytes, loops and nothing else.
"""

from __future__ import annotations

from typing import NamedTuple


class Verdict(NamedTuple):
    """A frame that satisfies every check. beams: for each direction its echoes, each [range] or [range, intensity]."""

    remaining: int
    stamp: int
    beams: list[list[list[int]]]


def sum_of(line: bytes) -> int:
    total = 0
    for byte in line:
        total += byte
    return total % 64 + 48


def number(text: bytes) -> int | None:
    value = 0
    for byte in text:
        if byte < 48 or byte > 111:
            return None
        value = value * 64 + (byte - 48)
    return value


def payload(lines: list[bytes]) -> bytes | None:
    """What the data lines hold, if each ends in its sum and all but the last have 64 characters."""
    text = b""
    for k, line in enumerate(lines):
        data, mark = line[:-1], line[-1:]
        if not 1 <= len(data) <= 64 or (len(data) < 64 and k + 1 < len(lines)) or mark != bytes([sum_of(data)]):
            return None
        text += data
    return text


def echo_of(text: bytes, channels: int) -> list[int] | None:
    if len(text) != 3 * channels:
        return None
    values = [number(text[3 * k : 3 * k + 3]) for k in range(channels)]
    return None if None in values else values


def beams_of(text: bytes, channels: int, echoes: int) -> list[list[list[int]]] | None:
    """Beam after beam: an echo, then more as long as an & follows."""
    wide, at, beams = 3 * channels, 0, []
    while at < len(text):
        beam = []
        while True:
            echo = echo_of(text[at : at + wide], channels)
            if echo is None:
                return None
            beam.append(echo)
            at += wide
            if echoes == 1 or text[at : at + 1] != b"&":
                break
            at += 1
        if len(beam) > echoes:
            return None
        beams.append(beam)
    return beams


def verdict(frame: bytes, request: bytes, beams: int, channels: int = 1, echoes: int = 1) -> Verdict | None:
    """The scan in a frame (without its closing LF LF) that answers `request` (no string, no LF); None if a check fails.

    The remaining count is part of the echo: that of an endless request is 00, else it is less than what was asked for.
    """
    lines = frame.split(b"\n")
    if len(lines) < 3 or b"" in lines:
        return None
    scans, left = int(request[-2:]), lines[0][-2:]
    if lines[0][:-2] != request[:-2] or len(lines[0]) != len(request) or not all(48 <= d <= 57 for d in left):
        return None
    if (scans == 0 and left != b"00") or (scans > 0 and int(left) >= scans):
        return None
    if lines[1] != b"99b" or len(lines[2]) != 5 or lines[2][4] != sum_of(lines[2][:4]):
        return None
    stamp, text = number(lines[2][:4]), payload(lines[3:])
    if stamp is None or text is None:
        return None
    found = beams_of(text, channels, echoes)
    return None if found is None or len(found) != beams else Verdict(int(left), stamp, found)
