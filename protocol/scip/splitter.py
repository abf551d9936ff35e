"""The stream of a sensor, cut into frames at LF LF."""

from __future__ import annotations

FRAME_LIMIT = 16_384  # the longest reply of a UTM-30LX (ME, 1081 beams) has 6,717 bytes


class Splitter:
    """Bytes of the stream in, whole frames out, however they were cut on the way.

    A frame comes with the arrival time of its first byte: the sensor pauses inside a frame, its last byte says little.
    `echo`, if set, begins the frames of a running stream: where it stands inside a frame whose end was lost, the frame
    is cut there, so that one bad byte costs one scan. `overflows` counts what grew beyond FRAME_LIMIT and was dropped.
    """

    def __init__(self) -> None:
        self.echo = b""
        self.overflows = 0
        self._buffer = bytearray()
        self._marks: list[tuple[int, int]] = []  # (offset in the buffer, arrival) of each piece, rising
        self._searched = 0

    def clear(self) -> None:
        """Forget a half frame (the port was reopened)."""
        self._buffer.clear()
        self._marks.clear()
        self._searched = 0

    def receive(self, rx_ns: int, data: bytes) -> list[tuple[int, bytes]]:
        """(arrival of the first byte, frame without its closing LF LF) for each frame that is complete now."""
        if not data:
            return []
        self._marks.append((len(self._buffer), rx_ns))
        self._buffer += data
        frames: list[tuple[int, bytes]] = []
        start = 0
        while (end := self._buffer.find(b"\n\n", max(start, self._searched))) >= 0:
            self._cut(start, end, frames)
            start = end + 2
            self._searched = start
        self._drop(start)
        if len(self._buffer) > FRAME_LIMIT:
            self.overflows += 1
            self.clear()
        self._searched = max(0, len(self._buffer) - 1)
        return frames

    def _cut(self, start: int, end: int, frames: list[tuple[int, bytes]]) -> None:
        while start < end and self._buffer[start] == 0x0A:
            start += 1
        if start == end:
            return
        inner = self._buffer.rfind(self.echo, start + 1, end) if self.echo else -1
        for first, last in ((start, end),) if inner < 0 else ((start, inner), (inner, end)):
            frames.append((self._arrival(first), bytes(self._buffer[first:last])))

    def _arrival(self, offset: int) -> int:
        return next(rx_ns for at, rx_ns in reversed(self._marks) if at <= offset)

    def _drop(self, size: int) -> None:
        if not size:
            return
        del self._buffer[:size]
        kept = [(max(0, at - size), rx_ns) for at, rx_ns in self._marks]
        while len(kept) > 1 and kept[1][0] == 0:
            kept.pop(0)
        self._marks = kept if self._buffer else []
