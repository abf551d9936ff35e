"""The one request that is due at a time: when it was sent, when it is sent again, when its reply is late."""

from __future__ import annotations

from onboard.devices.lidar_exchange import AGAIN_NS, EXCHANGES, TRIES, Exchange, Phase, comparable
from onboard.devices.lidar_stream import ScanStream
from protocol import scip


class Talk:
    """phase: where the session stands; waiting: the request whose reply is due, without LF."""

    def __init__(self, stream: ScanStream) -> None:
        self._stream = stream
        self.sent_ns = 0
        self.enter(Phase.DOWN)

    def enter(self, phase: Phase) -> None:
        """To a phase whose request was not sent yet."""
        self.phase, self.waiting = phase, b""
        self._again_ns: int | None = None  # when to ask once more, if before the limit
        self._tries = 0
        self._reading: bytes | dict[str, str] | None = None

    @property
    def exchange(self) -> Exchange:
        """What the phase asks."""
        return EXCHANGES.get(self.phase) or Exchange(self._stream.request.line() + b"\n", Phase.STREAM)

    def ask(self, now_ns: int) -> bytes:
        """The bytes of the request; an LF before QT ends half a request that the sensor may hold."""
        command = self.exchange.command
        self.waiting, self.sent_ns, self._again_ns = command[:-1], now_ns, None
        return b"\n" + command if self.phase is Phase.SYNC else command

    def again(self, now_ns: int) -> bool:
        """Whether it is time to ask once more."""
        return self._again_ns is not None and now_ns >= self._again_ns

    def late(self, now_ns: int, limit_ns: int) -> bool:
        """Whether the reply did not come in time."""
        return now_ns - self.sent_ns >= min(self.exchange.limit_ns, limit_ns)

    def put_off(self, now_ns: int) -> None:
        """Refused for now: once more a little later."""
        self._again_ns = now_ns + AGAIN_NS

    def repeat(self, now_ns: int) -> None:
        """The reply may have come damaged: ask again at once, a few times."""
        if self._tries < TRIES:
            self._tries += 1
            self._again_ns = now_ns

    def read(self, answer: scip.Reply, counts: dict[str, int], now_ns: int) -> bool:
        """Whether a text was read twice alike; if not, it is asked for again. Raises WireError where not whole."""
        reading, before = comparable(answer), self._reading
        if reading == before:
            return True
        counts["disagree"] += before is not None
        self._reading, self._again_ns = reading, now_ns
        return False
