"""Scans of one request, checked and decoded into memory that is kept: for the driver, which has one every 25 ms.

The layout of a scan of one echo is known from its request, so that all checks and values are a few steps over arrays.
Where one does not hold, the frame goes to `parse_scan`, which is slow and names the fault; so do scans of several
echoes and those with stamps of 11 characters.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from protocol.scip.blocks import BLOCK
from protocol.scip.characters import checksum, decode_value
from protocol.scip.replies import ScanReply, parse_reply, parse_scan
from protocol.scip.requests import ScanRequest

_STAMP = 6  # 4 characters, sum, LF


class ScanDecoder:
    """Frames of the splitter in, scans out. A scan's values hold until the next one is decoded."""

    def __init__(self, asked: ScanRequest, string: bytes = b"") -> None:
        """string: what was sent after the `;` of the request, if anything."""
        kind = asked.kind
        self.asked = asked
        self._string = string
        self._plain = kind.echoes == 1 and kind.stamp == 4
        tail = b";" + string if string else b""
        self._head = asked.line()[: -2 if asked.streams else None]
        self._after = tail + (b"\n99b\n" if asked.streams else b"\n00P\n")
        self._stamp_at = len(asked.line()) + len(self._after)
        self._data_at = self._stamp_at + _STAMP
        characters = asked.values * kind.characters
        self._whole, self._rest = (characters - 1) // BLOCK, (characters - 1) % BLOCK + 1  # of the last block: 1 to 64
        self._size = self._data_at + self._whole * (BLOCK + 2) + self._rest + 1
        self._sums = np.empty(self._whole, np.uint8)
        self._sixes = np.empty(characters, np.uint8)
        self._wide = np.empty((asked.values, kind.characters), np.float32)
        self._weights = 64.0 ** np.arange(kind.characters - 1, -1, -1, dtype=np.float32)
        self._exact = np.empty(asked.values, np.float32)
        self._values = np.empty(asked.values, np.int64)

    def decode(self, frame: memoryview | bytes) -> ScanReply:
        """The scan in a frame, all checked. Raises WireError as `parse_reply` and `parse_scan`."""
        remaining = self._echoed(frame) if self._plain and len(frame) == self._size else -1
        if remaining < 0 or not self._summed(np.frombuffer(frame, np.uint8)):
            return parse_scan(parse_reply(bytes(frame)), self.asked, self._string)
        return ScanReply(remaining, decode_value(bytes(frame[self._stamp_at : self._stamp_at + 4])), self._values)

    def _echoed(self, frame: memoryview | bytes) -> int:
        """The remaining count, if echo, status and the stamp's sum are right; else -1."""
        head, stamp_at = len(self._head), self._stamp_at
        digits = bytes(frame[head : stamp_at - len(self._after)])
        stamp = bytes(frame[stamp_at : stamp_at + _STAMP])
        right = (
            frame[:head] == self._head and frame[stamp_at - len(self._after) : stamp_at] == self._after
            and stamp[4:] == checksum(stamp[:4]) + b"\n" and min(stamp) >= 0x0A and _in_range(stamp[:4])
            and (digits in (b"", b"00") or (self.asked.scans > 0 and digits.isdigit()))
        )  # fmt: skip
        remaining = int(digits or b"0") if right else -1
        return remaining if remaining == 0 or remaining < self.asked.scans else -1

    def _summed(self, raw: NDArray[np.uint8]) -> bool:
        """Whether blocks, sums and characters are right; then `_values` holds the values."""
        last, split = self._data_at + self._whole * (BLOCK + 2), self._whole * BLOCK
        lines = raw[self._data_at : last].reshape(self._whole, BLOCK + 2)
        np.add.reduce(lines[:, :BLOCK], axis=1, dtype=np.uint8, out=self._sums)
        self._sums &= 0x3F  # 64 * 0x30 adds nothing to the low 6 bits
        self._sums += 0x30
        rest = int(np.add.reduce(raw[last:-1], dtype=np.uint8)) & 0x3F
        if rest + 0x30 != raw[-1] or (self._sums != lines[:, BLOCK]).any() or (lines[:, BLOCK + 1] != 0x0A).any():
            return False
        self._sixes[:split].reshape(self._whole, BLOCK)[:] = lines[:, :BLOCK]
        self._sixes[split:] = raw[last:-1]
        self._sixes -= 0x30
        if self._sixes.max() > 0x3F:
            return False
        self._wide[:] = self._sixes.reshape(self._wide.shape)
        np.dot(self._wide, self._weights, out=self._exact)  # 18 bits are exact in float32
        self._values[:] = self._exact
        return True


def _in_range(text: bytes) -> bool:
    return min(text) >= 0x30 and max(text) <= 0x6F
