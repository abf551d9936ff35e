"""One operation of the station from its start to its exit code: clock, link, archive and a script, turn by turn."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
from math import isnan
from typing import Protocol

from ground.archive.retention import keep_within
from ground.archive.store import Archive, ArchiveError
from ground.cli.operations import show
from ground.cli.operations.open_requests import left
from ground.cli.operations.script import Runner, ScriptStep
from ground.link.contact import NOT_HEARD_THERE, Contact, Uplink
from ground.link.news import Item, News, ProductHeard, Progress
from ground.link.session import VIEWER, Session
from ground.station.clock import Clock, LockstepClock, WallClock
from ground.station.settings import StationSettings
from ground.station.station import TO_HAVE_A_ROVER, Station, StationError
from ground.station.user import by_hand
from onboard.config import ConfigError
from protocol.tables import commands

OK, FAILED, UNAVAILABLE, TEMPORARY = 0, 1, 69, 75
SHORT_WAIT_S = 0.05  # wait for the archive: the time in which another station writes a turn
_LINK_LIMIT_S, _ALONE_LIMIT_S = 20.0, 3.0
CONNECT_S = (_LINK_LIMIT_S, _ALONE_LIMIT_S)


class ByHandError(Exception):
    """The operation was ended by Ctrl-C. The text states what the rover goes on with."""


@dataclass(frozen=True, slots=True)
class Plan:
    """Plan of one operation.

    steps: of the script; empty: only listen.
    barrier: address of the bench's barrier; "": wall clock.
    contact_s: time limit for the first datagram of the rover, in wall or bench seconds; 0: none.
    limit_s: time limit of the operation, likewise; 0: none.
    lifetime_s: lifetime of a command that moves the rover, s.
    report_s: time between status lines, s.
    asked_by: origin of the requests, for the archive.
    typed: True if the steps are one typed command, no script.
    """

    steps: tuple[ScriptStep, ...] = ()
    barrier: str = ""
    contact_s: float = 0.0
    limit_s: float = 0.0
    lifetime_s: float = 60.0
    report_s: float = 5.0
    asked_by: str = "command line"
    typed: bool = False

    @property
    def halts(self) -> bool:
        """True if all steps halt the rover, at once."""
        return bool(self.steps) and all(
            step.name in commands.HALTING and not (step.start_s or step.start_utc_ns) for step in self.steps
        )


def closed_words(session: Session) -> str:
    """Return why a station without a carrier ends, and which requests are open."""
    return "; ".join(["the link's carrier has closed", *left(session)])


class Teller:
    """Printer of news as text or JSON through `out`, with a status line every `report_s`."""

    def __init__(self, out: Callable[[str], None], as_json: bool, report_s: float) -> None:
        self._out, self._json, self._report_ns = out, as_json, round(report_s * 1e9)
        self._next_ns = 0
        self._progress: dict[str, Progress] = {}
        self._values: dict[str, float] = {}
        self._inside = True
        self._trouble = ""

    def news(self, news: list[News]) -> None:
        """Print what one turn received: progress at each tenth part and at the end only, an item only if it changed."""
        for one in self._whole(news):
            if isinstance(one, Progress) and not self._moved(one):
                continue
            if isinstance(one, Item) and not self._changed(one):
                continue
            if self._json:
                self._out(show.news_json(one))
            elif not isinstance(one, Item):
                self._out(show.news_line(one) or "")

    def begun(self, lines: list[str], now_ns: int, what: str = "script") -> None:
        """Print the lines that begin now. what: `script`, or `asked` for a command that was typed."""
        for line in lines:
            if not self._json:
                self._out(f"{show.clock(now_ns)}  {what:8}  {line}")

    def status(self, session: Session, now_ns: int) -> None:
        """Print a status line when one is due."""
        if not self._json and now_ns >= self._next_ns and session.heard_ns is not None:
            self._next_ns = now_ns + self._report_ns
            self._out(show.status_line(session, now_ns))

    def contact(self, session: Session, now_ns: int) -> None:
        """Print the contact state if it has changed."""
        inside = session.in_contact(now_ns)
        if inside != self._inside:
            self._inside = inside
            words = show.contact_words(session, now_ns)
            self._out(
                json.dumps({"news": "contact", "at_ns": now_ns, "open": inside, "text": words})
                if self._json
                else show.contact_line(session, now_ns)
            )

    def silence(self, silent_s: float, now_ns: int) -> None:
        """Print that nothing was received from the rover for `silent_s`."""
        self._out((show.silence_json if self._json else show.silence_line)(silent_s, now_ns))

    def trouble(self, why: str, now_ns: int) -> None:
        """Print once why rows cannot be archived; "": archiving works again."""
        if why != self._trouble:
            self.said(f"{why}; rows wait in memory, events stay with the rover" if why else "archived again", now_ns)
            self._trouble = why

    def said(self, text: str, now_ns: int) -> None:
        """Print a message of the station itself."""
        self._out(
            json.dumps({"news": "station", "at_ns": now_ns, "text": text})
            if self._json
            else f"{show.clock(now_ns)}  station   {text}"
        )

    def close(self) -> None:
        """End the output."""

    def _moved(self, progress: Progress) -> bool:
        before = self._progress.get(progress.name)
        self._progress[progress.name] = progress
        return before is None or _tenth(before) != _tenth(progress)

    def _changed(self, item: Item) -> bool:
        before, self._values[item.name] = self._values.get(item.name), item.value
        return before != item.value and not (before is not None and isnan(before) and isnan(item.value))

    def _whole(self, news: list[News]) -> Iterator[News]:
        """Yield the news, with the final progress of a transfer before its product."""
        for one in news:
            if isinstance(one, ProductHeard) and (at := self._progress.pop(one.product.name, None)) is not None:
                yield Progress(one.at_ns, at.name, at.total, at.total)
                self._progress.pop(at.name, None)
            yield one


def _tenth(progress: Progress) -> int:
    return 10 * progress.have // max(1, progress.total)


class Beside(Protocol):
    """Participant that works on the session in parallel with the plan.

    It takes the news, makes requests and names its next turn.
    """

    def turn(self, news: list[News], now_ns: int) -> None:
        """Called once a turn, after reception and before sending."""

    def next_due_ns(self) -> int:
        """Return the time of the turn it needs next."""


Join = Callable[[Session], AbstractContextManager[Beside]]


def operate(settings: StationSettings, plan: Plan, teller: Teller, join: Join | None = None) -> tuple[int, Session]:
    """Run the plan to its end, with `join` in parallel. Returns the exit code and the session.

    Raises StationError, ClockError or ConfigError if link, bench or settings are at fault, ByHandError at Ctrl-C.
    """
    with ExitStack() as stack:
        lockstep = bool(plan.barrier)
        utc_ns = 0 if lockstep else time.time_ns()
        stack.callback(teller.close)
        without: list[str] = []
        archive = stack.enter_context(_archive(settings, plan, utc_ns, teller, without))
        station = stack.enter_context(Station(settings, archive, utc_ns if plan.halts else None))
        station.without[:0] = without
        # constant in lock-step: a repeated run makes the same rows
        station.session.asked_by = plan.asked_by if lockstep else by_hand(plan.asked_by)
        if plan.steps and station.session.viewer:
            raise ConfigError(VIEWER)
        try:
            # The emulator sends HELLO only after our probe; the bench starts only after both: probe before the barrier.
            limits_s = (6 * _LINK_LIMIT_S,) * 2 if lockstep else (_LINK_LIMIT_S, _ALONE_LIMIT_S)
            station.wait_open(*limits_s)
            clock: Clock = LockstepClock(plan.barrier) if lockstep else WallClock()
            stack.enter_context(clock)
            station.session.utc_ns = 0 if lockstep else time.time_ns()  # zero of the clock
            beside = stack.enter_context(join(station.session)) if join is not None else None
            return _turns(station, clock, plan, teller, beside), station.session
        except KeyboardInterrupt:
            raise ByHandError("; ".join(["interrupted", *left(station.session, plan.steps)])) from None


def _archive(settings: StationSettings, plan: Plan, utc_ns: int, teller: Teller, without: list[str]) -> Archive:
    """Open the station's archive. A plan that halts the rover needs none: the cause is added to `without`."""
    path = settings.archive
    stops = plan.halts
    try:
        tidied = path and utc_ns and not stops  # old rows can wait for the next station
        gone = keep_within(path, settings.archive_days, settings.archive_mb, utc_ns) if tidied else 0
        if gone:
            teller.said(f"{path}: {gone} old rows removed, as the station file says", 0)
        return Archive(path or ":memory:", utc_ns, wait_s=SHORT_WAIT_S if stops else None)
    except ArchiveError as error:
        if not stops:
            raise
        without.append(str(error))
        return Archive(":memory:", utc_ns)


