"""State of the view, gathered from the station's session turn by turn: trail, map, path, events, the last stop."""

from __future__ import annotations

import math
from collections import deque
from contextlib import suppress
from typing import NamedTuple

from ground.operation.show import WAY
from ground.session.news import EventHeard, Item, News, ProductHeard
from ground.session.session import Session
from ground.watch.picture import Place, Scene
from protocol import WireError
from protocol.products import LdemProduct, decode_ldem
from protocol.products.way import decode_way
from protocol.telemetry import BY_NAME
from protocol.transactions import State

MOST_LINES, MOST_TRAIL = 500, 4000
_STEP_M = 0.05  # of the trail
_LATE_PERIODS, _LATE_S = 4.0, 3.0


class Line(NamedTuple):
    """One line of the event list: severity of protocol.modes, or "station" for what the station itself says."""

    severity: str
    text: str


class Stop(NamedTuple):
    """The last stop that was requested here: when, and its request."""

    at_ns: int
    request_id: int


class View:
    """State of the view. `terrain_ns` is the station's time at which the map came; None: from an earlier run."""

    def __init__(self, terrain: LdemProduct | None = None) -> None:
        self.terrain, self.terrain_ns = terrain, None if terrain is None else -1
        self.trail: deque[Place] = deque(maxlen=MOST_TRAIL)
        self.path: tuple[Place, ...] = ()
        self.lines: deque[Line] = deque(maxlen=MOST_LINES)
        self.added = 0  # lines since the start, those that were dropped included
        self.stop: Stop | None = None
        self._boot_id = 0

    def say(self, text: str, severity: str = "station") -> None:
        """Add a line."""
        self.lines.append(Line(severity, text))
        self.added += 1

    def take(self, news: list[News], session: Session) -> None:
        """Process the news of one turn."""
        if session.boot_id != self._boot_id:
            self._boot_id, self.path = session.boot_id, ()
        for one in news:
            if isinstance(one, ProductHeard):
                self._take_product(one)
        moved = any(isinstance(one, Item) and one.name == "y_m" for one in news)
        place = _place(session) if moved else None
        if place is not None and not (self.trail and math.dist(self.trail[-1], place) < _STEP_M):
            self.trail.append(place)

    def _take_product(self, heard: ProductHeard) -> None:
        """Show a map or path; a damaged one is left out, the list of events reports what came."""
        with suppress(WireError):
            if heard.product.name == "ldem":
                self.terrain, self.terrain_ns = decode_ldem(heard.product.data), heard.at_ns
            elif heard.product.name == WAY:
                way = decode_way(heard.product.data)
                self.path = tuple((corner[0], corner[1]) for corner in (*way.path, *way.beyond))

    def scene(self, session: Session) -> Scene:
        """The map's content now."""
        place, yaw_rad, goal = _place(session), _number(session, "yaw_rad"), _pair(session, "goal_x_m", "goal_y_m")
        rover = None if place is None else (*place, yaw_rad or 0.0)
        return Scene(self.terrain, rover, tuple(self.trail), self.path if goal else (), goal)


def severity(news: News) -> str:
    """Severity of a line made from news."""
    return news.severity if isinstance(news, EventHeard) else "station"


def stop_words(stop: Stop, session: Session, now_ns: int) -> str:
    """Say what is known of a requested stop: not sent, sent so many times, heard by the rover, and when."""
    request = session.requester.requests.get(stop.request_id)
    if request is None:
        return "STOP: no longer known"
    since_s = (now_ns - stop.at_ns) / 1e9
    if request.history:
        heard_ns, report = request.history[0]
        words = {State.COMPLETED: "done", State.FAILED: "FAILED"}.get(request.state, request.state.name.lower())
        text = f": {report.text}" if report.text else ""
        return f"STOP {words}, confirmed {(heard_ns - stop.at_ns) / 1e9:.1f} s after the key, {since_s:.0f} s ago{text}"
    if not request.sent:
        return f"STOP asked {since_s:.1f} s ago, NOT SENT"
    return f"STOP sent {request.sent} times in {since_s:.1f} s, not confirmed yet"


def late(item: Item, now_ns: int) -> bool:
    """True if a value is older than several of its periods: it may no longer be true."""
    row = BY_NAME.get(item.name)
    period_s = 1.0 / row.rate_hz if row is not None else 1.0
    return (now_ns - item.at_ns) / 1e9 > max(_LATE_PERIODS * period_s, _LATE_S)


def _number(session: Session, name: str) -> float | None:
    item = session.items.get(name)
    return item.value if item is not None and math.isfinite(item.value) else None


def _pair(session: Session, x: str, y: str) -> Place | None:
    x_m, y_m = _number(session, x), _number(session, y)
    return None if x_m is None or y_m is None else (x_m, y_m)


def _place(session: Session) -> Place | None:
    return _pair(session, "x_m", "y_m")
