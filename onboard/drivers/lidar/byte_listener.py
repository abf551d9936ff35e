"""Byte listener of the scanner: reads and stamps bytes between two ticks, as they arrive.

A scan's beams are timed by the arrival of its first byte: a stamp of the next tick would be up to 10 ms late. After
MOST_PIECES pieces from a sensor that sends byte by byte, or without pause, listening stops: the tick reads the rest.
"""

from __future__ import annotations

from collections.abc import Callable

from onboard.drivers.lidar.port import LidarPort
from onboard.drivers.platform.clock import wait_for
from onboard.records import Chunk, PortState

MOST_PIECES = 64  # between two ticks


class LidarEar:
    """Listener; call `listen` in the time between ticks, `take` in the tick. now_ns: onboard time.

    alarm: descriptor that also ends the wait; -1: none.
    """

    def __init__(self, port: LidarPort, now_ns: Callable[[], int]) -> None:
        self.port = port
        self._now_ns = now_ns
        self.alarm = -1
        self._heard: list[Chunk] = []

    def listen(self, limit_s: float) -> None:
        """Wait for the next bytes, at most `limit_s`, and store them."""
        hears = self.port.state is PortState.OPEN and len(self._heard) < MOST_PIECES
        if wait_for(self.port.fileno() if hears else -1, limit_s, self.alarm):
            self._heard += self.port.read(self._now_ns())

    def take(self) -> tuple[Chunk, ...]:
        """Return all bytes received since the last call, in order."""
        heard, self._heard = self._heard, []
        return (*heard, *self.port.read(self._now_ns()))
