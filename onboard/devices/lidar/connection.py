"""Connection state of the scanner's port: open or not, time of the next attempt, time without a reply."""

from __future__ import annotations

from onboard.records import PortState

_FIRST_WAIT_NS, _LAST_WAIT_NS = 100_000_000, 2_000_000_000
_DEAF_NS = 2_000_000_000


class Link:
    """Connection state. The wait before the next attempt doubles from 0.1 s to 2 s until the sensor is known."""

    def __init__(self) -> None:
        self.state = PortState.CLOSED
        self._connections = 0
        self._wait_ns = _FIRST_WAIT_NS
        self._next_ns = 0
        self._answered_ns = 0  # last reply, or start of the connection

    def wants(self, now_ns: int) -> bool:
        """Return whether to try to open the port now. Each True is an attempt."""
        if self.state is PortState.OPEN or now_ns < self._next_ns:
            return False
        self._next_ns = now_ns + self._wait_ns
        self._wait_ns = min(2 * self._wait_ns, _LAST_WAIT_NS)
        return True

    def opened(self, now_ns: int) -> bool:
        """Begin a connection; return whether there was one before."""
        self._connections += 1
        self._answered_ns = now_ns
        return self._connections > 1

    def answered(self, now_ns: int) -> None:
        """Record a reply."""
        self._answered_ns = now_ns

    def deaf(self, now_ns: int) -> bool:
        """Return whether this connection has had no reply for so long that it should be reported."""
        return now_ns - self._answered_ns > _DEAF_NS

    def known(self) -> None:
        """Record that the sensor is known: the next wait is short again."""
        self._wait_ns = _FIRST_WAIT_NS
