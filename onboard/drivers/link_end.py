"""One end of the link on zenoh: session, data keys, opening probe, counts. What the datagrams mean is the caller's.

The rover's port and the ground's station are both such an end. On the wall clock `take` gives what is there; in
lock-step `take_upto` waits for exactly what is counted. The opening probe is in `protocol.carrier`.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack

import zenoh

from protocol import carrier

_POLL_S = 50e-6


class LinkEndError(RuntimeError):
    """The link does not answer; the text is one line that says what was waited for."""


class LinkEnd:
    """An end named `side` that takes from key `hear` and puts on key `say`. Close it: an open session hangs the
    interpreter at its end. Raises ValueError for an endpoint that is no locator."""

    def __init__(self, side: str, endpoint: str, *, hear: str, say: str) -> None:
        self.failed = False
        self.taken = 0
        self._probe = carrier.Probe()
        self._stack = ExitStack()
        config = zenoh.Config()
        try:
            for name, text in carrier.settings(connect=endpoint):
                config.insert_json5(name, text)
            self._session = self._stack.enter_context(zenoh.open(config))
        except zenoh.ZError as error:
            raise ValueError(str(error)) from error
        self._in = self._session.declare_subscriber(hear, zenoh.handlers.FifoChannel(carrier.QUEUE_SAMPLES))
        self._answers = self._session.declare_subscriber(
            carrier.answer_key(side), zenoh.handlers.FifoChannel(1000))
        self._put = self._publisher(say)
        self._ask = self._publisher(carrier.question_key(side))

    def close(self) -> None:
        """Ends the session; may be called again."""
        self.failed = True
        self._stack.close()

    @property
    def open(self) -> bool:
        """Whether the carrier has answered a probe."""
        return self._probe.open

    @property
    def linked(self) -> bool:
        """Whether anybody is at the other end of the session now."""
        info = self._session.info
        return bool(info.peers_zid() or info.routers_zid())

    def knock(self) -> None:
        """One turn of the opening probe; nothing once it is open."""
        if self._probe.open:
            return
        answer = self._answers.try_recv()
        question = self._probe.send(time.monotonic_ns())
        ready = self._probe.receive(answer.payload.to_bytes()) if answer is not None else None
        for words in (question, ready):
            if words is not None:
                self._send(self._ask, words)

    def wait_open(self, limit_s: float, alone_s: float = float("inf")) -> bool:
        """Knocks until the carrier answers, at most limit_s, and with no peer at all at most alone_s."""
        start_s = time.monotonic()
        while not self._probe.open:
            self.knock()
            waited_s = time.monotonic() - start_s
            if waited_s > limit_s or (waited_s > alone_s and not self.linked):
                break
            time.sleep(0.001)
        return self._probe.open

    def take(self, most: int) -> list[bytes]:
        """The datagrams that have arrived, at most `most`."""
        got: list[bytes] = []
        while len(got) < most and (sample := self._in.try_recv()) is not None:
            got.append(sample.payload.to_bytes())
        self.taken += len(got)
        return got

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
        self._send(self._put, datagram)

    def _send(self, put: Callable[[bytes], None], data: bytes) -> None:
        if self.failed:
            return
        try:
            put(data)
        except zenoh.ZError:
            self.failed = True

    def _publisher(self, key: str) -> Callable[[bytes], None]:
        """A reliable, blocking, unbatched put: the local bus loses nothing."""
        publisher = self._session.declare_publisher(
            key, congestion_control=zenoh.CongestionControl.BLOCK, reliability=zenoh.Reliability.RELIABLE, express=True
        )
        return publisher.put
