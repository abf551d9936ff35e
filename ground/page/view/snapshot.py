"""Snapshot of a station for the page: plain records that the link's thread publishes and every view reads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from ground.link.news import Item
from ground.link.rover_clock import Correlation


class OldValue(NamedTuple):
    """Value of an earlier run, from the archive.

    value: in SI units.
    utc_ns: UTC at which it was measured, ns; by the station's wall clock.
    """

    value: float
    utc_ns: int


class EventRow(NamedTuple):
    """One event of the rover.

    utc_ns: UTC at which it happened, ns, estimated; 0: not known.
    boot_id, serial: identify the event.
    """

    utc_ns: int
    boot_id: int
    serial: int
    severity: str
    name: str
    text: str


class CommandRow(NamedTuple):
    """One request and how far it came. Times are the station's clock, ns; None: not (yet).

    text: of the newest report.
    state: name of the newest state (`protocol.link.reports.RequestState`).
    copies: number of transmissions.
    utc_ns: UTC of the request.
    """

    request_id: int
    station: int
    name: str
    arguments: Mapping[str, Any]
    asked_by: str
    utc_ns: int
    requested_ns: int | None
    sent_ns: int | None
    heard_ns: int | None
    accepted_ns: int | None
    ended_ns: int | None
    state: str
    text: str
    copies: int = 0


@dataclass(frozen=True, slots=True)
class Snapshot:
    """State of one station at one instant.

    now_ns: station's clock.
    mono_ns: monotonic clock of the computer at the same instant.
    utc_ns: UTC at the zero of the station's clock, ns.
    items: newest value of each item of this session.
    before: newest value of each item that the archive has of earlier runs.
    clock: estimate of onboard time at `now_ns`; None: the rover was not received yet.
    heard_ns: last reception; None: never.
    linked: True if the link's carrier has a peer.
    pace_ratio: rate of the rover's clock against the station's; None: not measured.
    trouble: why the station is not on the link, or cannot archive; "": nothing.
    """

    now_ns: int = 0
    mono_ns: int = 0
    utc_ns: int = 0
    station: int = 0
    items: Mapping[str, Item] = field(default_factory=dict)
    before: Mapping[str, OldValue] = field(default_factory=dict)
    clock: Correlation | None = None
    heard_ns: int | None = None
    rtt_ns: int = 0
    boot_id: int = 0
    counts: Mapping[str, int] = field(default_factory=dict)
    sent: int = 0
    linked: bool = False
    trouble: str = ""
    mismatch: str = ""
    in_contact: bool = True
    contact: str = ""
    clock_words: str = ""
    may_command: bool = True
    commands: tuple[CommandRow, ...] = ()
    events: tuple[EventRow, ...] = ()
    transfers: Mapping[str, tuple[int, int]] = field(default_factory=dict)
    says: tuple[str, ...] = ()
    pace_ratio: float | None = None


EMPTY = Snapshot(trouble="the station starts")