def _turns(station: Station, clock: Clock, plan: Plan, teller: Teller, beside: Beside | None) -> int:
    runner, contact, uplink = Runner(list(plan.steps), plan.lifetime_s), Contact(), Uplink()
    session = station.session
    wake_ns: int | None = None
    while True:
        turn = clock.turn(station.sent, wake_ns)
        if turn is None:
            return OK if not plan.steps else TEMPORARY
        now_ns = turn.now_ns
        news = station.turn(turn)
        teller.news(news)
        if beside is not None:
            beside.turn(news, now_ns)
        if plan.steps:
            teller.begun(runner.step(session, now_ns), now_ns, "asked" if plan.typed else "script")
        teller.news(station.flush(now_ns))
        while station.sent and station.without:
            teller.said(f"{station.without.pop(0)}; sent without it", now_ns)
        teller.contact(session, now_ns)
        teller.status(session, now_ns)
        code = _end(runner, session, plan, now_ns)
        if code is not None:
            clock.finish(station.sent, code)
            return code
        teller.trouble(station.trouble, now_ns)
        while session.texts:
            teller.said(session.texts.pop(0), now_ns)
        if uplink.refused(session, now_ns):
            teller.said(NOT_HEARD_THERE, now_ns)
        _watch(contact, station, clock, teller, now_ns)
        dues = (
            runner.next_due_ns(now_ns),
            session.next_due_ns(now_ns),
            contact.next_due_ns(),
            beside.next_due_ns() if beside is not None else None,
        )
        wake_ns = min(due for due in dues if due is not None)


