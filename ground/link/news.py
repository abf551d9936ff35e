"""News from a station's end of the link, one record each. at_ns: station's clock. onboard_ns: rover's clock."""

from __future__ import annotations

from typing import NamedTuple

from protocol.link import bulk, transactions


class Item(NamedTuple):
    """Telemetry value; the newest wins."""

    at_ns: int
    onboard_ns: int
    name: str
    value: float


class EventHeard(NamedTuple):
    """Event of the rover, once."""

    at_ns: int
    onboard_ns: int
    serial: int
    severity: str
    name: str
    text: str


class ReportHeard(NamedTuple):
    """Report on one of this station's requests."""

    at_ns: int
    name: str
    report: transactions.Report


class ProductHeard(NamedTuple):
    """Whole object, its SHA-256 checked."""

    at_ns: int
    product: bulk.Product


class Progress(NamedTuple):
    """Progress of a transfer, in chunks."""

    at_ns: int
    name: str
    have: int
    total: int


News = Item | EventHeard | ReportHeard | ProductHeard | Progress
