"""Link of the page: one station session in a thread of its own, turn by turn, and the orders that browsers give it.

    browsers' orders -> inbox -> session -> link            (the thread only)
    link -> session -> Snapshot, products -> browsers        (published whole; readers take the newest)

The thread depends on nothing of the web server. A closed link does not end it: the station is opened again every two
seconds, and an order to halt the rover that came meanwhile, or was sent without a final report, is sent first.
"""

from __future__ import annotations

import logging
import sqlite3
import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from typing import Any

from ground.archive.store import Archive, ArchiveError
from ground.cli.operations import show
from ground.cli.operations.operate import SHORT_WAIT_S, closed_words
from ground.link.contact import NOT_HEARD_THERE, Contact, Uplink
from ground.link.news import EventHeard, Item, News, ProductHeard
from ground.link.session import Session
from ground.page.live.series import Series, Trail
from ground.page.past.archive import Past, read_past, trail
from ground.page.view.model import measured_ns
from ground.page.view.pace import Pace, unequal
from ground.page.view.snapshot import EMPTY, CommandRow, EventRow, OldValue, Snapshot
from ground.station.clock import WallClock
from ground.station.settings import StationSettings
from ground.station.station import Station, StationError
from ground.station.user import by_hand
from onboard.config import ConfigError
from protocol.link.bulk import Product
from protocol.link.reports import RequestState
from protocol.link.transactions import Request
from protocol.tables import commands

PUBLISH_NS = 100_000_000
_RETRY_S, _CONNECT_S, _ALONE_S = 2.0, 20.0, 3.0
_MOST_EVENTS, _MOST_SAYS, _MOST_PAST = 400, 20, 256
_ONLY_HALTS = "this session sends only what halts the rover; mend it and start the server again"
OnProduct = Callable[[Product, int, int | None], None]
OnTurn = Callable[[list[News], Session, int], None]
_LOG = logging.getLogger(__name__)
_DOWN = (StationError, ArchiveError, ConfigError, OSError, sqlite3.Error)


@dataclass(slots=True)
class Order:
    """One order of a browser.

    lifetime_s: the rover does not begin it later than this after its issue; 0: at any time.
    asked_by: origin, for the archive.
    taken: its request id once the session has it; or the error of a refused one.
    """

    name: str
    arguments: commands.Arguments
    lifetime_s: float
    asked_by: str
    taken: Future[int] = field(default_factory=Future)

    @property
    def halts(self) -> bool:
        """True if it halts the rover: then it waits for a closed link, and nothing withdraws it."""
        return self.name in commands.HALTING

    def refuse(self, why: Exception) -> None:
        """Tell the browser that the order is not sent, if it still waits for an answer."""
        if self.taken.set_running_or_notify_cancel():
            self.taken.set_exception(why)


