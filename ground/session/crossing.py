"""What was on its way up as the rover restarted: its new start refuses that, which is no reason to warn."""

from __future__ import annotations

from collections import deque

from ground.session.news import EventHeard

_LATE_NS = 30_000_000_000  # onboard time in which what was addressed to the boot before may still come


class Crossing:
    """Counts what only one boot takes, by when it went. Times are the station's clock."""

    def __init__(self) -> None:
        self._said_ns: deque[int] = deque(maxlen=256)
        self._met = 0  # datagrams that may have met the next boot

    def said(self, datagrams: int, now_ns: int) -> None:
        """So many went now."""
        self._said_ns.extend([now_ns] * datagrams)

    def booted(self, since_ns: int) -> None:
        """The rover is up anew; since then it may have heard nothing as the boot before."""
        self._met = sum(at_ns >= since_ns for at_ns in self._said_ns)
        self._said_ns.clear()

    def expected(self, event: EventHeard) -> EventHeard:
        """No warning where a rover that came up anew refused no more than was on its way from here to the old boot."""
        kind, _, count = event.text.partition(" ")
        if event.name != "LINK_REFUSED" or kind != "boot" or not count.isdecimal():
            return event
        if int(count) > self._met or event.onboard_ns > _LATE_NS:
            return event
        return event._replace(severity="info", text=f"{event.text}: on their way from here as it restarted")
