"""SCIP 2.0, the language of Hokuyo scanners, both directions: bytes in, checked replies out, and back. No I/O.

A request is one line; a reply is lines that end in one LF each and closes with an empty line, so frames end at LF LF:

    request   MD 0000 1080 01 0 00 LF            code, first, last step, cluster, skip, number of scans (00 endless)

    reply     MD0000108001000 LF                 echo of the request (no sum)
              00P LF                             status (2), its sum
              LF                                 end: the stream is on
    scan      MD0000108001000 LF                 echo; its last two digits count the scans that remain
              99b LF                             status of a scan
              0KO[g LF                           stamp: 4 characters, 24 bits of milliseconds; its sum
              <64 characters>s LF                data in blocks of 64 characters, each with its sum; values straddle
              ...                                the borders of blocks, a range has 3 characters
              <1 to 64 characters>s LF
              LF                                 end

    value     6 bits a character, high bits first, each plus 0x30: characters 0x30 to 0x6F
    sum       the low 6 bits of the sum of the line's bytes, plus 0x30; it may be `;`
    text      KEY:VALUE;s                        the sum covers what stands before the `;`

Source: Hokuyo C-42-03320B; statuses and strings as logged from a UTM-30LX. Nothing here was tried on a physical sensor.
Over 300 lines because both directions stand together: what one end writes and the other reads is seen to be the same.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from protocol import WireError

BLOCK = 64
STAMP_MODULUS = 1 << 24  # milliseconds: 4 h 39 min 37 s
FRAME_LIMIT = 16_384  # the longest reply of a UTM-30LX (ME, 1081 beams) has 6,717 bytes
_WIDTH = {"MD": (3, 1), "MS": (2, 1), "ME": (3, 2), "GD": (3, 1), "GS": (2, 1), "GE": (3, 2)}  # characters, values
_FIELDS = ((0, 4, "01"), (4, 8, "02"), (8, 10, "03"), (10, 11, "06"), (11, 13, "07"))  # of a scan request
_STRING = frozenset(b"abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789 ._+@")


# -- characters ------------------------------------------------------------------------------------------------


def checksum(line: bytes) -> bytes:
    """The sum character of a line."""
    return bytes(((sum(line) & 0x3F) + 0x30,))


def encode_value(value: int, characters: int) -> bytes:
    """A number in 2, 3 or 4 characters (12, 18, 24 bits). Raises ValueError where it does not fit."""
    if not 0 <= value < 1 << 6 * characters:
        raise ValueError(f"{value} does not fit {characters} characters")
    return bytes((value >> 6 * k & 0x3F) + 0x30 for k in range(characters - 1, -1, -1))


def decode_value(text: bytes) -> int:
    """The number in 2, 3 or 4 characters. Raises WireError("character") outside 0x30 to 0x6F."""
    value = 0
    for character in text:
        if not 0x30 <= character <= 0x6F:
            raise WireError("character", f"byte 0x{character:02x}")
        value = value << 6 | character - 0x30
    return value


def encode_blocks(values: NDArray[np.int32], characters: int) -> bytes:
    """Values (any shape, row by row) as data blocks with sums and LFs."""
    shifts = np.arange(6 * (characters - 1), -1, -6, dtype=np.int32)
    sixes = ((values.reshape(-1, 1) >> shifts) & 0x3F).astype(np.uint8).ravel()
    whole = len(sixes) // BLOCK
    lines = np.empty((whole, BLOCK + 2), np.uint8)
    lines[:, :BLOCK] = sixes[: whole * BLOCK].reshape(whole, BLOCK)
    lines[:, BLOCK] = lines[:, :BLOCK].sum(axis=1, dtype=np.uint8) & 0x3F
    lines[:, : BLOCK + 1] += 0x30
    lines[:, BLOCK + 1] = 0x0A
    rest = (sixes[whole * BLOCK :] + 0x30).tobytes()
    return lines.tobytes() + (rest + checksum(rest) + b"\n" if rest else b"")


def decode_blocks(body: bytes, count: int, characters: int) -> NDArray[np.int32]:
    """`count` values from data blocks whose last LF is missing (the splitter took it).

    Raises WireError: "length" (blocks too short or long, LF not where it belongs), "character", "block_sum".
    """
    whole, rest = divmod(count * characters, BLOCK)
    size = whole * (BLOCK + 2) + (rest + 2 if rest else 0)
    if len(body) + 1 != size:
        raise WireError("length", f"{len(body) + 1} bytes of data blocks where {size} belong")
    sixes = np.frombuffer(body + b"\n", np.uint8) - np.uint8(0x30)
    lines = sixes[: whole * (BLOCK + 2)].reshape(whole, BLOCK + 2)
    tail = sixes[whole * (BLOCK + 2) :]
    line_feed = np.uint8(0x0A - 0x30 & 0xFF)
    if (lines[:, -1] != line_feed).any() or (rest and tail[-1] != line_feed):
        raise WireError("length", "a block does not end where it should")
    payload = np.concatenate((lines[:, :BLOCK].ravel(), tail[:-2]))
    if payload.max(initial=0) > 0x3F:
        raise WireError("character", "a data byte outside 0x30 to 0x6F")
    sums = lines[:, :BLOCK].sum(axis=1, dtype=np.uint8) & 0x3F  # 64 * 0x30 adds nothing to the low 6 bits
    if (sums != lines[:, BLOCK]).any():
        raise WireError("block_sum")
    if rest and (int(tail[:-2].sum()) + 0x30 * rest) & 0x3F != tail[-2]:
        raise WireError("block_sum")
    wide = payload.astype(np.int32).reshape(count, characters)
    value = wide[:, 0]
    for k in range(1, characters):
        value = value << 6 | wide[:, k]
    return value


# -- requests --------------------------------------------------------------------------------------------------


def request(code: str, parameters: str = "", string: str = "") -> bytes:
    """A request line: `request("TM", "1")`. string: up to 16 letters, digits, space . _ + @, echoed in the reply."""
    if len(string) > 16 or not _STRING.issuperset(string.encode()):
        raise ValueError(f"string {string!r}: at most 16 of letters, digits, space . _ + @")
    return f"{code}{parameters}{';' if string else ''}{string}\n".encode()


class Request(NamedTuple):
    """A request as a sensor reads it. `status` is "00", or the refusal of a bad string ("0G", "0H")."""

    echo: bytes
    code: str
    parameters: str
    status: str


def parse_request(line: bytes) -> Request:
    """One request line without its LF. Bytes that are no text become code ""."""
    head, mark, string = line.partition(b";")
    status = "00"
    if mark and len(string) > 16:
        status = "0G"
    elif mark and not _STRING.issuperset(string):
        status = "0H"
    text = head.decode("ascii", "replace")
    width = 3 if text.startswith("%") else 2
    return Request(line, text[:width], text[width:], status)


class ScanRequest(NamedTuple):
    """A request for ranges. code MD, MS or ME (a stream) or GD, GS, GE (one scan); scans 0: endless."""

    code: str
    first: int
    last: int
    cluster: int = 1
    skip: int = 0
    scans: int = 0

    @property
    def values(self) -> int:
        """How many values a scan of this request holds (ranges and intensities together)."""
        step = max(1, self.cluster)
        return (self.last - self.first + step) // step * _WIDTH[self.code][1]

    @property
    def streams(self) -> bool:
        """Whether scans follow by themselves."""
        return self.code[0] == "M"

    def line(self, remaining: int | None = None) -> bytes:
        """The request without LF; with `remaining`, the echo of a scan that has so many to follow."""
        text = f"{self.code}{self.first:04d}{self.last:04d}{self.cluster:02d}"
        if self.streams:
            text += f"{self.skip:d}{self.scans if remaining is None else remaining:02d}"
        return text.encode()


def parse_scan_request(asked: Request, last_step: int) -> ScanRequest | str:
    """The fields of MD, MS, ME, GD, GS, GE, or the status that refuses them ("0C" too few, "0D" too long, "01" ...)."""
    text, stream = asked.parameters, asked.code[0] == "M"
    size = 13 if stream else 10
    if len(text) != size:
        return "0C" if len(text) < size else "0D"
    for start, end, refusal in _FIELDS[: 5 if stream else 3]:
        if not (text[start:end].isascii() and text[start:end].isdigit()):
            return refusal
    skip, scans = (int(text[10]), int(text[11:13])) if stream else (0, 0)
    made = ScanRequest(asked.code, int(text[:4]), int(text[4:8]), int(text[8:10]), skip, scans)
    if made.last > last_step:
        return "04"
    if made.last < made.first:
        return "05"
    return made


# -- replies ---------------------------------------------------------------------------------------------------


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
    return reply(echo, status, stamp_line(stamp_ms) + encode_blocks(values, _WIDTH[asked.code][0]))


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
    return ScanReply(remaining, parse_stamp(stamp), decode_blocks(blocks, asked.values, _WIDTH[asked.code][0]))


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


# -- the stream ------------------------------------------------------------------------------------------------


class Splitter:
    """Bytes of the stream in, whole frames out, however they were cut on the way.

    A frame comes with the arrival time of its first byte: the sensor pauses inside a frame, its last byte says little.
    `echo`, if set, begins the frames of a running stream: where it stands inside a frame whose end was lost, the frame
    is cut there, so that one bad byte costs one scan. `overflows` counts what grew beyond FRAME_LIMIT and was dropped.
    """

    def __init__(self) -> None:
        self.echo = b""
        self.overflows = 0
        self._buffer = bytearray()
        self._marks: list[tuple[int, int]] = []  # (offset in the buffer, arrival) of each piece, rising
        self._searched = 0

    def clear(self) -> None:
        """Forget a half frame (the port was reopened)."""
        self._buffer.clear()
        self._marks.clear()
        self._searched = 0

    def receive(self, rx_ns: int, data: bytes) -> list[tuple[int, bytes]]:
        """(arrival of the first byte, frame without its closing LF LF) for each frame that is complete now."""
        if not data:
            return []
        self._marks.append((len(self._buffer), rx_ns))
        self._buffer += data
        frames: list[tuple[int, bytes]] = []
        start = 0
        while (end := self._buffer.find(b"\n\n", max(start, self._searched))) >= 0:
            self._cut(start, end, frames)
            start = end + 2
            self._searched = start
        self._drop(start)
        if len(self._buffer) > FRAME_LIMIT:
            self.overflows += 1
            self.clear()
        self._searched = max(0, len(self._buffer) - 1)
        return frames

    def _cut(self, start: int, end: int, frames: list[tuple[int, bytes]]) -> None:
        while start < end and self._buffer[start] == 0x0A:
            start += 1
        if start == end:
            return
        inner = self._buffer.rfind(self.echo, start + 1, end) if self.echo else -1
        for first, last in ((start, end),) if inner < 0 else ((start, inner), (inner, end)):
            frames.append((self._arrival(first), bytes(self._buffer[first:last])))

    def _arrival(self, offset: int) -> int:
        return next(rx_ns for at, rx_ns in reversed(self._marks) if at <= offset)

    def _drop(self, size: int) -> None:
        if not size:
            return
        del self._buffer[:size]
        kept = [(max(0, at - size), rx_ns) for at, rx_ns in self._marks]
        while len(kept) > 1 and kept[1][0] == 0:
            kept.pop(0)
        self._marks = kept if self._buffer else []
