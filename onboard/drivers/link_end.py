"""One end of the link on zenoh: session, data keys, opening probe, counts. What the datagrams mean is the caller's.

The rover's port and the ground's station are both such an end. On the wall clock `take` gives what is there; in
lock-step `take_upto` waits for exactly what is counted. Both carriers, their probe, watchdog and settings are in
`protocol.carrier`: an endpoint udp/... is a session over the link itself, any other leads to a carrier beside this end.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from itertools import cycle

import zenoh

from protocol import carrier

_POLL_S = 50e-6
_DIRECT_SAMPLES = 1024  # on the line itself: what waits behind a flood is a stop, what is over the line loses
_NO_LOCATOR = ("invalid socket address", "invalid port value", "not supported for")  # zenoh finds these at the opening


class LinkEndError(RuntimeError):
    """The link does not answer, or cannot be had now; the text is one line that says what was waited for."""


class LinkEnd:
    """An end named `side` that takes from key `hear` and puts on key `say`. Close it: an open session hangs the
    interpreter at its end. one_way_s: the link's delay, for a udp/ endpoint, on which the rover listens.

    Raises ValueError for an endpoint that is no locator, LinkEndError where it cannot be had now.
    """

    def __init__(self, side: str, endpoint: str, *, hear: str, say: str, one_way_s: float = 1.3) -> None:
        self.failed = False
        self.taken = 0
        self._side, self._hear, self._say = side, hear, say
        self._probe = carrier.Probe()
        self._watchdog: carrier.Watchdog | None = None
        self._opening_s, self._queue_samples = 0.0, carrier.QUEUE_SAMPLES
        if endpoint.startswith(carrier.DIRECT):
            listens = side == carrier.ROVER
            self._watchdog = carrier.Watchdog(one_way_s, may_reopen=not listens)
            self._opening_s, self._queue_samples = carrier.opening_s(one_way_s), _DIRECT_SAMPLES
            where = {"listen": endpoint} if listens else {"connect": endpoint}
            self._settings = carrier.direct_settings(**where, one_way_s=one_way_s)
        else:
            self._settings = carrier.settings(connect=endpoint)
        self._open()

    def _open(self) -> None:
        config = zenoh.Config()
        self._stack = ExitStack()
        try:
            for name, text in self._settings:
                config.insert_json5(name, text)
        except zenoh.ZError as error:
            raise ValueError(_words(error)) from error
        try:
            self._session = self._stack.enter_context(zenoh.open(config))
        except zenoh.ZError as error:
            kind = ValueError if any(words in str(error) for words in _NO_LOCATOR) else LinkEndError
            raise kind(_words(error)) from error
        self._spellings = cycle(carrier.spellings(self._hear))
        self._in = self._subscriber(next(self._spellings), self._queue_samples)
        self._data = self._publisher(self._say)
        if self._watchdog is None:
            self._answers = self._subscriber(carrier.answer_key(self._side), 1000)
            self._ask = self._publisher(carrier.question_key(self._side)).put

    def _subscriber(self, key: str, samples: int) -> zenoh.Subscriber[zenoh.handlers.Handler[zenoh.Sample]]:
        return self._session.declare_subscriber(key, zenoh.handlers.FifoChannel(samples))

    def close(self) -> None:
        """Ends the session; may be called again."""
        self.failed = True
        self._leave()

    def _leave(self) -> None:
        with suppress(zenoh.ZError):  # zenoh waits 10 s for a handshake under way, which over a long link takes more
            self._stack.close()

    @property
    def open(self) -> bool:
        """Whether the carrier has answered a probe; on a session over the link itself, whether there is one."""
        return self.linked if self._watchdog else self._probe.open

    @property
    def linked(self) -> bool:
        """Whether anybody is at the other end of the session now."""
        info = self._session.info
        return bool(info.peers_zid() or info.routers_zid())

    def knock(self) -> None:
        """One turn of the opening probe; nothing once it is open."""
        if self._watchdog or self._probe.open:
            return
        answer = self._answers.try_recv()
        question = self._probe.send(time.monotonic_ns())
        ready = self._probe.receive(answer.payload.to_bytes()) if answer is not None else None
        for words in (question, ready):
            if words is not None:
                self._send(self._ask, words)

    def wait_open(self, limit_s: float, alone_s: float = float("inf")) -> bool:
        """Knocks until the carrier answers, at most limit_s, and with no peer at all at most alone_s.

        A session over the link itself has no peer before its handshake, so it is given three of them at least.
        """
        limit_s, alone_s = max(limit_s, self._opening_s), max(alone_s, self._opening_s)
        start_s = time.monotonic()
        while not self.open:
            self.knock()
            waited_s = time.monotonic() - start_s
            if waited_s > limit_s or (waited_s > alone_s and not self.linked):
                break
            time.sleep(0.001)
        return self.open

    def take(self, most: int) -> list[bytes]:
        """The datagrams that have arrived, at most `most`."""
        got: list[bytes] = []
        while len(got) < most and (sample := self._in.try_recv()) is not None:
            got.append(sample.payload.to_bytes())
        self.taken += len(got)
        if self._watchdog:
            self._keep_sound(self._watchdog, bool(got))
        return got

    def _keep_sound(self, watchdog: carrier.Watchdog, heard: bool) -> None:
        if self.failed:
            return
        linked, wanted = self.linked, self._data.matching_status.matching  # type: ignore[attr-defined]
        cure = watchdog.step(time.monotonic_ns(), linked=linked, heard=heard, wanted=wanted)
        if cure is carrier.Cure.DECLARE:
            old, self._in = self._in, self._subscriber(next(self._spellings), self._queue_samples)
            old.undeclare()  # type: ignore[no-untyped-call]
        elif cure is carrier.Cure.REOPEN:
            self._leave()
            self._open()

    def take_upto(self, total: int, limit_s: float) -> list[bytes]:
        """Waits until `total` datagrams have been taken since the start; returns the new ones.

        Raises LinkEndError when they do not come within `limit_s` of wall time.
        """
        missing, got, end_s = total - self.taken, list[bytes](), 0.0
        while len(got) < missing:
            more = self.take(missing - len(got))
            got += more
            if more:
                continue
            end_s = end_s or time.monotonic() + limit_s
            if time.monotonic() > end_s:
                raise LinkEndError(f"link: {len(got)} of {missing} datagrams came within {limit_s:g} s")
            time.sleep(_POLL_S)
        return got

    def put(self, datagram: bytes) -> None:
        """Puts a datagram; without a session it is lost, as on a dead link."""
        self._send(self._data.put, datagram)

    def _send(self, put: Callable[[bytes], None], data: bytes) -> None:
        if self.failed:
            return
        try:
            put(data)
        except zenoh.ZError:
            self.failed = True

    def _publisher(self, key: str) -> zenoh.Publisher:
        """An unbatched put. On the local bus reliable and blocking, it loses nothing; on the link itself neither."""
        sure = self._watchdog is None
        return self._session.declare_publisher(
            key, express=True,
            congestion_control=zenoh.CongestionControl.BLOCK if sure else zenoh.CongestionControl.DROP,
            reliability=zenoh.Reliability.RELIABLE if sure else zenoh.Reliability.BEST_EFFORT,
        )  # fmt: skip


def _words(error: zenoh.ZError) -> str:
    """The innermost of zenoh's words, without the places in its source."""
    inner = str(error).rsplit("[", 1)[-1].rsplit('msg: "', 1)[-1]
    return inner.split(" at /", 1)[0].strip()
