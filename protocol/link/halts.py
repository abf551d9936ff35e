"""Cancellation of requests that were issued before a halt and arrive after it.

    a station sends:      goto (7)    stop (8)                request ids rise in the order of issue
    the rover receives:               stop (8)    goto (7)    -> not executed: issued before the stop of request 8

Rule 1: a request of the station that halted the rover is older than the halt if its request id is lower. This applies
        to requests that let the rover move. The highest halting request id is stored across restarts (`kept`).
Rule 2: request ids of two stations cannot be compared. A request of another station is older if its issue time (that
        station's estimate of onboard time) is before the arrival of the halt: the station could not know of the halt.
        The estimate is off by at most half a round trip. So, if both stations are equally far from the rover, a request
        issued before the halt was issued is cancelled, and one issued after receiving news of the halt is executed.
Rule 3: a request of another station is executed if it has no issue time, because the station had not yet received
        anything from the rover, or if the halt was before a restart: it cannot be distinguished from a newer request.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from protocol.tables.commands import Telecommand, command

_AGAIN = "ask again if it is still wanted"


class _Halt(NamedTuple):
    """Newest halting request of one station.

    request_id: its id.
    name: name of the command; '' if it was received in an earlier boot.
    at_ns: onboard time of its arrival, ns; -1 if it was received in an earlier boot.
    """

    request_id: int
    name: str
    at_ns: int


class Halts:
    """Newest halting request of each station. kept: halting request ids by station, stored before a restart."""

    def __init__(self, kept: Mapping[int, int] = MappingProxyType({})) -> None:
        self._newest = {station: _Halt(request_id, "", -1) for station, request_id in kept.items()}

    def note(self, station: int, asked: Telecommand, now_ns: int) -> None:
        """Store a halting request on arrival."""
        before = self._newest.get(station)
        if before is None or before.request_id < asked.request_id:
            self._newest[station] = _Halt(asked.request_id, asked.name, now_ns)

    def older(self, station: int, asked: Telecommand) -> str:
        """Return the reason to cancel a request; '' if it is newer than each halt, or does not let the rover move."""
        if not command(asked.name).frees:
            return ""
        own = self._newest.get(station)
        if own is not None and asked.request_id < own.request_id:
            of = f"the {command(own.name).typed} of" if own.name else "a stop before the restart,"
            return f"asked before {of} request {own.request_id}; {_AGAIN}"
        for other, halt in self._newest.items():
            if other != station and 0 < asked.issued_ns < halt.at_ns:
                of = f"the {command(halt.name).typed} of station {other} came at {halt.at_ns / 1e9:.1f} s"
                return f"asked at {asked.issued_ns / 1e9:.1f} s, {of}; {_AGAIN}"
        return ""

    def digest_items(self) -> tuple[int, ...]:
        """State values that enter the digest of the core's state."""
        return (len(self._newest), sum(halt.request_id for halt in self._newest.values()))
