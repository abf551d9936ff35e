"""Request lines: encoding for the driver, parsing for the emulator; the grammar of all commands as two tables."""

from __future__ import annotations

from typing import NamedTuple


class Measuring(NamedTuple):
    """Format of a measuring command's data.

    characters: of one value.
    intensity: True if each range is followed by an intensity.
    streams: True if scans follow without further requests.
    echoes: most echoes of a beam.
    stamp: characters of the time stamp.
    """

    characters: int = 3
    intensity: bool = False
    streams: bool = True
    echoes: int = 1
    stamp: int = 4


MEASURING: dict[str, Measuring] = {
    "MD": Measuring(), "MS": Measuring(2), "ME": Measuring(intensity=True),
    "GD": Measuring(streams=False), "GS": Measuring(2, streams=False), "GE": Measuring(intensity=True, streams=False),
    "ND": Measuring(echoes=3), "NE": Measuring(intensity=True, echoes=3),
    "HD": Measuring(streams=False, echoes=3), "HE": Measuring(intensity=True, streams=False, echoes=3),
    "%MD": Measuring(stamp=11), "%ME": Measuring(intensity=True, stamp=11),
}  # fmt: skip
PARAMETERS: dict[str, int] = {
    "VV": 0, "PP": 0, "II": 0, "BM": 0, "QT": 0, "RS": 0, "RT": 0, "RB": 0, "%ST": 0, "%SL": 0, "TM": 1, "%TM": 1,
    "HS": 1, "CR": 2, "DB": 2, "SS": 6, **{code: 13 if kind.streams else 10 for code, kind in MEASURING.items()},
}  # fmt: skip
"""How many characters follow each command."""

_FIELDS = ((0, 4, "01"), (4, 8, "02"), (8, 10, "03"), (10, 11, "06"), (11, 13, "07"))  # of a scan request
_STRING = frozenset(b"abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789 ._+@")


def request(code: str, parameters: str = "", string: str = "") -> bytes:
    """Format a request line: `request("TM", "1")`.

    string: up to 16 letters, digits, space . _ + @; the reply echoes it. Raises ValueError for another string.
    """
    if len(string) > 16 or not _STRING.issuperset(string.encode()):
        raise ValueError(f"string {string!r}: at most 16 of letters, digits, space . _ + @")
    return f"{code}{parameters}{';' if string else ''}{string}\n".encode()


class Request(NamedTuple):
    """A request as received by the sensor.

    echo: the line.
    code: the command.
    parameters: the characters after the code.
    status: "00", or the refusal of a bad string ("0G", "0H").
    """

    echo: bytes
    code: str
    parameters: str
    status: str


def parse_request(line: bytes) -> Request:
    """Parse one request line without its LF. Bytes that are no text become code ""."""
    head, mark, string = line.partition(b";")
    status = "00"
    if mark and len(string) > 16:
        status = "0G"
    elif mark and not _STRING.issuperset(string):
        status = "0H"
    text = head.decode("ascii", "replace")
    width = 3 if text.startswith("%") else 2
    return Request(line, text[:width], text[width:], status)


def refusal(asked: Request) -> str:
    """Status that refuses a malformed request: "0G", "0H", "0E" unknown, "0C" short, "0D" long; else "00"."""
    if asked.status != "00":
        return asked.status
    size = PARAMETERS.get(asked.code)
    if size is None:
        return "0E"
    return "00" if len(asked.parameters) == size else "0C" if len(asked.parameters) < size else "0D"


class ScanRequest(NamedTuple):
    """A request for ranges.

    code: one of MEASURING.
    first, last: steps.
    cluster: steps merged into one value.
    skip: scans left out between two.
    scans: number of scans; 0: endless.
    """

    code: str
    first: int
    last: int
    cluster: int = 1
    skip: int = 0
    scans: int = 0

    @property
    def kind(self) -> Measuring:
        """Data format of its command."""
        return MEASURING[self.code]

    @property
    def beams(self) -> int:
        """Number of directions of a scan; the last cluster may be incomplete."""
        step = max(1, self.cluster)
        return (self.last - self.first + step) // step

    @property
    def channels(self) -> int:
        """Number of values of an echo: 1 for range, 2 for range and intensity."""
        return 2 if self.kind.intensity else 1

    @property
    def values(self) -> int:
        """Number of values in a scan of one echo per beam (ranges and intensities together)."""
        return self.beams * self.channels

    @property
    def streams(self) -> bool:
        """True if scans follow without further requests."""
        return self.kind.streams

    def line(self, remaining: int | None = None) -> bytes:
        """Format the request without LF; with `remaining`, the echo of a scan that has so many to follow."""
        text = f"{self.code}{self.first:04d}{self.last:04d}{self.cluster:02d}"
        if self.streams:
            text += f"{self.skip:d}{self.scans if remaining is None else remaining:02d}"
        return text.encode()


def parse_scan_request(asked: Request, last_step: int) -> ScanRequest | str:
    """Parse a measuring request; return its fields, or the refusing status ("0C" too few, "0D" too long, "01" ...)."""
    text, stream = asked.parameters, MEASURING[asked.code].streams
    if (status := refusal(asked)) != "00":
        return status
    for start, end, wrong in _FIELDS[: 5 if stream else 3]:
        if not (text[start:end].isascii() and text[start:end].isdigit()):
            return wrong
    skip, scans = (int(text[10]), int(text[11:13])) if stream else (0, 0)
    made = ScanRequest(asked.code, int(text[:4]), int(text[4:8]), int(text[8:10]), skip, scans)
    if made.last > last_step:
        return "04"
    if made.last < made.first:
        return "05"
    return made
