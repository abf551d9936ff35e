"""One end of the link: datagrams in and out, counted. What they mean is the caller's.

The rover's port and the ground's station are both such an end. On the wall clock `take` gives what is there; in
lock-step `take_upto` waits for exactly what is counted. Carrier A is in `zenoh_end`, carrier B in `udp_end`.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable

_POLL_S = 50e-6


class LinkEndError(RuntimeError):
    """The link does not answer, or cannot be had now; the text is one line that says what was waited for."""


class LinkEnd(ABC):
    """What both carriers' ends have in common. Close it."""

    opening_s = 0.0  # an end that has nobody at first is given so long to find the other one
    sends_unasked = False  # whether what is put before any answer may arrive

    def __init__(self) -> None:
        self.failed = False
        self.taken = 0
        self.emptied = True  # whether the last `take` left nothing behind
        self.clock_ns: Callable[[], int] = time.monotonic_ns

    @property
    @abstractmethod
    def open(self) -> bool:
        """Whether the other end, or the carrier, has answered."""

    @property
    @abstractmethod
    def linked(self) -> bool:
        """Whether anybody is at the other end now."""

    @abstractmethod
    def knock(self) -> None:
        """One turn of the opening."""

    @abstractmethod
    def take(self, most: int) -> list[bytes]:
        """The datagrams that have arrived, at most `most`; of one that is too long for the link a beginning that is.

        Fewer than `most` may come though more wait: `emptied` tells.
        """

    @abstractmethod
    def put(self, datagram: bytes) -> None:
        """Puts a datagram; where nobody is there it is lost, as on a dead link."""

    @abstractmethod
    def close(self) -> None:
        """Ends it; may be called again."""

    def wait_open(self, limit_s: float, alone_s: float = float("inf")) -> bool:
        """Knocks until there is an answer, at most limit_s, and with nobody there at all at most alone_s."""
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
