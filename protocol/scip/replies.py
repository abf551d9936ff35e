"""Replies of the sensor: encoding for the emulator, parsing and checks for the driver."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from protocol import WireError
from protocol.scip.blocks import decode_blocks, encode_blocks
from protocol.scip.characters import checksum, decode_value, encode_value
from protocol.scip.echoes import decode_echoes, encode_echoes
from protocol.scip.requests import ScanRequest
from protocol.visible import visible

STAMP_MODULUS = 1 << 24  # milliseconds: 4 h 39 min 37 s


def reply(echo: bytes, status: str, lines: bytes = b"") -> bytes:
    """Format a whole reply: echo, status and sum, `lines` (each with its own sum and LF), the empty line."""
    code = status.encode()
    return b"%b\n%b%b\n%b\n" % (echo, code, checksum(code), lines)


def text_line(key: str, value: str) -> bytes:
    """Format `KEY:VALUE;s` and LF."""
    text = f"{key}:{value}".encode()
    return text + b";" + checksum(text) + b"\n"


def stamp_line(stamp: int, characters: int = 4) -> bytes:
    """Format a time, its sum, LF. 4 characters: ms, wraps at 2**24; 11 characters: µs, 66 bits."""
    text = encode_value(stamp % (1 << 6 * characters), characters)
    return text + checksum(text) + b"\n"


def scan_reply(asked: ScanRequest, echo: bytes, stamp: int, values: NDArray[np.int32]) -> bytes:
    """Format a whole scan.

    stamp: ms (4 characters) or µs (11).
    values: (beams,), or (beams, 2) with intensity, or flat; for several echoes (beams, echoes, channels) with MISSING.
    """
    kind = asked.kind
    encode = encode_echoes if kind.echoes > 1 else encode_blocks
    status = "99" if asked.streams else "00"
    return reply(echo, status, stamp_line(stamp, kind.stamp) + encode(values, kind.characters))


class Reply(NamedTuple):
    """A frame with a correct status sum.

    echo: first line, the echo of the request.
    status: two characters.
    body: the lines after the status, the last without its LF.
    """

    echo: bytes
    status: str
    body: bytes


class ScanReply(NamedTuple):
    """A scan that passed all checks.

    remaining: number of scans that follow.
    stamp_ms: time stamp, ms, 24 bits; stamps of %MD and %ME are converted.
    values: (request.values,) int32, mm or codes (ME, GE: range, intensity, range, ...); for several echoes
        (beams, echoes, channels), MISSING for a missing echo.
    """

    remaining: int
    stamp_ms: int
    values: NDArray[np.integer[Any]]


def parse_reply(frame: bytes) -> Reply:
    """Parse a frame of the splitter. Raises WireError: "length" (no status line), "status_sum"."""
    echo, _, rest = frame.partition(b"\n")
    status, _, body = rest.partition(b"\n")
    if len(status) != 3:
        raise WireError("length", f"status line of {len(status)} bytes after {echo[:20]!r}")
    if checksum(status[:2]) != status[2:]:
        raise WireError("status_sum", f"{status!r}")
    return Reply(echo, visible(status[:2].decode("ascii", "replace")), body)


def parse_stamp(line: bytes, characters: int = 4) -> int:
    """Parse the time of a stamp line (also of TM1's): ms of 4 characters, µs of 11.

    Raises WireError: "length", "stamp_sum", "character".
    """
    if len(line) != characters + 1:
        raise WireError("length", f"stamp line of {len(line)} bytes")
    if checksum(line[:-1]) != line[-1:]:
        raise WireError("stamp_sum", f"{line!r}")
    return decode_value(line[:-1])


def state_line(code: str) -> bytes:
    """Format the three digits of %ST, their sum, LF."""
    return code.encode() + checksum(code.encode()) + b"\n"


def parse_state(line: bytes) -> str:
    """Parse the code in a state line without LF. Raises WireError: "length", "text_sum", "character"."""
    if len(line) != 4:
        raise WireError("length", f"state line of {len(line)} bytes")
    if checksum(line[:3]) != line[3:]:
        raise WireError("text_sum", f"{line!r}")
    if not line[:3].isdigit():
        raise WireError("character", f"{line!r}")
    return line[:3].decode()


def parse_scan(answer: Reply, asked: ScanRequest, string: bytes = b"") -> ScanReply:
    """Decode and check the scan in a reply to `asked` (sent with `;string`, if any).

    Raises WireError like its parts, or "echo", "status".
    """
    kind = asked.kind
    remaining = _remaining(answer.echo, asked, string)
    if answer.status != ("99" if kind.streams else "00"):
        raise WireError("status", answer.status)
    line, _, blocks = answer.body.partition(b"\n")
    stamp = parse_stamp(line, kind.stamp)
    stamp_ms = stamp if kind.stamp == 4 else stamp // 1000 % STAMP_MODULUS
    if kind.echoes > 1:
        shape = kind.echoes, asked.channels, kind.characters
        return ScanReply(remaining, stamp_ms, decode_echoes(blocks, asked.beams, shape))
    return ScanReply(remaining, stamp_ms, decode_blocks(blocks, asked.values, kind.characters))


def _remaining(echo: bytes, asked: ScanRequest, string: bytes) -> int:
    """Return the number of scans that follow, from the echo; the rest of the echo must match the request."""
    line = asked.line()
    counted = asked.streams and asked.scans > 0
    digits = echo[len(line) - 2 : len(line)] if counted else b"00"
    whole = (line[:-2] + digits if asked.streams else line) + (b";" + string if string else b"")
    if echo != whole or not digits.isdigit():
        raise WireError("echo", f"{echo[:40]!r}")
    remaining = int(digits)
    if counted and remaining >= asked.scans:
        raise WireError("echo", f"{remaining} of {asked.scans} scans remain")
    return remaining


def parse_text(answer: Reply) -> dict[str, str]:
    """Parse KEY: VALUE of VV, PP or II, blanks stripped, control characters visible.

    Raises WireError: "text" (no key), "text_sum".
    A sum over the text with its `;` is accepted as well: some firmware sends it.
    """
    pairs = {}
    for line in answer.body.split(b"\n"):
        text, mark, got = line[:-2], line[-2:-1], line[-1:]
        if mark != b";" or b":" not in text:
            raise WireError("text", f"{line[:80]!r}")
        if got not in (checksum(text), checksum(text + b";")):
            raise WireError("text_sum", f"{line[:80]!r}")
        key, _, value = text.decode("ascii", "replace").partition(":")
        pairs[visible(key)] = visible(value.strip())
    return pairs
