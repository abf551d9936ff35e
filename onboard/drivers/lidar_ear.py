"""What the scanner sends between two ticks, read and stamped as it comes.

A scan's beams are timed by the arrival of its first byte: a stamp of the next tick would be up to 10 ms late. A sensor
that sends byte by byte, or without pause, is not listened to any longer after MOST_PIECES: the rest comes with the
tick.
"""

from __future__ import annotations

from collections.abc import Callable

from onboard.drivers.clock import wait_for
from onboard.drivers.lidar_port import LidarPort
from onboard.records import Chunk, PortState

MOST_PIECES = 64  # between two ticks


class LidarEar:
    """`listen` fills the time between ticks, `take` gives a tick what came. now_ns: onboard time.

    alarm: descriptor that ends the wait as well, -1: none.
    """

    def __init__(self, port: LidarPort, now_ns: Callable[[], int]) -> None:
        self.port = port
        self._now_ns = now_ns
        self.alarm = -1
        self._heard: list[Chunk] = []

    def listen(self, limit_s: float) -> None:
        """Wait for the next bytes, at most `limit_s`, and keep them."""
        hears = self.port.state is PortState.OPEN and len(self._heard) < MOST_PIECES
        if wait_for(self.port.fileno() if hears else -1, limit_s, self.alarm):
            self._heard += self.port.read(self._now_ns())

    def take(self) -> tuple[Chunk, ...]:
        """All that came since the last call, in order."""
        heard, self._heard = self._heard, []
        return (*heard, *self.port.read(self._now_ns()))
