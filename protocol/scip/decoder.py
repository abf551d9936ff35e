"""Scans of one request, checked and decoded into memory that is kept: for the driver, which has one every 25 ms.

The layout of a scan of one echo is known from its request, so that head and blocks are checked where they must stand.
Where a check fails, the frame goes to `parse_scan`, which is slow and names the fault; so do scans of several echoes
and those with stamps of 11 characters.
"""

from __future__ import annotations

from collections.abc import Callable

from protocol.scip.block_reader import BlockReader, Reader
from protocol.scip.characters import checksum, decode_value
from protocol.scip.replies import ScanReply, parse_reply, parse_scan
from protocol.scip.requests import ScanRequest

_STAMP = 6  # 4 characters, sum, LF


class ScanDecoder:
    """Frames of the splitter in, scans out. A scan's values hold until the next one is decoded."""

    def __init__(
        self, asked: ScanRequest, string: bytes = b"", reader: Callable[[int, int, int], Reader] = BlockReader
    ) -> None:
        """string: what was sent after the `;` of the request, if anything. reader: makes what reads the blocks."""
        kind = asked.kind
        self.asked = asked
        self._string = string
        self._plain = kind.echoes == 1 and kind.stamp == 4
        self._head = asked.line()[: -2 if asked.streams else None]
        self._after = (b";" + string if string else b"") + (b"\n99b\n" if asked.streams else b"\n00P\n")
        self._after_at = len(asked.line())
        self._stamp_at = self._after_at + len(self._after)
        self._read = reader(self._stamp_at + _STAMP, asked.values, kind.characters)

    def decode(self, frame: memoryview | bytes) -> ScanReply:
        """The scan in a frame, all checked. Raises WireError as `parse_reply` and `parse_scan`."""
        head = bytes(frame[: self._stamp_at + _STAMP])
        remaining = self._remaining(head) if self._plain else -1
        if remaining < 0 or not self._read(frame):
            return parse_scan(parse_reply(bytes(frame)), self.asked, self._string)
        return ScanReply(remaining, decode_value(head[self._stamp_at : self._stamp_at + 4]), self._read.values)

    def _remaining(self, head: bytes) -> int:
        """The remaining count, if echo, status and the stamp's sum are right; else -1."""
        after, stamp = head[self._after_at : self._stamp_at], head[self._stamp_at :]
        if not head.startswith(self._head) or after != self._after or len(stamp) != _STAMP:
            return -1
        if stamp[4:] != checksum(stamp[:4]) + b"\n" or min(stamp[:4]) < 0x30 or max(stamp) > 0x6F:
            return -1
        digits = head[len(self._head) : self._after_at] or b"00"
        if digits != b"00" and not (self.asked.scans and digits.isdigit()):
            return -1
        remaining = int(digits)
        return remaining if remaining == 0 or remaining < self.asked.scans else -1
