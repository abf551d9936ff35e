"""Pending request of the scanner session: when it was sent, when it is repeated, when its reply is late."""

from __future__ import annotations

from onboard.devices.lidar.phases import AGAIN_NS, EXCHANGES, TRIES, Exchange, Phase, comparable
from onboard.devices.lidar.stream import ScanStream
from protocol import scip


class Talk:
    """Pending request. phase: of the session; waiting: the request whose reply is due, without LF."""

    def __init__(self, stream: ScanStream) -> None:
        self._stream = stream
        self.sent_ns = 0
        self.enter(Phase.DOWN)

    def enter(self, phase: Phase) -> None:
        """Enter a phase whose request has not been sent yet."""
        self.phase, self.waiting = phase, b""
        self._again_ns: int | None = None  # time of the repeat, if before the limit
        self._tries = 0
        self._reading: bytes | dict[str, str] | None = None

    @property
    def exchange(self) -> Exchange:
        """The request of the phase."""
        return EXCHANGES.get(self.phase) or Exchange(self._stream.request.line() + b"\n", Phase.STREAM)

    def ask(self, now_ns: int) -> bytes:
        """Return the bytes of the request; an LF before QT ends half a request that the sensor may have buffered."""
        command = self.exchange.command
        self.waiting, self.sent_ns, self._again_ns = command[:-1], now_ns, None
        return b"\n" + command if self.phase is Phase.SYNC else command

    def again(self, now_ns: int) -> bool:
        """Return whether a repeat is due."""
        return self._again_ns is not None and now_ns >= self._again_ns

    def late(self, now_ns: int, limit_ns: int) -> bool:
        """Return whether the reply is late."""
        return now_ns - self.sent_ns >= min(self.exchange.limit_ns, limit_ns)

    def put_off(self, now_ns: int) -> None:
        """Schedule a repeat a little later, after a temporary refusal."""
        self._again_ns = now_ns + AGAIN_NS

    def repeat(self, now_ns: int) -> None:
        """Schedule a repeat at once, a few times: the reply may have been damaged."""
        if self._tries < TRIES:
            self._tries += 1
            self._again_ns = now_ns

    def read(self, answer: scip.Reply, counts: dict[str, int], now_ns: int) -> bool:
        """Return whether a text was read twice alike; if not, schedule a repeat. Raises WireError if it is damaged."""
        reading, before = comparable(answer), self._reading
        if reading == before:
            return True
        counts["disagree"] += before is not None
        self._reading, self._again_ns = reading, now_ns
        return False