def _watch(contact: Contact, station: Station, clock: Clock, teller: Teller, now_ns: int) -> None:
    silent_s = contact.silent_s(station.session.heard_ns, now_ns)
    if silent_s is not None and station.session.in_contact(now_ns):
        teller.silence(silent_s, now_ns)
    if not clock.repeatable and contact.closed(station.linked, now_ns):
        raise StationError(closed_words(station.session))


def unheard(session: Session, waited_s: float) -> str:
    """Return why nothing was received, as far as the station can determine."""
    refused = {kind: count for kind, count in session.counts.items() if kind != "ok" and count}
    if not refused:
        return f"nothing heard of the rover within {waited_s:g} s; {TO_HAVE_A_ROVER}"
    kind = max(refused, key=lambda name: refused[name])
    why = REFUSED.get(kind, "it speaks another version of the link, or the link spoils what it carries")
    return f"{sum(refused.values())} datagrams came within {waited_s:g} s and none passed its check ({kind}): {why}"


REFUSED = {
    "tag": "the downlink key of this station is not the rover's; `ground keys show-ids` here and there",
    "epoch": "sealed in a key epoch that is not loaded here, or an older one",
    "boot": "the rover's boot id is older than one heard before: another rover, or it lost its state.folder",
    "replay": "all were heard before",
    "copy": "all were heard before",
    "length": "these are no datagrams of this link",
}


def _end(runner: Runner, session: Session, plan: Plan, now_ns: int) -> int | None:
    if plan.steps and runner.result is not None:
        return OK if runner.result else FAILED
    since_ns = session.contact_since_ns(now_ns)
    waited = since_ns is not None and now_ns - since_ns > plan.contact_s * 1e9
    if plan.contact_s and session.heard_ns is None and waited:
        raise StationError(unheard(session, plan.contact_s))
    if plan.limit_s and now_ns > plan.limit_s * 1e9:
        return TEMPORARY
    return None
