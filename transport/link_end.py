"""One end of the link: datagrams in and out, counted, without their meaning.

The rover's port and the ground's station both use such an end. On the wall clock `take` returns what has arrived; in
lock-step `take_upto` waits for an exact count. Carrier A is in `zenoh_end`, carrier B in `udp_end`.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable

_POLL_S = 50e-6


class LinkEndError(RuntimeError):
    """The link does not answer, or cannot be opened now; the text is one line that names what was awaited."""


class LinkEnd(ABC):
    """Common part of both carriers' ends. Close it after use."""

    opening_s = 0.0  # least time for an end that has no peer at first to find the other one
    sends_unasked = False  # datagrams put before any answer may arrive

    def __init__(self) -> None:
        self.failed = False
        self.taken = 0
        self.emptied = True  # the last `take` left nothing behind
        self.clock_ns: Callable[[], int] = time.monotonic_ns

    @property
    @abstractmethod
    def open(self) -> bool:
        """True if the other end, or the carrier, has answered."""

    @property
    @abstractmethod
    def linked(self) -> bool:
        """True if there is a peer at the other end now."""

    @abstractmethod
    def knock(self) -> None:
        """Do one step of the opening."""

    @abstractmethod
    def take(self, most: int) -> list[bytes]:
        """Return arrived datagrams, at most `most`; one that is too long for the link is cut, and still too long.

        The result may have fewer than `most` though more wait: see `emptied`.
        """

    @abstractmethod
    def put(self, datagram: bytes) -> None:
        """Send a datagram; without a peer it is lost, as on a dead link."""

    @abstractmethod
    def close(self) -> None:
        """Close the end; may be called again."""

    def wait_open(self, limit_s: float, alone_s: float = float("inf")) -> bool:
        """Knock until there is an answer, at most limit_s, and without any peer at most alone_s."""
        limit_s, alone_s = max(limit_s, self.opening_s), max(alone_s, self.opening_s)
        start_s = time.monotonic()
        while not self.open:
            self.knock()
            waited_s = time.monotonic() - start_s
            if waited_s > limit_s or (waited_s > alone_s and not self.linked):
                break
            time.sleep(0.001)
        return self.open

    def take_upto(self, total: int, limit_s: float) -> list[bytes]:
        """Wait until `total` datagrams have been taken since the start; return the new ones.

        Raises LinkEndError if they do not come within `limit_s` of wall time.
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
