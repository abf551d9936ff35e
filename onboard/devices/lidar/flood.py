"""Flood detector of the scanner: more bytes or frames than any scanner sends, judged by leaky buckets.

    bytes    leak 1,200,000/s, size 120,000     the most a scanner sends: 22,000 bytes 40 times a second
    frames   leak 400/s, size 100               40 scans a second and some replies

During a flood no data of the scanner is used, so it costs no time of the tick. It ends when both buckets are empty.
"""

from __future__ import annotations

from onboard.devices.can_watch import Bucket

BYTES_LEAK_HZ, BYTES_SIZE = 1_200_000.0, 120_000
FRAMES_LEAK_HZ, FRAMES_SIZE = 400.0, 100
MOST_FRAMES = 64  # per tick


class FloodWatch:
    """Flood detector; call `bytes_came` before the bytes of a tick are used, `frames_came` after. flooded: result."""

    def __init__(self) -> None:
        self.flooded = False
        self.dropped_bytes = 0  # since the start
        self._bytes, self._frames = Bucket(BYTES_LEAK_HZ, BYTES_SIZE), Bucket(FRAMES_LEAK_HZ, FRAMES_SIZE)

    def bytes_came(self, count: int, now_ns: int) -> bool:
        """Count bytes; return whether to drop them."""
        many, crowded = self._bytes.add(count, now_ns), self._frames.add(0, now_ns)
        self.flooded = many or crowded
        self.dropped_bytes += count if self.flooded else 0
        return self.flooded

    def frames_came(self, count: int, dropped_bytes: int, now_ns: int) -> None:
        """Count the frames that were used, and the bytes behind the last of them that were dropped."""
        self.flooded = self._frames.add(count, now_ns)
        self.dropped_bytes += dropped_bytes

    @property
    def words(self) -> str:
        """Text for people."""
        return f"it floods: {self.dropped_bytes} bytes dropped since the start"
