"""What was asked for before the rover was told to halt: arriving after that it is not done.

    a station asks:   goto (7)    stop (8)                request ids rise in the order of asking
    the rover hears:              stop (8)    goto (7)    -> not done: asked before the stop of request 8

Rule 1: of the station that halted the rover, what lets it move and has a lower request id is older. The highest id that
        halted is kept over a restart (`kept`).
Rule 2: request ids of two stations cannot be compared. What another station asked for before the halt came here, by
        its own estimate of onboard time, is older: it could not know of it. The estimate is off by half a round trip at
        most, so what was asked before the halt was asked does not pass, where both are as far from the rover, and what
        is asked by who has heard of the halt does.
Rule 3: an order of another station without a time, asked before that had heard the rover, or of before a restart,
        cannot be told from a newer one and is done.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from protocol.commands import Telecommand, command

_AGAIN = "ask again if it is still wanted"


class _Halt(NamedTuple):
    """The newest of a station. at_ns: onboard time when it came; -1: in a boot before, and its name is not known."""

    request_id: int
    name: str
    at_ns: int


class Halts:
    """The newest halting request of each station. kept: request ids by station, of before a restart."""

    def __init__(self, kept: Mapping[int, int] = MappingProxyType({})) -> None:
        self._newest = {station: _Halt(request_id, "", -1) for station, request_id in kept.items()}

    def note(self, station: int, asked: Telecommand, now_ns: int) -> None:
        """A request that halts the rover, as it comes."""
        before = self._newest.get(station)
        if before is None or before.request_id < asked.request_id:
            self._newest[station] = _Halt(asked.request_id, asked.name, now_ns)

    def older(self, station: int, asked: Telecommand) -> str:
        """Why a request is not done any more; '' where it is newer, or lets nothing move."""
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
        """What of this state enters the digest of the core's state."""
        return (len(self._newest), sum(halt.request_id for halt in self._newest.values()))
