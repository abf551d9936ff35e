"""Request lines: written by the driver, read by the sensor."""

from __future__ import annotations

from typing import NamedTuple

_WIDTH = {"MD": (3, 1), "MS": (2, 1), "ME": (3, 2), "GD": (3, 1), "GS": (2, 1), "GE": (3, 2)}  # characters, values
_FIELDS = ((0, 4, "01"), (4, 8, "02"), (8, 10, "03"), (10, 11, "06"), (11, 13, "07"))  # of a scan request
_STRING = frozenset(b"abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789 ._+@")


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
    def characters(self) -> int:
        """Characters of a value."""
        return _WIDTH[self.code][0]

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
