"""A station in virtual time: the real session, a toy rover and a carrier that can close, behind Station's face."""

from ground.link.session import Session
from ground.station.clock import ClockTurn
from protocol.link.datagrams import bench_keys
from tests.ground.toy_rover import TICK_NS, ToyRover

S = 1_000_000_000


class VirtualClock:
    """Goes on by the rover's ticks; fails a test that would wait for ever. jumps: sleeps until it is woken."""

    def __init__(self, limit_s: float = 300.0, jumps: bool = False, repeatable: bool = False) -> None:
        self._now_ns, self._limit_ns = -TICK_NS, round(limit_s * S)
        self._jumps, self.repeatable = jumps, repeatable

    def __enter__(self):
        return self

    def __exit__(self, *_) -> None:
        pass

    def turn(self, sent: int, wake_ns: int | None) -> ClockTurn:
        self._now_ns += TICK_NS
        if self._jumps and wake_ns is not None:
            self._now_ns = max(self._now_ns, wake_ns)
        assert self._now_ns < self._limit_ns, "the operation does not end"
        return ClockTurn(self._now_ns, None)

    def finish(self, sent: int, code: int) -> None:
        pass


class VirtualStation:
    """silent: spans in s in which no datagram passes; closed_s: when the carrier closes. rover_keys: others."""

    def __init__(
        self, silent: tuple[tuple[float, float], ...] = (), closed_s: float = 1e9, rover_keys=None, **rover
    ) -> None:
        keys = bench_keys(7)
        self.session, self.rover = Session(keys, 1), ToyRover(rover_keys or keys, **rover)
        self._silent, self._closed_s = silent, closed_s
        self._now_s, self.sent = 0.0, 0
        self.without: list[str] = []

    def __enter__(self):
        return self

    def __exit__(self, *_) -> None:
        pass

    def wait_open(self, *_) -> None:
        pass

    trouble = ""

    @property
    def linked(self) -> bool:
        return self._now_s < self._closed_s

    @property
    def _passes(self) -> bool:
        return self.linked and not any(start_s <= self._now_s < end_s for start_s, end_s in self._silent)

    def turn(self, turn: ClockTurn) -> list:
        self._now_s = turn.now_ns / S
        sent = self.rover.tick(turn.now_ns)
        return [one for datagram in sent if self._passes for one in self.session.receive(datagram, turn.now_ns)[1]]

    def flush(self, now_ns: int) -> list:
        for datagram in self.session.send(now_ns):
            self.sent += 1
            if self._passes:
                self.rover.receive(datagram, now_ns)
        return self.session.unsaid()
