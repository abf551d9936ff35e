"""Signed MAVLink: what a frame must show before it changes anything here.

A frame ends in: link id u8, time u48 (10 us since 2015 in UTC, rising within a stream), the first 6 B of
SHA-256(key, all before). A stream is link id, system, component.

Rule 1: the signature is checked first, in constant time; until it is right nothing is remembered of the frame. (The
        check of pymavlink stores the time before it verifies: one forged frame locks the genuine sender out.)
Rule 2: the newest time of each stream outlives the program: `news` is to be kept before a frame is acted upon, so what
        was captured is refused after a restart too.
Rule 3: the first frame of a stream may be at most a minute old, and none may come from more than a minute ahead.
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
    """The signing time of a moment."""
    return max(0, utc_ns // 10_000 - EPOCH_S * STAMPS_PER_S)


class Verifier:
    """The receiving end of one key. kept: newest time of each stream, as `news` gave it before."""

    def __init__(self, key: bytes, kept: Mapping[str, int] | None = None) -> None:
        if len(key) != 32:
            raise ValueError("a signing key has 32 bytes")
        self._key = key
        self._newest = dict(kept or {})
        self._told = dict(self._newest)

    def check(self, frame: bytes, now: int) -> None:
        """Passes a genuine new frame. now: signing time here.

        Raises WireError of kind unsigned, signature, replay or clock; then nothing has changed.
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
        """What is to be kept before the frames are acted upon; None where nothing has changed since the last call."""
        if self._told == self._newest:
            return None
        self._told = dict(self._newest)
        return dict(self._newest)
