"""Report of a request: state, failure code, text and wire encoding."""

from __future__ import annotations

import struct
from enum import IntEnum
from typing import NamedTuple

from protocol import WireError
from protocol.conventions import cut
from protocol.visible import visible

_REPORT = struct.Struct("<IBBBBB")
_TEXT_BYTES = 110
_MAX_DATA = 8


class RequestState(IntEnum):
    """State of a request. REQUESTED is set by the ground: no report was received yet."""

    REQUESTED = 0
    RECEIVED = 1
    ACCEPTED = 2
    STARTED = 3
    PROGRESS = 4
    COMPLETED = 5
    FAILED = 6
    EXPIRED = 7
    CANCELLED = 8

    @property
    def final(self) -> bool:
        """True if no further report follows."""
        return self >= RequestState.COMPLETED


class Code(IntEnum):
    """Reason why a request ended without being tried; NONE (0) otherwise."""

    NONE = 0
    UNKNOWN_COMMAND = 1
    RANGE = 2
    MODE = 3
    REUSED_ID = 4
    FORGOTTEN_ID = 5
    TOO_MANY = 6
    VERSION = 7  # by the ground itself: the rover was built from another version
    LEASE = 8  # another station holds it
    RESTARTED = 9  # by the ground itself: the outcome is unknown
    OVERTAKEN = 10  # CANCELLED: issued before a halt, and arrived after it


class Report(NamedTuple):
    """One report of the rover about a request.

    request_id, station: the request.
    serial: report number of this request, modulo 256.
    state: state of the request.
    code: reason of a failure (`Code`).
    text: at most 110 bytes of UTF-8.
    data: at most 8 floats.
    """

    request_id: int
    station: int
    serial: int
    state: RequestState
    code: int = 0
    text: str = ""
    data: tuple[float, ...] = ()


def encode_report(report: Report) -> bytes:
    """Encode the payload of a Kind.REPORT datagram; a text that is too long is cut."""
    data = report.data[:_MAX_DATA]
    head = _REPORT.pack(report.request_id, report.station, report.serial & 0xFF, report.state, report.code, len(data))
    return head + struct.pack(f"<{len(data)}d", *data) + cut(report.text, _TEXT_BYTES)


def decode_report(payload: bytes) -> Report:
    """Decode a report; control characters in its text become visible. Raises WireError("report") if malformed."""
    try:
        request_id, station, serial, state, code, count = _REPORT.unpack_from(payload)
        at = _REPORT.size + 8 * count
        data = struct.unpack_from(f"<{count}d", payload, _REPORT.size)
        return Report(request_id, station, serial, RequestState(state), code, visible(payload[at:].decode()), data)
    except (struct.error, ValueError) as error:
        raise WireError("report", str(error)) from error
