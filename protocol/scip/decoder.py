"""Decoder of the scans of one request into preallocated memory, for the driver, which gets a scan every 25 ms.

The request determines the layout of a scan of one echo, so head and blocks are checked at fixed offsets. A frame that
fails a check goes to `parse_scan`, which is slow and reports the error; so do scans of several echoes and those with
stamps of 11 characters.
"""

from __future__ import annotations

from collections.abc import Callable

from protocol.scip.block_reader import BlockReader, Reader
from protocol.scip.characters import checksum, decode_value
from protocol.scip.replies import ScanReply, parse_reply, parse_scan
from protocol.scip.requests import ScanRequest

_STAMP = 6  # 4 characters, sum, LF


class ScanDecoder:
    """Scan decoder: frames of the splitter in, scans out. A scan's values are valid until the next scan is decoded."""

    def __init__(
        self, asked: ScanRequest, string: bytes = b"", reader: Callable[[int, int, int], Reader] = BlockReader
    ) -> None:
        """string: text sent after the `;` of the request, if any. reader: factory of the block reader."""
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
        """Decode and check the scan in a frame. Raises WireError as `parse_reply` and `parse_scan`."""
        head = bytes(frame[: self._stamp_at + _STAMP])
        remaining = self._remaining(head) if self._plain else -1
        if remaining < 0 or not self._read(frame):
            return parse_scan(parse_reply(bytes(frame)), self.asked, self._string)
        return ScanReply(remaining, decode_value(head[self._stamp_at : self._stamp_at + 4]), self._read.values)

    def _remaining(self, head: bytes) -> int:
        """Return the remaining count if echo, status and the stamp's sum are right; else -1."""
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
