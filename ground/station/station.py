"""The station: its end of the link, saved counters and archive, around the logic in `session`."""

from __future__ import annotations

import json
from contextlib import suppress
from types import TracebackType
from typing import Self

from ground.archive.store import Archive, ArchiveError
from ground.archive.unfinished_requests import fate
from ground.link.news import EventHeard, Item, News, ProductHeard, ReportHeard
from ground.link.saved_state import SavedLinkState
from ground.link.schedule import Schedule
from ground.link.session import Session
from ground.station.clock import ClockTurn, first_nonce
from ground.station.memory import Block, Memory
from ground.station.settings import StationSettings, load_schedule, station_keys
from onboard.config import ConfigError
from protocol import WireError
from protocol.link import carrier
from protocol.link.datagrams import KEY_DOWN, KEY_UP, OVERHEAD, numbers
from protocol.link.transactions import Code, Report, RequestState
from protocol.tables import commands
from transport.link_end import LinkEnd, LinkEndError
from transport.udp_end import UdpGroundEnd
from transport.zenoh_end import ZenohEnd

TO_HAVE_A_ROVER = "`make sim` starts a rover to talk to"
_S = 1_000_000_000
_SPARE = 512  # more numbers than one turn can use
_MOST_PER_TURN = 2000
_NOTE_NS = 10_000_000_000
_LIMIT_S = 30.0  # for datagrams that the bench has counted


class StationError(RuntimeError):
    """The link does not answer. The text is one line."""


