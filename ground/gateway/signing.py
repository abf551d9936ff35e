"""Signed MAVLink: verification of frames before they change anything here.

A frame ends in: link id u8, time u48 (10 us since 2015 in UTC, rising within a stream), the first 6 B of
SHA-256(key, all before). A stream is link id, system, component.

Rule 1: The signature is checked first, in constant time; until it is right nothing of the frame is stored. (The check
        of pymavlink stores the time before it verifies: one forged frame locks the genuine sender out.)
Rule 2: The newest time of each stream outlives the program: the caller stores `news` before it acts on a frame, so
        captured frames are refused after a restart too.
Rule 3: The first frame of a stream may be at most a minute old, and no frame may be more than a minute ahead.
"""

from __future__ import annotations

import hashlib
import hmac
from collections.abc import Mapping

from ground.gateway.frames import SIGNATURE_BYTES, signed
from protocol import WireError

STAMPS_PER_S = 100_000
EPOCH_S = 1_420_070_400  # 2015-01-01 in UTC
_MINUTE = 60 * STAMPS_PER_S
_MOST_STREAMS = 256
_SIGNATURE = 6


def stamp_of(utc_ns: int) -> int:
    """Return the signing time of a UTC time in ns."""
    return max(0, utc_ns // 10_000 - EPOCH_S * STAMPS_PER_S)


class Verifier:
    """Receiving end of one signing key. kept: newest time of each stream, from an earlier `news`."""

    def __init__(self, key: bytes, kept: Mapping[str, int] | None = None) -> None:
        if len(key) != 32:
            raise ValueError("a signing key has 32 bytes")
        self._key = key
        self._newest = dict(kept or {})
        self._told = dict(self._newest)

    def check(self, frame: bytes, now: int) -> None:
        """Check that a frame is genuine and new. now: signing time here.

        Raises WireError of kind unsigned, signature, replay, clock or streams; then nothing has changed.
        """
        if not signed(frame):
            raise WireError("unsigned")
        right = hashlib.sha256(self._key + frame[:-_SIGNATURE]).digest()[:_SIGNATURE]
        if not hmac.compare_digest(right, frame[-_SIGNATURE:]):
            raise WireError("signature")
        block = frame[-SIGNATURE_BYTES:]
        stamp = int.from_bytes(block[1:7], "little")
        stream = f"{block[0]}/{frame[5]}/{frame[6]}"
        if stamp > now + _MINUTE:
            raise WireError("clock", f"{(stamp - now) / STAMPS_PER_S:.0f} s ahead")
        newest = self._newest.get(stream)
        if newest is None and stamp < now - _MINUTE:
            raise WireError("clock", f"{(now - stamp) / STAMPS_PER_S:.0f} s old")
        if newest is not None and stamp <= newest:
            raise WireError("replay")
        if newest is None and len(self._newest) >= _MOST_STREAMS:
            raise WireError("streams", f"more than {_MOST_STREAMS}")
        self._newest[stream] = stamp

    def news(self) -> dict[str, int] | None:
        """Return the times to store before acting on the frames; None if nothing has changed since the last call."""
        if self._told == self._newest:
            return None
        self._told = dict(self._newest)
        return dict(self._newest)
