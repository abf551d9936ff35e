"""Datagrams in flight while the rover restarts: the new boot refuses them, which needs no warning."""

from __future__ import annotations

from collections import deque

from ground.link.news import EventHeard

_LATE_NS = 30_000_000_000  # onboard time in which datagrams for the old boot may still arrive


class Crossing:
    """Counter of sent datagrams that only one boot accepts, by time of sending. Times are the station's clock."""

    def __init__(self) -> None:
        self._said_ns: deque[int] = deque(maxlen=256)
        self._met = 0  # datagrams that may have reached the new boot

    def said(self, datagrams: int, now_ns: int) -> None:
        """Count datagrams sent now."""
        self._said_ns.extend([now_ns] * datagrams)

    def booted(self, since_ns: int) -> None:
        """The rover has rebooted; datagrams sent since `since_ns` may have reached the new boot."""
        self._met = sum(at_ns >= since_ns for at_ns in self._said_ns)
        self._said_ns.clear()

    def expected(self, event: EventHeard) -> EventHeard:
        """Make a LINK_REFUSED event "info" if the new boot refused no more than was in flight for the old one."""
        kind, _, count = event.text.partition(" ")
        if event.name != "LINK_REFUSED" or kind != "boot" or not count.isdecimal():
            return event
        if int(count) > self._met or event.onboard_ns > _LATE_NS:
            return event
        return event._replace(severity="info", text=f"{event.text}: on their way from here as it restarted")