class Station:
    """One station on the link. Use it inside `with`: an open zenoh session blocks the interpreter's exit."""

    def __init__(self, settings: StationSettings, archive: Archive, halts_utc_ns: int | None = None) -> None:
        """halts_utc_ns: UTC now, if all requests will halt the rover: then no unusable file of the station stops them.

        `without` has a line for each file that could not be used.
        """
        keys = self._keys = station_keys(settings)
        self.without: list[str] = []
        self._only_halts = halts_utc_ns is not None
        self._settings, self._archive = settings, archive
        self._memory = Memory(settings.state, settings.station)
        self._block = self._reserved(halts_utc_ns)
        kept = (
            self._block.kept if settings.downlink_key else SavedLinkState(self._block.boot_id)
        )  # a bench may restart its boots
        self.session = Session(
            keys, settings.station, up_bps=settings.up_bps, kept=kept, schedule=self._schedule(halts_utc_ns is not None)
        )
        self.session.only_halts = self._block.counter == self._block.counter_end
        self._use(self._block)
        self._unheard, self._last_halt, self._noted_ns, self._now_ns = 0, -1, 0, 0
        self._took_over = False
        self.session.sealer.next_halt = self._next_halt
        self.session.requester.take_id = self._take_id
        self.session.recall(self._kept_chunks)
        self._archived: set[int] = set()
        self.sent = 0

    def _reserved(self, halts_utc_ns: int | None) -> Block:
        try:
            return self._memory.reserve()
        except (OSError, ConfigError) as error:
            if halts_utc_ns is None:
                raise
            self.without.append(f"the numbers of this station cannot be kept: {error}")
            return self._memory.unkept(halts_utc_ns // _S)

    def _schedule(self, halts: bool) -> Schedule:
        try:
            return load_schedule(self._settings)
        except ConfigError as error:
            if not halts:
                raise
            self.without.append(str(error))
            return Schedule()

    def _use(self, block: Block) -> None:
        self._block = block
        self.session.sealer.counter, self.session.requester.next_id = block.counter, block.request_id

    def _next_halt(self) -> int:
        """Return the counter of a halting command: a stop is sent even if this station's disk cannot be written."""
        try:
            self._last_halt = self._memory.next_halt(self._unheard)
        except (OSError, ConfigError):
            utc_s = (self.session.utc_ns + self._now_ns) // _S
            self._last_halt = max(self._last_halt + 1, self._memory.unkept_halt(self._unheard, utc_s))
        self._unheard += 1
        return self._last_halt

    def _halt_answered(self, request_id: int) -> None:
        request = self.session.requester.requests.get(request_id)
        if self._unheard and request is not None and commands.halts(request.payload):
            self._unheard = 0
            with suppress(OSError, ConfigError):
                self._memory.halt_told(self._last_halt)

    def _take_id(self) -> int:
        """Return a request id above all ids of this station's processes, as far as the disk can be read."""
        requester = self.session.requester
        if self.session.only_halts:
            return requester.count_id()
        with suppress(OSError, ConfigError):
            if self._memory.overtaken(self._block):
                self._use(self._memory.reserve(self.session.boot_id))
        if requester.next_id >= self._block.request_end:
            self._use(self._memory.reserve(self.session.boot_id))
        return requester.count_id()

    def _kept_chunks(self) -> list[bytes]:
        try:
            return self._archive.chunks()
        except ArchiveError as error:
            self.session.texts.append(f"{error}; products come from their start")
            return []

    def _note(self) -> None:
        with suppress(OSError, ConfigError):  # it only limits replays until the next start
            self._memory.note(self.session.kept)

    def __enter__(self) -> Self:
        endpoint = self._settings.endpoint
        try:
            self._end = self._opened(endpoint)
        except ValueError as error:
            like = "tcp/127.0.0.1:7448 or udp/127.0.0.1:7448"
            raise ConfigError(f"endpoint = {endpoint!r} should be a locator like {like}: {error}") from error
        except LinkEndError as error:
            raise StationError(f"no link at {endpoint}: {error}") from error
        return self

    def _opened(self, endpoint: str) -> LinkEnd:
        if endpoint.startswith(carrier.DIRECT):
            station, one_way_s = self._settings.station, self._settings.one_way_s
            end = UdpGroundEnd(endpoint, self._keys, station, one_way_s, first_nonce())
            self.session.requester.halt_retry_ns = end.eager_ns
            return end
        return ZenohEnd(carrier.GROUND, endpoint, hear=KEY_DOWN, say=KEY_UP)

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._end.close()
        self._add_requests()
        for one in self.session.close(self._now_ns):
            self._keep(one)
        self._archive.commit()
        self._note()

    @property
    def linked(self) -> bool:
        """True if the link has a peer now; on a link without sessions also while a halting command is retransmitted."""
        return self._end.linked or (
            self._end.sends_unasked
            and any(
                request.own and not request.state.final and commands.halts(request.payload)
                for request in self.session.requester.requests.values()
            )
        )

    def wait_open(self, limit_s: float, alone_s: float) -> None:
        """Probe until the link's carrier answers; without any peer only for `alone_s`. Raises StationError.

        Returns at once if all requests will halt the rover and the carrier needs no answer first.
        """
        if self._only_halts and self._end.sends_unasked:
            return
        if not self._end.wait_open(limit_s, alone_s):
            found = f"nobody answered within {limit_s:g} s" if self.linked else "nobody is there"
            raise StationError(f"no link at {self._settings.endpoint}: {found}; {TO_HAVE_A_ROVER}")

    def turn(self, turn: ClockTurn) -> list[News]:
        """Receive the datagrams of the turn (or all that arrived) and process them in the session.

        Commits nothing yet.
        """
        news: list[News] = []
        for datagram in self._take(turn.delivered):
            verdict, heard = self.session.receive(datagram, turn.now_ns)
            self._log(turn.now_ns, "down", verdict, datagram)
            news += heard
        for one in news:
            self._keep(one)
            if isinstance(one, ReportHeard):
                self._halt_answered(one.report.request_id)
        return news

    def _take(self, delivered: int | None) -> list[bytes]:
        if delivered is None:
            return self._end.take(_MOST_PER_TURN)
        try:
            return self._end.take_upto(delivered, _LIMIT_S)
        except LinkEndError as error:
            raise StationError(str(error)) from error

    def flush(self, now_ns: int) -> list[News]:
        """Commit the turn's rows, then send what is due; returns news of the station itself."""
        self._now_ns = now_ns
        self._renew_block()
        self._add_requests()
        for request_id in self.session.requester.unheard_moves:
            if by := self._archive.halt_after(request_id, self.session.station):
                self.session.halted(request_id, by, now_ns)
        news = self.session.unsaid() + self._take_over(now_ns)
        for one in news:
            self._keep(one)
        datagrams = self.session.send(now_ns)
        for datagram in datagrams:
            self._log(now_ns, "up", "ok", datagram)
        self._archive.commit()
        self.session.keeps = not self._archive.trouble
        for datagram in datagrams:
            self._end.put(datagram)
            self.sent += 1
        if now_ns - self._noted_ns >= _NOTE_NS:
            self._noted_ns = now_ns
            self._note()
        return news

    def _add_requests(self) -> None:
        requests = self.session.requester.requests
        for request_id in sorted(requests.keys() - self._archived):
            asked = requests[request_id].telecommand
            self._archive.add(
                "requests",
                requests[request_id].made_ns,
                request_id,
                self.session.station,
                asked.name,
                json.dumps(asked.arguments),
                requests[request_id].payload,
                requests[request_id].asked_by,
            )
            self._archived.add(request_id)
        self._archived &= requests.keys()  # requests that the session has forgotten

    def _take_over(self, now_ns: int) -> list[News]:
        """Take over, once the rover is received, open requests of earlier processes of this station."""
        session, settings = self.session, self._settings
        if self._took_over or session.heard_ns is None or session.viewer or not (settings.state and session.utc_ns):
            return []
        if self._archive.late or session.only_halts:
            return []
        self._took_over = True
        news: list[News] = []
        for one in self._archive.orphans(session.station):
            words = fate(one, session.boot_id, session.utc_ns + now_ns)
            report = Report(one.request_id, session.station, one.serial & 0xFF, RequestState[one.state], 0, one.text)
            if words is not None:
                ended = report._replace(
                    serial=one.serial + 1 & 0xFF, state=RequestState.FAILED, code=Code.RESTARTED, text=words
                )
                news.append(ReportHeard(now_ns, one.name, ended))
                continue
            with suppress(WireError):  # of an archive without payloads
                here = one.serial >= 0 and one.boot_id == session.boot_id
                session.requester.take_over(one.payload, report if here else None, now_ns)
                self._archived.add(one.request_id)
        return news

    @property
    def trouble(self) -> str:
        """Cause for which rows cannot be archived now; "": none."""
        return self._archive.trouble

    def _log(self, at_ns: int, direction: str, verdict: str, datagram: bytes) -> None:
        short = len(datagram) < OVERHEAD
        self._archive.add(
            "datagrams", at_ns, direction, verdict, datagram, *((None, None) if short else numbers(datagram))
        )

    def _renew_block(self) -> None:
        session, block = self.session, self._block
        if session.only_halts:
            return
        used_up = session.sealer.counter + _SPARE > block.counter_end
        used_up |= session.requester.next_id + _SPARE // 8 > block.request_end
        try:
            due = used_up or self._memory.behind(session.sealer.counter)
            if due or (self._settings.state and session.boot_id > block.boot_id):
                self._use(self._memory.reserve(session.boot_id))
        except OSError as error:  # storing a newer boot is optional
            if used_up:
                session.only_halts = True
                self._use(self._memory.unkept((session.utc_ns + self._now_ns) // _S))
                session.texts.append(
                    f"the numbers of this station cannot be kept: {error}; from now on it sends only "
                    "what stops the rover"
                )

    def _keep(self, news: News) -> None:
        match news:
            case Item():
                self._archive.add("items", *news, self.session.boot_id)
            case EventHeard():
                self._archive.add("events", *news, self.session.boot_id)
            case ReportHeard(at_ns, _, r):
                self._archive.add(
                    "reports",
                    at_ns,
                    r.request_id,
                    r.station,
                    r.serial,
                    r.state.name,
                    r.code,
                    r.text,
                    json.dumps(r.data),
                    self.session.boot_id,
                )
            case ProductHeard(at_ns, p):
                self._archive.add("products", at_ns, p.object_id, p.name, p.codec, p.data)
