"""Clocks of the ticks: the wall clock, and the bench's (lock-step). The only module on board that reads a clock."""

from __future__ import annotations

import select
import socket
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack

from onboard.config import ConfigError
from onboard.drivers.platform.alarm import Alarm
from protocol.barrier import Done, Hello, Receiver, Stop, Tick, Welcome, encode, parse_address
from protocol.conventions import TICK_NS

_ALARM_FIRST_S = 1e-3  # the relative limit ends after the alarm, as a fallback if the alarm fails


class ClockLostError(RuntimeError):
    """The bench that owns time is gone."""


def wait_for(descriptor: int, limit_s: float, alarm: int = -1) -> bool:
    """Wait until the descriptor is readable, the alarm fires, or `limit_s` ends; return the first case. -1: none."""
    awaited = [fd for fd in (descriptor, alarm) if fd >= 0]
    if not awaited:
        time.sleep(limit_s)
        return False
    return descriptor in select.select(awaited, [], [], limit_s)[0]  # poll() would round to whole milliseconds


class WallClock:
    """Absolute deadlines on the monotonic clock; between them the shell waits for data of a port or the deadline.

    idle(left_s): called to wait; it may return early.
    alarm: set to each deadline, for `idle` to wait on.
    late_ns: time from its deadline to the start of the last tick.
    """

    def __init__(self, tick_ns: int = TICK_NS) -> None:
        self._tick_ns = tick_ns
        self._start_ns = time.monotonic_ns()
        self._number = 0
        self.slipped_ticks = self.late_ns = 0
        self.stopping = False
        self.idle: Callable[[float], None] = time.sleep
        self.alarm: Alarm | None = None

    def start(self) -> None:
        """Start the time: the opening of the ports is not part of the run."""
        self._start_ns = time.monotonic_ns()

    def now_ns(self) -> int:
        """Nanoseconds since the start."""
        return time.monotonic_ns() - self._start_ns

    def wait(self) -> Tick | None:
        """Wait for the next deadline. Deadlines missed by whole ticks are skipped and counted. None: stop requested."""
        self._number += 1
        deadline_ns = self._number * self._tick_ns
        late = (self.now_ns() - deadline_ns) // self._tick_ns
        if late > 0:
            self.slipped_ticks += late
            self._number += late
            deadline_ns = self._number * self._tick_ns
        if self.alarm:
            self.alarm.set(self._start_ns + deadline_ns)
        while not self.stopping and (left_ns := deadline_ns - self.now_ns()) > 0:
            self.idle(left_ns / 1e9 + (_ALARM_FIRST_S if self.alarm else 0.0))
        self.late_ns = -left_ns if not self.stopping else 0
        return None if self.stopping else Tick(self._number, deadline_ns, ())

    @property
    def left_ns(self) -> int:
        """Time to the next deadline; negative if it has passed."""
        return (self._number + 1) * self._tick_ns - self.now_ns()

    def overtime(self, ticks: int) -> Iterator[Tick]:
        """Yield this many more ticks after the end of the run."""
        for _ in range(ticks):
            self._number = max(self._number + 1, self.now_ns() // self._tick_ns)
            deadline_ns = self._number * self._tick_ns
            if self.alarm:
                self.alarm.set(self._start_ns + deadline_ns)
            while (left_ns := deadline_ns - self.now_ns()) > 0:
                self.idle(left_ns / 1e9)
            yield Tick(self._number, deadline_ns, ())

    def done(self, tick: Tick, sent: Mapping[str, int], connect: Sequence[str]) -> None:
        """Do nothing: no other participant waits for the tick."""

    def close(self) -> None:
        """Do nothing: there is nothing to close."""


class LockStepClock:
    """Participant of the barrier: the bench sets the time."""

    def __init__(self, address: str, name: str = "onboard") -> None:
        try:
            self._address = parse_address(address)
        except ValueError as error:
            raise ConfigError(f"clock.barrier: {error}") from None
        self._stack = ExitStack()
        self._receiver = Receiver()
        self._inbox: list[object] = []
        self._name = name
        self._now_ns = 0
        self.slipped_ticks = self.late_ns = 0
        self.stopping = False

    def start(self) -> None:
        """Join the barrier; from now on the bench may send ticks. Every port must be open before."""
        self._socket = self._stack.enter_context(socket.create_connection(self._address, timeout=30))
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket.settimeout(None)
        self._socket.sendall(encode(Hello(self._name)))
        if not isinstance(self._next(), Welcome):
            raise ClockLostError("the bench did not answer HELLO with WELCOME")

    def now_ns(self) -> int:
        """Bench time of the present tick."""
        return self._now_ns

    def wait(self) -> Tick | None:
        """Return the next tick, or None when the run is over."""
        message = None if self.stopping else self._next()
        if isinstance(message, Tick):
            self._now_ns = message.now_ns
            return message
        if message is None or isinstance(message, Stop):
            return None
        raise ClockLostError(f"the bench sent {type(message).__name__} where a tick was due")

    def done(self, tick: Tick, sent: Mapping[str, int], connect: Sequence[str]) -> None:
        """Report to the bench that the tick is done, with the counts sent so far."""
        self._socket.sendall(encode(Done(tick.number, tick.number + 1, dict(sent), tuple(connect))))

    def close(self) -> None:
        """Leave the barrier."""
        self._stack.close()

    def _next(self) -> object:
        while not self._inbox:
            # a signal must end the wait even while the bench is silent
            if not select.select([self._socket], [], [], 0.5)[0]:
                if self.stopping:
                    return None
                continue
            data = self._socket.recv(65536)
            if not data:
                raise ClockLostError("the bench closed the barrier")
            self._inbox += self._receiver.receive(data)
        return self._inbox.pop(0)
