"""What the present boot of the rover has told by telemetry: its values, its events, what it was built from."""

from __future__ import annotations

from ground.session.crossing import Crossing
from ground.session.far_clock import FarClock
from ground.session.news import EventHeard, Item, News
from ground.session.telemetry import TelemetryReceiver, Value
from protocol.versions import Versions

_VERSION_ITEMS = tuple(f"{name}_version" for name in Versions._fields)


class Known:
    """items: the newest value of each, by onboard time. events: acknowledges them. versions: None until they came."""

    def __init__(self, far_clock: FarClock, crossing: Crossing) -> None:
        self._far_clock, self._crossing = far_clock, crossing
        self.items: dict[str, Item] = {}
        self.versions: Versions | None = None
        self.events = TelemetryReceiver()

    def forget(self) -> None:
        """Another boot: onboard time begins anew, and nothing of before says anything of it."""
        self._far_clock.forget()
        self.items.clear()
        self.versions = None
        self.events = TelemetryReceiver()

    def receive(self, payload: bytes, now_ns: int) -> list[News]:
        """A Kind.MAVLINK payload: what it tells, in its order. Raises WireError."""
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
