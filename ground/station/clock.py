"""The station's clock: wall time, or bench time granted turn by turn by the barrier.

Both clocks have the same interface. `turn(sent, wake_ns)` reports how many datagrams were sent so far and when the
station needs the next turn; it returns that `ClockTurn`, or None after the bench has ended the run.
"""

from __future__ import annotations

import secrets
import socket
import time
from contextlib import ExitStack
from types import TracebackType
from typing import NamedTuple, Self

from protocol import WireError, barrier

NEVER_TICK = 2**62
_POLL_NS = 5_000_000


def first_nonce() -> int:
    """Return a 63-bit nonce for a station's first hello.

    It is above that of every earlier program unless the wall clock was set back.
    """
    return time.time_ns() >> 20 << 20 | secrets.randbits(20)


class ClockError(RuntimeError):
    """The bench cannot be reached or has closed. The text is one line."""


class ClockTurn(NamedTuple):
    """One turn.

    now_ns: time of the station's clock.
    delivered: datagrams the link has delivered since the start; None: take all that have arrived.
    """

    now_ns: int
    delivered: int | None


class WallClock:
    """Time since the clock was created; polls the link every 5 ms."""

    repeatable = False

    def __init__(self) -> None:
        self._start_ns = time.monotonic_ns()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        pass

    def turn(self, sent: int, wake_ns: int | None) -> ClockTurn | None:
        """Sleep until `wake_ns`, at most 5 ms."""
        now_ns = time.monotonic_ns() - self._start_ns
        until_ns = now_ns + _POLL_NS if wake_ns is None else min(wake_ns, now_ns + _POLL_NS)
        if until_ns > now_ns:
            time.sleep((until_ns - now_ns) / 1e9)
        return ClockTurn(time.monotonic_ns() - self._start_ns, None)

    def finish(self, sent: int, code: int) -> None:
        """Nothing to do: no bench waits for the end."""


class LockstepClock:
    """The participant "ground" of the bench's barrier. Use it inside `with`."""

    repeatable = True

    def __init__(self, address: str, limit_s: float = 120.0) -> None:
        self._address, self._limit_s = barrier.parse_address(address), limit_s
        self._stack = ExitStack()
        self._receiver = barrier.Receiver()
        self._messages: list[barrier.Message] = []
        self._tick: barrier.Tick | None = None
        self._tick_ns = 0
        self._delivered = 0

    def __enter__(self) -> Self:
        try:
            peer = socket.create_connection(self._address, timeout=self._limit_s)
        except OSError as error:
            raise ClockError(f"no bench at {self._address[0]}:{self._address[1]}: {error}") from error
        self._peer = self._stack.enter_context(peer)
        peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._say(barrier.Hello("ground"))
        welcome = self._hear()
        if not isinstance(welcome, barrier.Welcome):
            raise ClockError(f"the bench did not answer HELLO with WELCOME but {type(welcome).__name__}")
        peer.settimeout(None)  # the bench limits the time of a tick, and names the participant that does not answer
        self._tick_ns = welcome.tick_ns
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._stack.close()

    def turn(self, sent: int, wake_ns: int | None) -> ClockTurn | None:
        """Answer the last tick with DONE and wait for the next; None after STOP."""
        if self._tick is not None:
            self._say(barrier.Done(self._tick.number, self._wake_tick(self._tick, wake_ns), {"up_in": sent}))
        message = self._hear()
        if isinstance(message, barrier.Stop):
            self._tick = None
            return None
        if not isinstance(message, barrier.Tick):
            raise ClockError(f"the bench sent {type(message).__name__} where a TICK was due")
        self._tick = message
        for channel in message.channels:
            if channel.name == "down_out":
                self._delivered = channel.count
        return ClockTurn(message.now_ns, self._delivered)

    def finish(self, sent: int, code: int) -> None:
        """Answer the last tick and report the end of the script to the bench: "finished" is 1 + exit code."""
        if self._tick is not None:
            self._say(barrier.Done(self._tick.number, NEVER_TICK, {"up_in": sent, "finished": 1 + code}))
            self._tick = None

    def _wake_tick(self, tick: barrier.Tick, wake_ns: int | None) -> int:
        if wake_ns is None:
            return NEVER_TICK
        return tick.number + max(1, -((tick.now_ns - wake_ns) // self._tick_ns))

    def _say(self, message: barrier.Message) -> None:
        try:
            self._peer.sendall(barrier.encode(message))
        except OSError as error:
            raise ClockError(f"the bench has gone: {error}") from error

    def _hear(self) -> barrier.Message:
        try:
            while not self._messages:
                data = self._peer.recv(65_536)
                if not data:
                    raise ClockError("the bench closed the barrier without a STOP")
                self._messages += self._receiver.receive(data)
        except (OSError, WireError) as error:
            raise ClockError(f"the bench has gone: {error}") from error
        return self._messages.pop(0)


Clock = WallClock | LockstepClock
