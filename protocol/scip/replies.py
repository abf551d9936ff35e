"""Replies: written by the sensor, read and checked by the driver."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from protocol import WireError
from protocol.scip.blocks import decode_blocks, encode_blocks
from protocol.scip.characters import checksum, decode_value, encode_value
from protocol.scip.requests import ScanRequest

STAMP_MODULUS = 1 << 24  # milliseconds: 4 h 39 min 37 s


def reply(echo: bytes, status: str, lines: bytes = b"") -> bytes:
    """A whole reply: echo, status and sum, `lines` (each with its own sum and LF), the empty line."""
    code = status.encode()
    return b"%b\n%b%b\n%b\n" % (echo, code, checksum(code), lines)


def text_line(key: str, value: str) -> bytes:
    """`KEY:VALUE;s` and LF."""
    text = f"{key}:{value}".encode()
    return text + b";" + checksum(text) + b"\n"


def stamp_line(stamp_ms: int) -> bytes:
    """A time in 4 characters, its sum, LF; wraps at 2**24 ms."""
    text = encode_value(stamp_ms % STAMP_MODULUS, 4)
    return text + checksum(text) + b"\n"


def scan_reply(asked: ScanRequest, echo: bytes, stamp_ms: int, values: NDArray[np.int32]) -> bytes:
    """A whole scan with `asked.values` values (ME, GE: range, intensity, range, ...)."""
    status = "99" if asked.streams else "00"
    return reply(echo, status, stamp_line(stamp_ms) + encode_blocks(values, asked.characters))


class Reply(NamedTuple):
    """A frame whose status sum fits. `body`: the lines after the status, the last without its LF."""

    echo: bytes
    status: str
    body: bytes


class ScanReply(NamedTuple):
    """A scan all of whose checks passed. values: (request.values,) int32, mm or codes."""

    remaining: int
    stamp_ms: int
    values: NDArray[np.int32]


def parse_reply(frame: bytes) -> Reply:
    """A frame of the splitter. Raises WireError: "length" (no status line), "status_sum"."""
    echo, _, rest = frame.partition(b"\n")
    status, _, body = rest.partition(b"\n")
    if len(status) != 3:
        raise WireError("length", f"status line of {len(status)} bytes after {echo[:20]!r}")
    if checksum(status[:2]) != status[2:]:
        raise WireError("status_sum", f"{status!r}")
    return Reply(echo, status[:2].decode("ascii", "replace"), body)


def parse_stamp(line: bytes) -> int:
    """Milliseconds of a stamp line (also of TM1's). Raises WireError: "length", "stamp_sum", "character"."""
    if len(line) != 5:
        raise WireError("length", f"stamp line of {len(line)} bytes")
    if checksum(line[:4]) != line[4:]:
        raise WireError("stamp_sum", f"{line!r}")
    return decode_value(line[:4])


def parse_scan(answer: Reply, asked: ScanRequest) -> ScanReply:
    """The scan in a reply to `asked`, all checked. Raises WireError like its parts, or "echo", "status"."""
    expected = asked.line()
    remaining = 0
    if asked.streams:
        digits = answer.echo[13:15]
        if answer.echo[:13] != expected[:13] or len(answer.echo) != 15 or not digits.isdigit():
            raise WireError("echo", f"{answer.echo[:40]!r}")
        remaining = int(digits)
    elif answer.echo != expected:
        raise WireError("echo", f"{answer.echo[:40]!r}")
    if answer.status != ("99" if asked.streams else "00"):
        raise WireError("status", answer.status)
    stamp, _, blocks = answer.body.partition(b"\n")
    return ScanReply(remaining, parse_stamp(stamp), decode_blocks(blocks, asked.values, asked.characters))


def parse_text(answer: Reply) -> dict[str, str]:
    """KEY: VALUE of VV, PP or II, blanks stripped. Raises WireError: "text" (no key), "text_sum".

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
        pairs[key] = value.strip()
    return pairs
