"""An end of carrier A: a zenoh session to the carrier, with data keys and opening probe (protocol.link.carrier)."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack, suppress

import zenoh

from protocol.link import carrier
from protocol.link.datagrams import MAX_DATAGRAM
from transport.link_end import LinkEnd, LinkEndError

_NO_LOCATOR = ("invalid socket address", "invalid port value", "not supported for")  # zenoh reports these when opening


class ZenohEnd(LinkEnd):
    """End named `side` that receives on key `hear` and sends on key `say`.

    Close it: an open session hangs the interpreter at its end. Raises ValueError for an endpoint that is no locator,
    LinkEndError if it cannot be opened now.
    """

    def __init__(self, side: str, endpoint: str, *, hear: str, say: str) -> None:
        super().__init__()
        self._probe = carrier.Probe()
        config = zenoh.Config()
        self._stack = ExitStack()
        try:
            for name, text in carrier.settings(connect=endpoint):
                config.insert_json5(name, text)
        except zenoh.ZError as error:
            raise ValueError(_words(error)) from error
        try:
            self._session = self._stack.enter_context(zenoh.open(config))
        except zenoh.ZError as error:
            kind = ValueError if any(words in str(error) for words in _NO_LOCATOR) else LinkEndError
            raise kind(_words(error)) from error
        self._in = self._subscriber(hear, carrier.QUEUE_SAMPLES)
        self._data = self._publisher(say)
        self._answers = self._subscriber(carrier.answer_key(side), 1000)
        self._ask = self._publisher(carrier.question_key(side)).put

    def _subscriber(self, key: str, samples: int) -> zenoh.Subscriber[zenoh.handlers.Handler[zenoh.Sample]]:
        return self._session.declare_subscriber(key, zenoh.handlers.FifoChannel(samples))

    def close(self) -> None:
        """Close the session; may be called again."""
        self.failed = True
        with suppress(zenoh.ZError):  # zenoh waits 10 s for a handshake under way
            self._stack.close()

    @property
    def open(self) -> bool:
        """True if the carrier has answered a probe."""
        return self._probe.open

    @property
    def linked(self) -> bool:
        """True if there is a peer at the other end of the session now."""
        info = self._session.info
        return bool(info.peers_zid() or info.routers_zid())

    def knock(self) -> None:
        """Do one step of the opening probe; nothing once it is open."""
        if self._probe.open:
            return
        answer = self._answers.try_recv()
        question = self._probe.send(time.monotonic_ns())
        ready = self._probe.receive(answer.payload.to_bytes()) if answer is not None else None
        for words in (question, ready):
            if words is not None:
                self._send(self._ask, words)

    def take(self, most: int) -> list[bytes]:
        """Return arrived datagrams, at most `most`."""
        got: list[bytes] = []
        while len(got) < most and (sample := self._in.try_recv()) is not None:
            got.append(sample.payload.to_bytes()[: MAX_DATAGRAM + 1])
        self.taken += len(got)
        self.emptied = len(got) < most
        return got

    def put(self, datagram: bytes) -> None:
        """Send a datagram; without a session it is lost, as on a dead link."""
        self._send(self._data.put, datagram)

    def _send(self, put: Callable[[bytes], None], data: bytes) -> None:
        if self.failed:
            return
        try:
            put(data)
        except zenoh.ZError:
            self.failed = True

    def _publisher(self, key: str) -> zenoh.Publisher:
        """Return an unbatched publisher, reliable and blocking: on the local bus it loses nothing."""
        return self._session.declare_publisher(
            key,
            express=True,
            congestion_control=zenoh.CongestionControl.BLOCK,
            reliability=zenoh.Reliability.RELIABLE,
        )


def _words(error: zenoh.ZError) -> str:
    """Innermost part of zenoh's error text, without the places in its source."""
    inner = str(error).rsplit("[", 1)[-1].rsplit('msg: "', 1)[-1]
    return inner.split(" at /", 1)[0].strip()
