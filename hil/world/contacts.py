"""Contacts of the rover with obstacles: touches of single ticks, joined to entries with begin and end.

A contact is one part of the rover (a wheel, or the body) on one rock, or the body on the ground. A wheel that bounces
leaves the rock for some ticks: touches less than GAP_NS apart are one contact.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from typing import Any

from hil.records import Touch, what

GAP_NS = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Contact:
    """One contact, from its first to its last touch; the end of an open contact is the current time.

    begin_s, end_s: times of the first and the last touch
    wheel: 1 to 4, 0 for the body
    rock_height_m: 0 for the ground
    x_m, y_m: place of the first touch, map frame
    """

    begin_s: float
    end_s: float
    wheel: int
    rock_height_m: float
    x_m: float
    y_m: float

    @property
    def what(self) -> str:
        """Part and obstacle, without time and place."""
        return what(self.wheel, self.rock_height_m)

    @property
    def place(self) -> str:
        """Place in the map frame, m."""
        return f"({self.x_m:.2f}, {self.y_m:.2f})"

    def row(self) -> dict[str, Any]:
        """Fields for summary.json and truth.mcap."""
        return {"t_s": self.begin_s, "what": self.what, **asdict(self)}


class Contacts:
    """Collector that joins touches to contacts.

    found: all contacts in the order of their begin; entries of open contacts are replaced
    """

    def __init__(self) -> None:
        self.found: list[Contact] = []
        self._open: dict[tuple[object, ...], tuple[int, int]] = {}  # number in `found` and time of the last touch

    def add(self, now_ns: int, touches: Iterable[Touch]) -> tuple[int, ...]:
        """Add the touches of one tick; returns the numbers of the contacts that began and of those that ended."""
        told = [number for number, last_ns in self._open.values() if now_ns - last_ns >= GAP_NS]
        self._open = {key: entry for key, entry in self._open.items() if now_ns - entry[1] < GAP_NS}
        for touch in touches:
            key = (touch.wheel, touch.rock_m)
            number, _ = self._open.get(key, (len(self.found), now_ns))
            if key in self._open:
                self.found[number] = replace(self.found[number], end_s=now_ns / 1e9)
            else:
                self.found.append(Contact(now_ns / 1e9, now_ns / 1e9, touch.wheel, touch.rock_height_m, *touch.at_m))
                told.append(number)
            self._open[key] = number, now_ns
        return tuple(told)

    @property
    def going_on(self) -> tuple[int, ...]:
        """Numbers of the open contacts."""
        return tuple(number for number, _ in self._open.values())


def lines(contacts: Iterable[Contact]) -> list[str]:
    """Number of contacts and one line for each, for people."""
    found = list(contacts)
    return [f"contacts: {len(found) or 'none'}", *(f"  {line(contact)}" for contact in found)]


def line(contact: Contact) -> str:
    """One contact for people: time, parts, place."""
    return f"{contact.begin_s:.1f} to {contact.end_s:.1f} s: {contact.what} at {contact.place}"
