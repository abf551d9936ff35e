"""Monitors of the contact: one reports a long silence of the rover and a closed carrier, one a refused uplink.

Pure: times and facts in. A silent rover is reported and never ends a session: it may be in a blackout. A closed carrier
ends it, on the wall clock: nothing that is sent then arrives.
"""

from __future__ import annotations

from ground.link.session import Session
from protocol.link.transactions import RequestState

NOT_HEARD_THERE = (
    "the rover refuses what this station sends and answers nothing: is its command key the rover's? "
    "It is asked on; Ctrl-C ends that"
)
_UNANSWERED_NS = 10_000_000_000
SILENT_NS = 15_000_000_000
CLOSED_NS = 5_000_000_000


class Uplink:
    """Uplink monitor: reports once that the rover refuses this station, from the rover's count of refused datagrams."""

    def __init__(self) -> None:
        self._first: float | None = None
        self._told = False

    def refused(self, session: Session, now_ns: int) -> bool:
        """True once: a request has no answer for 10 s, and the rover has refused datagrams since first received."""
        item = session.items.get("link_refused")
        if self._told or item is None:
            return False
        own = [one for one in session.requester.requests.values() if one.own]
        self._first = item.value if self._first is None else self._first
        waits = any(
            one.state is RequestState.REQUESTED and one.sent > 1 and now_ns - one.made_ns >= _UNANSWERED_NS
            for one in own
        )
        answered = any(one.report is not None for one in own)
        self._told = waits and not answered and item.value > self._first
        return self._told


class Contact:
    """Contact monitor of one operation. Times are the station's clock, which starts at 0."""

    def __init__(self) -> None:
        self._since_ns = 0
        self._told = 0
        self._linked_ns = 0

    def silent_s(self, heard_ns: int | None, now_ns: int) -> float | None:
        """Return the silence in s each time another 15 s have passed; else None. heard_ns None: never received."""
        if heard_ns is not None and heard_ns > self._since_ns:
            self._since_ns, self._told = heard_ns, 0
        whole = (now_ns - self._since_ns) // SILENT_NS
        if whole <= self._told:
            return None
        self._told = whole
        return (now_ns - self._since_ns) / 1e9

    def closed(self, linked: bool, now_ns: int) -> bool:
        """Return whether the station has had no peer for 5 s."""
        if linked:
            self._linked_ns = now_ns
        return now_ns - self._linked_ns >= CLOSED_NS

    def next_due_ns(self) -> int:
        """Return the time at which `silent_s` reports next if nothing is received until then."""
        return self._since_ns + (self._told + 1) * SILENT_NS
