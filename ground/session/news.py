"""What a station's end of the link tells, a record each. at_ns: the station's clock. onboard_ns: the rover's."""

from __future__ import annotations

from typing import NamedTuple

from protocol import bulk, transactions


class Item(NamedTuple):
    """A telemetry value; the newest wins."""

    at_ns: int
    onboard_ns: int
    name: str
    value: float


class EventHeard(NamedTuple):
    """An event of the rover, once."""

    at_ns: int
    onboard_ns: int
    serial: int
    severity: str
    name: str
    text: str


class ReportHeard(NamedTuple):
    """News of one of this station's requests."""

    at_ns: int
    name: str
    report: transactions.Report


class ProductHeard(NamedTuple):
    """A whole object, its SHA-256 checked."""

    at_ns: int
    product: bulk.Product


class Progress(NamedTuple):
    """How far a transfer is, in chunks."""

    at_ns: int
    name: str
    have: int
    total: int


News = Item | EventHeard | ReportHeard | ProductHeard | Progress
