"""State of the view, gathered from the station's session turn by turn: trail, map, path, lines, the last stop."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from textwrap import wrap
from typing import NamedTuple

from ground.cli.operations.show import WAY
from ground.cli.watch.picture import Place, Scene
from ground.link.news import EventHeard, Item, News, ProductHeard
from ground.link.session import Session
from ground.page.view.model import stale_after_s
from ground.page.view.pace import Pace, unequal
from protocol import WireError
from protocol.link.transactions import RequestState
from protocol.products import LdemProduct, decode_ldem
from protocol.products.way import decode_way

MOST_LINES, MOST_TRAIL = 500, 4000
_STEP_M = 0.05  # of the trail
_INDENT = 21  # of a folded line: the column of its text


class Line(NamedTuple):
    """One line of the event list: severity of protocol.tables.modes, or "station" for the station's own messages."""

    severity: str
    text: str


class Stop(NamedTuple):
    """The last stop that was requested here: when, and its request."""

    at_ns: int
    request_id: int


class Freshness(NamedTuple):
    """Rule for the age of a value, as on the page: counted from its measurement on the rover.

    now_ns: station's clock.
    ahead_ns: onboard time minus station time; None if not known: ages are counted from the arrival.
    one_way_s: delay of the link.
    """

    now_ns: int
    ahead_ns: int | None = None
    one_way_s: float = 0.0

    def age_s(self, item: Item) -> float:
        """Return the age of a value."""
        measured_ns = item.at_ns if self.ahead_ns is None else min(item.at_ns, item.onboard_ns - self.ahead_ns)
        return (self.now_ns - measured_ns) / 1e9

    def stale(self, item: Item) -> bool:
        """Return whether a value is older than it should ever be: it may no longer be true."""
        return self.age_s(item) > stale_after_s(item.name, self.one_way_s)


class PastView(NamedTuple):
    """Content of the archive that the view starts with; see View.

    boot_id: of the trail; 0: not known.
    """

    terrain: LdemProduct | None = None
    terrain_ns: int | None = None
    trail: tuple[Place, ...] = ()
    lines: tuple[Line, ...] = ()
    boot_id: int = 0


class View:
    """State of the view.

    terrain_ns: station's time at which the map arrived, negative in an earlier run; None: no map.
    """

    def __init__(self) -> None:
        self.terrain: LdemProduct | None = None
        self.terrain_ns: int | None = None
        self.trail: deque[Place] = deque(maxlen=MOST_TRAIL)
        self.path: tuple[Place, ...] = ()
        self.lines: deque[Line] = deque(maxlen=MOST_LINES)
        self.stop: Stop | None = None
        self._boot_id, self._pace = 0, Pace()

    def load(self, past: PastView) -> None:
        """Show the content of the archive until something is received from the rover."""
        self.terrain, self.terrain_ns, self._boot_id = past.terrain, past.terrain_ns, past.boot_id
        self.trail.extend(past.trail)
        self.lines.extend(past.lines)

    def add_line(self, text: str, severity: str = "station") -> None:
        """Add a line."""
        self.lines.append(Line(severity, text))

    def rows(self, width: int, most: int) -> list[Line]:
        """Return the newest lines, long ones folded to the width: at most so many rows, the oldest first."""
        found: list[Line] = []
        for line in reversed(self.lines):
            folded = wrap(line.text, max(width, 2 * _INDENT), subsequent_indent=" " * _INDENT) or [""]
            found[:0] = [Line(line.severity, text) for text in folded]
            if len(found) >= most:
                break
        return found[-most:] if most else []

    def receive(self, news: Sequence[News], session: Session) -> None:
        """Process the news of one turn."""
        if session.boot_id and session.boot_id != self._boot_id:  # 0: nothing was received yet
            self._boot_id, self.path = session.boot_id, ()
            self.trail.clear()  # places of an earlier boot may be of another frame
        for one in news:
            if isinstance(one, ProductHeard):
                self._receive_product(one)
        items = [one for one in news if isinstance(one, Item)]
        if items:
            self._pace.hear(max(one.onboard_ns for one in items), items[-1].at_ns)
        place = _place(session) if any(one.name == "y_m" for one in items) else None
        if place is not None and not (self.trail and math.dist(self.trail[-1], place) < _STEP_M):
            self.trail.append(place)

    def freshness(self, session: Session, now_ns: int) -> Freshness:
        """Return the rule for ages now."""
        onboard_ns = session.far_clock.onboard_ns(now_ns)
        known = onboard_ns is not None and not unequal(self._pace.ratio)
        ahead_ns = onboard_ns - now_ns if onboard_ns is not None and known else None
        return Freshness(now_ns, ahead_ns, session.far_clock.rtt_ns / 2e9)

    def scene(self, session: Session) -> Scene:
        """Return the map's content now."""
        place, yaw_rad, goal = _place(session), _number(session, "yaw_rad"), _pair(session, "goal_x_m", "goal_y_m")
        rover = None if place is None else (*place, yaw_rad or 0.0)
        return Scene(self.terrain, rover, tuple(self.trail), self.path if goal else (), goal)

    def _receive_product(self, heard: ProductHeard) -> None:
        """Show a map or path; a damaged one is left out, the list of events reports what arrived."""
        with suppress(WireError):
            if heard.product.name == "ldem":
                self.terrain, self.terrain_ns = decode_ldem(heard.product.data), heard.at_ns
            elif heard.product.name == WAY:
                way = decode_way(heard.product.data)
                self.path = tuple((corner[0], corner[1]) for corner in (*way.path, *way.beyond))


def severity(news: News) -> str:
    """Return the severity of a line made from news."""
    return news.severity if isinstance(news, EventHeard) else "station"


def stop_words(stop: Stop, session: Session, now_ns: int) -> str:
    """Return what is known of a requested stop: not sent, sent so many times, confirmed by the rover, and when."""
    request = session.requester.requests.get(stop.request_id)
    if request is None:
        return "STOP: no longer known"
    since_s = (now_ns - stop.at_ns) / 1e9
    if request.history:
        heard_ns, report = request.history[0]
        words = {RequestState.COMPLETED: "done", RequestState.FAILED: "FAILED"}.get(
            request.state, request.state.name.lower()
        )
        text = f": {report.text}" if report.text else ""
        return f"STOP {words}, confirmed {(heard_ns - stop.at_ns) / 1e9:.1f} s after the key, {since_s:.0f} s ago{text}"
    if not request.sent:
        return f"STOP requested {since_s:.1f} s ago, NOT SENT"
    return f"STOP sent {request.sent} times in {since_s:.1f} s, not confirmed yet"


def _number(session: Session, name: str) -> float | None:
    item = session.items.get(name)
    return item.value if item is not None and math.isfinite(item.value) else None


def _pair(session: Session, x: str, y: str) -> Place | None:
    x_m, y_m = _number(session, x), _number(session, y)
    return None if x_m is None or y_m is None else (x_m, y_m)


def _place(session: Session) -> Place | None:
    return _pair(session, "x_m", "y_m")
