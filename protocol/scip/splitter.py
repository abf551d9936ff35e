"""Splitter of a sensor's stream into frames at LF LF; pieces may have any size."""

from __future__ import annotations

import re
from collections.abc import Iterator

FRAME_LIMIT = 32_768  # the longest reply (NE, 1081 beams with 3 echoes) has 22,000 bytes
_FEEDS = re.compile(rb"\n*")
_SCAN = (b"\n99b\n", b"\n00P\n")  # the bytes after the echo of a scan


class Splitter:
    """Stream splitter: bytes in, whole frames out.

    A frame comes with the arrival time of its first byte, because the sensor pauses inside a frame. It is a view of the
    buffer, which never grows: no frame allocates memory.

    echo: if set, the first line of each scan of the running stream. Where it is found inside a frame whose end was
        lost, the frame is cut, so that one bad byte costs one scan.
    overflows: number of times that more than FRAME_LIMIT bytes without an end were dropped.
    """

    def __init__(self) -> None:
        self.echo = b""
        self.overflows = 0
        self._buffer = bytearray(2 * FRAME_LIMIT)
        self._view = memoryview(self._buffer)
        self.clear()

    def clear(self) -> None:
        """Drop a partial frame, because the port was reopened."""
        self._used = 0
        self._searched = 0
        self._headless = False  # True if the beginning of the buffer's frame was dropped
        self._marks: list[tuple[int, int]] = []  # (offset in the buffer, arrival) of each piece, rising

    def receive(self, rx_ns: int, data: bytes) -> list[tuple[int, bytes]]:
        """Return (arrival of the first byte, frame without its closing LF LF) for each frame that is complete now."""
        return [(first_ns, bytes(frame)) for first_ns, frame in self.frames(rx_ns, data)]

    def frames(self, rx_ns: int, data: bytes) -> Iterator[tuple[int, memoryview]]:
        """Like `receive`, one by one, without a copy: each view is valid until the next frame is requested.

        Run the iterator to its end. A change of `echo` applies from the next frame on.
        """
        pieces = memoryview(data)
        while pieces:
            size = min(len(pieces), len(self._buffer) - self._used)
            self._marks.append((self._used, rx_ns))
            self._view[self._used : self._used + size] = pieces[:size]
            self._used += size
            pieces = pieces[size:]
            start = 0
            while (end := self._buffer.find(b"\n\n", max(start, self._searched), self._used)) >= 0:
                for first, last in self._cut(start, end):
                    yield self._arrival(first), self._view[first:last]
                start = self._searched = self._after_feeds(end + 2)
                self._headless = False
            self._drop(start)
            if self._used == len(self._buffer):
                self.overflows += 1
                self._drop(self._used - FRAME_LIMIT)
                self._headless = True
            self._searched = max(0, self._used - 1)

    def _after_feeds(self, start: int) -> int:
        """Return the end of the empty frames from `start` on, in one step: a million line feeds cost no loop."""
        if start == self._used or self._buffer[start] != 0x0A:  # the usual case
            return start
        feeds = _FEEDS.match(self._buffer, start, self._used)
        return feeds.end() if feeds else start

    def _cut(self, start: int, end: int) -> list[tuple[int, int]]:
        """Return (start, end) of the frame; two spans if a scan begins inside: what precedes it and the scan."""
        while start < end and self._buffer[start] == 0x0A:
            start += 1
        if start == end:
            return []
        inner = self._scan_in(start + 1, end) if self.echo else -1
        if inner < 0:
            return [] if self._headless else [(start, end)]
        return [(inner, end)] if self._headless else [(start, inner), (inner, end)]

    def _scan_in(self, start: int, end: int) -> int:
        """Return the start of the last scan whose echo lies between start and end; -1 if there is none."""
        at = self._buffer.rfind(self.echo, start, end)
        while at >= 0 and not self._buffer.startswith(_SCAN, self._buffer.find(b"\n", at, end), end):
            at = self._buffer.rfind(self.echo, start, at + len(self.echo) - 1)
        return at

    def _arrival(self, offset: int) -> int:
        """Return the arrival time of the piece with the byte at `offset`: mostly the last; one of them begins at 0."""
        index = len(self._marks) - 1
        while self._marks[index][0] > offset:
            index -= 1
        return self._marks[index][1]

    def _drop(self, size: int) -> None:
        if not size:
            return
        left = self._used - size
        if not left:  # the usual case: the last piece ended with the end of a frame
            self._used = 0
            self._marks.clear()
            return
        self._view[:left] = self._view[size : self._used]
        self._used = left
        kept = [(max(0, at - size), rx_ns) for at, rx_ns in self._marks]
        while len(kept) > 1 and kept[1][0] == 0:
            kept.pop(0)
        self._marks = kept