class Live:
    """The link's thread. `start`, then `ask` from any thread, `stop` at the end.

    past: what the archive had at the start.
    on_product: called in the thread with each product, the UTC of its arrival and onboard time then, ns; one
        that it fails on is left out. Onboard time is None while it is not known.
    on_turn: called in the thread with each turn's news, the session and the station's time, ns; dropped if it fails.
    """

    def __init__(
        self,
        settings: StationSettings,
        on_product: OnProduct,
        open_station: Callable[[StationSettings, Archive], Any] = Station,
        on_turn: OnTurn | None = None,
    ) -> None:
        self._settings, self._on_product, self._open_station = settings, on_product, open_station
        self._on_turn = on_turn
        self._thread = threading.Thread(target=self._run, name="link", daemon=False)
        self._end = threading.Event()
        self._inbox: deque[Order] = deque()
        self._past = Past()
        self._events: deque[EventRow] = deque(maxlen=_MOST_EVENTS)
        self._says: deque[str] = deque(maxlen=_MOST_SAYS)
        self._pace = Pace()
        self._sent_ns: dict[int, int] = {}  # request id -> station time of its first transmission
        self._without: list[str] = []  # files of the station that this session could not use: it only halts the rover
        self._renewed: dict[int, Future[int]] = {}  # request id of a halt of an ended session -> its present one
        self.series, self.trail = Series(), Trail()
        self.snapshot = EMPTY

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread and wait for it; the link is closed then."""
        self._end.set()
        if self._thread.is_alive():
            self._thread.join()

    def ask(self, name: str, arguments: commands.Arguments, asked_by: str, lifetime_s: float = 0.0) -> Future[int]:
        """Hand an order to the session. Returns the future of its request id.

        Raises ValueError for a wrong order, and if the thread has ended. While the link is closed only halting orders
        are taken; they wait.
        """
        commands.check(name, arguments)
        if self._thread.ident is not None and not self._thread.is_alive():
            raise ValueError("not sent: the link's thread has ended; start the server again")
        if name not in commands.HALTING and (not self.snapshot.linked or self.snapshot.heard_ns is None):
            raise ValueError(f"not sent: {self.snapshot.trouble or 'nothing was heard of the rover yet'}")
        order = Order(name, arguments, lifetime_s, asked_by)
        (self._inbox.appendleft if order.halts else self._inbox.append)(order)
        return order.taken

    def command(self, request_id: int) -> CommandRow | None:
        """Return one request of this process; None: unknown. One that is sent again counts as the newest."""
        renewed = self._renewed.get(request_id)
        if renewed is not None:
            known = _result(renewed)
            if known is None:
                return None
            request_id = known
        return next((row for row in self.snapshot.commands if row.request_id == request_id), None)

    # -- the thread -----------------------------------------------------------------------------------------

    def _run(self) -> None:
        self._guarded(self._load_past)
        while not self._end.is_set():
            self._guarded(self._session)
            self._end.wait(_RETRY_S)
        while self._inbox:
            self._inbox.popleft().refuse(ValueError("not sent: the server ends"))

    def _guarded(self, part: Callable[[], None]) -> None:
        """Run a part of the thread and publish why it ended: nothing that fails in it ends the thread."""
        try:
            part()
        except _DOWN as error:
            self._publish_down(str(error))
        except Exception as error:  # noqa: BLE001 - a defect of a view or decoder must not end STOP
            _LOG.exception("link")
            self._publish_down(f"the link is opened again after an error here: {type(error).__name__}: {error}")

    def _load_past(self) -> None:
        self._past = read_past(self._settings.archive)
        self._events.extend(self._past.events)
        self.trail = Trail((x, y) for x, y in trail(self._settings.archive).tolist())

    def _session(self) -> None:
        """Run one session until the link closes or the thread ends. Raises StationError and others of _DOWN."""
        utc_ns = time.time_ns()
        halts = any(order.halts for order in tuple(self._inbox))
        self._without = []
        with (
            self._archive(utc_ns, halts) as archive,
            self._open_station(self._settings, archive, *((utc_ns,) if halts else ())) as station,
        ):
            self._without += station.without
            if self._without:
                station.session.only_halts = True
                self._says.append(f"{'; '.join(self._without)}: {_ONLY_HALTS}")
            station.session.asked_by = by_hand("page")
            station.wait_open(_CONNECT_S, _ALONE_S)
            clock = WallClock()
            station.session.utc_ns = time.time_ns()
            self._refuse_waiting("the link was closed")
            self._sent_ns.clear()
            self._pace = Pace()
            try:
                self._turns(station, clock)
            finally:
                self.snapshot = replace(self.snapshot, commands=self._commands(station.session))
                self._renew_halts(station.session)

    def _archive(self, utc_ns: int, halts: bool) -> Archive:
        """Open the station's archive. halts: a stop waits, and needs none; the cause is added to `_without`."""
        try:
            return Archive(self._settings.archive or ":memory:", utc_ns, "page", wait_s=SHORT_WAIT_S, later=True)
        except ArchiveError as error:
            if not halts:
                raise
            self._without.append(str(error))
            return Archive(":memory:", utc_ns, "page")

    def _renew_halts(self, session: Session) -> None:
        """Order each halt without a final report again: it may have been sent into a link that was closed already."""
        orders = []
        for request_id, request in session.requester.requests.items():
            if request.own and not request.state.final and commands.halts(request.payload):
                asked = request.telecommand
                orders.append(order := Order(asked.name, asked.arguments, 0.0, request.asked_by))
                earlier = [old for old, now in self._renewed.items() if _result(now) == request_id]
                self._renewed |= dict.fromkeys((*earlier, request_id), order.taken)
        self._inbox.extendleft(reversed(orders))

    def _turns(self, station: Any, clock: Any) -> None:
        session, contact, uplink = station.session, Contact(), Uplink()
        published_ns = -PUBLISH_NS
        while not self._end.is_set():
            turn = clock.turn(station.sent, None)
            now_ns = turn.now_ns
            news = station.turn(turn)
            self._take_orders(session, now_ns)
            news += station.flush(now_ns)
            self._hear(news, session)
            self._publish_turn(news, session, now_ns)
            while session.texts:
                self._says.append(session.texts.pop(0))
            if uplink.refused(session, now_ns):
                self._says.append(NOT_HEARD_THERE)
            if contact.closed(station.linked, now_ns):
                raise StationError(closed_words(session))
            if now_ns - published_ns >= PUBLISH_NS:
                published_ns = now_ns
                self._mark(session, now_ns)
                self.snapshot = self._shot(station, now_ns)
                self._record(self.snapshot)

    def _take_orders(self, session: Session, now_ns: int) -> None:
        while self._inbox:
            order = self._inbox.popleft()
            if self._without and not order.halts:
                order.refuse(ValueError(f"not sent: {'; '.join(self._without)}: {_ONLY_HALTS}"))
                continue
            waits = order.taken.set_running_or_notify_cancel()
            if not (waits or order.halts):
                continue  # withdrawn: its operator was told that it was not taken
            try:
                request_id = session.request(
                    order.name, order.arguments, now_ns, order.lifetime_s, asked_by=order.asked_by
                )
            except (ValueError, OSError) as error:
                if waits:
                    order.taken.set_exception(error)
            else:
                if waits:
                    order.taken.set_result(request_id)

    def _refuse_waiting(self, why: str) -> None:
        """Refuse all orders that wait but those that halt the rover: these are sent when the link is open."""
        halting = []
        while self._inbox:
            order = self._inbox.popleft()
            if order.halts:
                halting.append(order)
            else:
                order.refuse(ValueError(f"not sent: {why}"))
        self._inbox.extendleft(reversed(halting))

    def _hear(self, news: list[News], session: Session) -> None:
        items = [one for one in news if isinstance(one, Item)]
        if items:
            self._pace.hear(max(one.onboard_ns for one in items), items[-1].at_ns)
        for one in news:
            if isinstance(one, EventHeard):
                clock = session.far_clock.at(one.at_ns)
                known = clock is not None and not unequal(self._pace.ratio)
                ago_ns = max(0, clock.onboard_ns - one.onboard_ns) if clock is not None and known else 0
                happened_ns = session.utc_ns + one.at_ns - ago_ns
                self._events.append(
                    EventRow(happened_ns, session.boot_id, one.serial, one.severity, one.name, one.text)
                )
            elif isinstance(one, ProductHeard):
                self._publish_product(one.product, session.utc_ns + one.at_ns, self._onboard_ns(session, one.at_ns))

    def _onboard_ns(self, session: Session, at_ns: int) -> int | None:
        """Return onboard time at a station time; the newest stamp if the rover's clock has another rate."""
        clock = session.far_clock.at(at_ns)
        if clock is not None and not unequal(self._pace.ratio):
            return clock.onboard_ns
        return max((item.onboard_ns for item in session.items.values()), default=None)

    def _publish_product(self, product: Product, utc_ns: int, onboard_ns: int | None) -> None:
        try:
            self._on_product(product, utc_ns, onboard_ns)
        except Exception as error:  # noqa: BLE001 - a product must not end the link, and with it STOP
            self._says.append(f"the product {product.name} is not shown: {error}")
            _LOG.exception("product %s", product.name)

    def _publish_turn(self, news: list[News], session: Session, now_ns: int) -> None:
        if self._on_turn is None:
            return
        try:
            self._on_turn(news, session, now_ns)
        except Exception as error:  # noqa: BLE001 - a view must not end the link, and with it STOP
            self._on_turn = None
            self._says.append(f"the live view for Foxglove has ended: {error}")
            _LOG.exception("live view")

    def _mark(self, session: Session, now_ns: int) -> None:
        """Note when each request was first sent; the session itself stores times of reports only."""
        for request_id, request in session.requester.requests.items():
            if request.sent and request_id not in self._sent_ns:
                self._sent_ns[request_id] = now_ns

    def _shot(self, station: Any, now_ns: int) -> Snapshot:
        session: Session = station.session
        mono_ns = time.monotonic_ns()
        return Snapshot(
            now_ns,
            mono_ns,
            session.utc_ns,
            session.station,
            dict(session.items),
            self._past.values,
            session.far_clock.at(now_ns),
            session.heard_ns,
            session.far_clock.rtt_ns,
            session.boot_id,
            dict(session.counts),
            station.sent,
            station.linked,
            "; ".join(filter(None, (*self._without, station.trouble))),
            session.mismatch,
            session.in_contact(now_ns),
            show.contact_words(session, now_ns),
            show.clock_words(session, now_ns),
            not session.viewer,
            self._commands(session),
            tuple(self._events),
            session.transfers,
            tuple(self._says),
            self._pace.ratio,
        )

    def _commands(self, session: Session) -> tuple[CommandRow, ...]:
        """Return all requests, those of earlier sessions first."""
        rows = tuple(
            _row(request_id, request, session, self._sent_ns.get(request_id))
            for request_id, request in session.requester.requests.items()
        )
        known = {row.request_id for row in rows} | self._renewed.keys()
        return (*(row for row in self._past.commands if row.request_id not in known), *rows)

    def _record(self, shot: Snapshot) -> None:
        """Add the newest values to the short history and the trail."""
        times = {name: measured_ns(shot, name, shot.now_ns) or 0 for name in shot.items}
        self.series.add(shot.items, {name: (shot.utc_ns + at_ns) / 1e9 for name, at_ns in times.items()})
        x, y = shot.items.get("x_m"), shot.items.get("y_m")
        if x is not None and y is not None:
            self.trail.add(x.value, y.value, shot.boot_id)

    def _publish_down(self, why: str) -> None:
        """Publish that the station is not on the link. Values keep their times, so they grow old.

        Requests lose their times, which were those of the session's clock.
        """
        last = self.snapshot
        values = {**last.before, **_aged(last)} if last.items else self._past.values
        rows = tuple(_ended_row(row) for row in last.commands[-_MOST_PAST:]) or self._past.commands
        self._past = Past(values, self._past.events, rows)
        self._refuse_waiting(why)
        waiting = [order.name for order in tuple(self._inbox) if order.halts]
        trouble = f"{why}; {', '.join(waiting)} waits for the link" if waiting else why
        self.snapshot = Snapshot(
            now_ns=0,
            mono_ns=time.monotonic_ns(),
            utc_ns=time.time_ns(),
            station=self._settings.station,
            before=self._past.values,
            boot_id=last.boot_id,
            trouble=trouble,
            contact=last.contact,
            commands=rows,
            events=tuple(self._events),
            says=tuple(self._says),
        )


