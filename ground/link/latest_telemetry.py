"""Telemetry of the rover's present boot: values, events, versions."""

from __future__ import annotations

from ground.link.news import EventHeard, Item, News
from ground.link.restart_refusals import Crossing
from ground.link.rover_clock import FarClock
from ground.link.telemetry import TelemetryReceiver, Value
from protocol.link.versions import Versions

_VERSION_ITEMS = tuple(f"{name}_version" for name in Versions._fields)


class LatestTelemetry:
    """Telemetry of one boot.

    items: newest value of each item, by onboard time.
    versions: of protocol and tables on board; None until received.
    events: decoder; it also acknowledges the events.
    """

    def __init__(self, far_clock: FarClock, crossing: Crossing) -> None:
        self._far_clock, self._crossing = far_clock, crossing
        self.items: dict[str, Item] = {}
        self.versions: Versions | None = None
        self.events = TelemetryReceiver()

    def forget(self) -> None:
        """Discard everything at a new boot: onboard time restarts, and values of the old boot are invalid."""
        self._far_clock.forget()
        self.items.clear()
        self.versions = None
        self.events = TelemetryReceiver()

    def receive(self, payload: bytes, now_ns: int) -> list[News]:
        """Process a Kind.MAVLINK payload and return its news in order. Raises WireError."""
        news: list[News] = []
        values: list[Value] = []
        for one in self.events.receive(payload, now_ns):
            if not isinstance(one, Value):
                news.append(self._crossing.expected(EventHeard(now_ns, *one)))
                continue
            values.append(one)
            item = Item(now_ns, one.onboard_ns, one.name, one.value)
            known = self.items.get(one.name)
            if known is None or known.onboard_ns <= item.onboard_ns:
                self.items[one.name] = item
            news.append(item)
        if values:
            self._far_clock.hear(self.events.onboard_ns, now_ns)
        told = {value.name: int(value.value) for value in values if value.name in _VERSION_ITEMS}
        if len(told) == len(_VERSION_ITEMS):
            self.versions = Versions(*(told[name] for name in _VERSION_ITEMS))
        return news
