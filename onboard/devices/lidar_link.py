"""The scanner's port as the session sees it: open or not, when to try again, how long nothing was answered."""

from __future__ import annotations

from onboard.records import PortState

_FIRST_WAIT_NS, _LAST_WAIT_NS = 100_000_000, 2_000_000_000
_DEAF_NS = 2_000_000_000


class Link:
    """The wait before the next attempt doubles from 0.1 s to 2 s until the sensor is known."""

    def __init__(self) -> None:
        self.state = PortState.CLOSED
        self._connections = 0
        self._wait_ns = _FIRST_WAIT_NS
        self._next_ns = 0
        self._answered_ns = 0  # the last reply, or the begin of the connection

    def wants(self, now_ns: int) -> bool:
        """Whether to try to open it now. Each True is an attempt."""
        if self.state is PortState.OPEN or now_ns < self._next_ns:
            return False
        self._next_ns = now_ns + self._wait_ns
        self._wait_ns = min(2 * self._wait_ns, _LAST_WAIT_NS)
        return True

    def opened(self, now_ns: int) -> bool:
        """A connection begins. Whether there was one before."""
        self._connections += 1
        self._answered_ns = now_ns
        return self._connections > 1

    def answered(self, now_ns: int) -> None:
        """A reply came."""
        self._answered_ns = now_ns

    def deaf(self, now_ns: int) -> bool:
        """Whether this connection brought no reply for so long that somebody should be told."""
        return now_ns - self._answered_ns > _DEAF_NS

    def known(self) -> None:
        """There is a sensor: the next wait is short again."""
        self._wait_ns = _FIRST_WAIT_NS