def _aged(shot: Snapshot) -> dict[str, OldValue]:
    """Return the values of a session that has ended as old values, each with the UTC of its measurement."""
    found = {}
    for name, item in shot.items.items():
        at_ns = measured_ns(shot, name, shot.now_ns)
        found[name] = OldValue(item.value, 0 if at_ns is None else shot.utc_ns + at_ns)
    return found


def _result(taken: Future[int]) -> int | None:
    """Return the request id of an order that was taken; None before, or if it was refused."""
    return taken.result() if taken.done() and taken.exception() is None else None


def _ended_row(row: CommandRow) -> CommandRow:
    """Return a request of a session that has ended, as the archive has it."""
    ended_ns = None if row.ended_ns is None else 0
    return row._replace(requested_ns=None, sent_ns=None, heard_ns=None, accepted_ns=None, ended_ns=ended_ns)


def _row(request_id: int, request: Request, session: Session, sent_ns: int | None) -> CommandRow:
    reports = [(at_ns, report.state) for at_ns, report in request.history]
    heard_ns = reports[0][0] if reports and request.sent else None
    accepted_ns = next(
        (at_ns for at_ns, state in reports if RequestState.ACCEPTED <= state <= RequestState.COMPLETED), None
    )
    ended_ns = reports[-1][0] if reports and request.state.final else 0 if request.state.final else None
    return CommandRow(
        request_id,
        session.station,
        request.telecommand.name,
        request.telecommand.arguments,
        request.asked_by,
        session.utc_ns + request.made_ns,
        request.made_ns,
        sent_ns,
        heard_ns,
        accepted_ns,
        ended_ns,
        request.state.name,
        request.report.text if request.report is not None else "",
        request.sent,
    )
