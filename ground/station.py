"""The station's shell: the link's session on zenoh, the memory of counters, the archive; the logic is in `session`."""

from __future__ import annotations

import json
import time
from contextlib import ExitStack
from types import TracebackType
from typing import Any, Self

import zenoh

from ground.archive import Archive
from ground.clock import Turn
from ground.memory import Block, Memory
from ground.session import EventHeard, Item, News, ProductHeard, ReportHeard, Session
from ground.settings import Settings, station_keys
from onboard.config import ConfigError
from protocol import carrier
from protocol.link import KEY_DOWN, KEY_UP

TO_HAVE_A_ROVER = "`make sim` starts a rover to talk to"
_SPARE = 512  # more numbers than one turn can use
_MOST_PER_TURN = 2000


class StationError(RuntimeError):
    """The link does not answer; the text is one line."""


class Station:
    """One station on the link. Use it inside `with`: an open zenoh session hangs the interpreter at its end."""

    def __init__(self, settings: Settings, archive: Archive) -> None:
        keys = station_keys(settings)
        self._settings, self._archive = settings, archive
        self._memory = Memory(settings.state, settings.station)
        self._block = self._memory.reserve()
        self.session = Session(keys, settings.station, up_bps=settings.up_bps, newest_boot_id=self._block.boot_id)
        self._use(self._block)
        self._probe = carrier.Probe()
        self._archived: set[int] = set()
        self.taken = self.sent = 0
        self._stack = ExitStack()

    def _use(self, block: Block) -> None:
        self._block = block
        self.session.sealer.counter, self.session.requester.next_id = block.counter, block.request_id

    def __enter__(self) -> Self:
        config = zenoh.Config()
        endpoint = self._settings.endpoint
        try:
            for key, text in carrier.settings(connect=endpoint):
                config.insert_json5(key, text)
            session = self._stack.enter_context(zenoh.open(config))
        except zenoh.ZError as error:
            like = "tcp/127.0.0.1:7448"
            raise ConfigError(f"endpoint = {endpoint!r} should be a locator like {like}: {error}") from error
        self._zenoh = session
        fifo = zenoh.handlers.FifoChannel
        reliable: dict[str, Any] = {"congestion_control": zenoh.CongestionControl.BLOCK, "express": True,
                                    "reliability": zenoh.Reliability.RELIABLE}
        self._in = session.declare_subscriber(KEY_DOWN, fifo(carrier.QUEUE_SAMPLES))
        self._answers = session.declare_subscriber(carrier.answer_key(carrier.GROUND), fifo(1000))
        self._out = session.declare_publisher(KEY_UP, **reliable)
        self._ask = session.declare_publisher(carrier.question_key(carrier.GROUND), **reliable)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._stack.close()

    @property
    def linked(self) -> bool:
        """Whether anybody is at the other end of the session now."""
        info = self._zenoh.info
        return bool(info.peers_zid() or info.routers_zid())

    def wait_open(self, limit_s: float, alone_s: float) -> None:
        """Knocks until the link's carrier answers; with no peer at all only for alone_s. Raises StationError."""
        start_s = time.monotonic()
        while not self._probe.open:
            self._knock()
            waited_s = time.monotonic() - start_s
            if waited_s > limit_s or (waited_s > alone_s and not self.linked):
                found = f"nobody answered within {limit_s:g} s" if self.linked else "nobody is there"
                raise StationError(f"no link at {self._settings.endpoint}: {found}; {TO_HAVE_A_ROVER}")
            time.sleep(0.001)

    def _knock(self) -> None:
        answer = self._answers.try_recv()
        question = self._probe.send(time.monotonic_ns())
        ready = self._probe.receive(answer.payload.to_bytes()) if answer is not None else None
        for words in (question, ready):
            if words is not None:
                self._ask.put(words)

    def turn(self, turn: Turn) -> list[News]:
        """Takes what the turn counts (or what is there), and hands it to the session. Commits nothing yet."""
        news: list[News] = []
        for datagram in self._take(turn.delivered):
            verdict, heard = self.session.receive(datagram, turn.now_ns)
            self._archive.add("datagrams", turn.now_ns, "down", verdict, datagram)
            news += heard
        for one in news:
            self._keep(one)
        return news

    def _take(self, delivered: int | None, limit_s: float = 30.0) -> list[bytes]:
        got: list[bytes] = []
        until_s = 0.0
        while len(got) < (_MOST_PER_TURN if delivered is None else delivered - self.taken):
            sample = self._in.try_recv()
            if sample is not None:
                got.append(sample.payload.to_bytes())
                continue
            if delivered is None:
                break
            until_s = until_s or time.monotonic() + limit_s
            if time.monotonic() > until_s:
                raise StationError(f"link: {len(got)} of {delivered - self.taken} datagrams came within {limit_s:g} s")
            time.sleep(50e-6)
        self.taken += len(got)
        return got

    def flush(self, now_ns: int) -> None:
        """Puts what is due on the link and makes the turn's rows safe."""
        self._renew_block()
        requests = self.session.requester.requests
        for request_id in sorted(requests.keys() - self._archived):
            asked = requests[request_id].telecommand
            self._archive.add("requests", requests[request_id].made_ns, request_id, self.session.station, asked.name,
                              json.dumps(asked.arguments))
            self._archived.add(request_id)
        for datagram in self.session.send(now_ns):
            self._archive.add("datagrams", now_ns, "up", "ok", datagram)
            self._out.put(datagram)
            self.sent += 1
        self._archive.commit()

    def _renew_block(self) -> None:
        session, block = self.session, self._block
        used_up = session.sealer.counter + _SPARE > block.counter_end
        used_up |= session.requester.next_id + _SPARE // 8 > block.request_end
        if used_up or (self._settings.state and session.boot_id > block.boot_id):
            self._use(self._memory.reserve(session.boot_id))

    def _keep(self, news: News) -> None:
        match news:
            case Item():
                self._archive.add("items", *news)
            case EventHeard():
                self._archive.add("events", *news)
            case ReportHeard(at_ns, _, r):
                self._archive.add("reports", at_ns, r.request_id, r.station, r.serial, r.state.name, r.code, r.text,
                                  json.dumps(r.data))
            case ProductHeard(at_ns, p):
                self._archive.add("products", at_ns, p.object_id, p.name, p.codec, p.data)
