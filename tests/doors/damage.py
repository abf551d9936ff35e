"""Damage to bytes, from a seeded generator: flips, cuts, copies, and numbers that programs stumble over."""

from __future__ import annotations

import math
import struct

import numpy as np

_REALS = (math.nan, math.inf, -math.inf, 0.0, -0.0, 1e308, -1e308, 1e-308, 1e19, -1.0)
_WHOLES = (0, 1, 2**31 - 1, 2**31, 2**32 - 1, 2**62, 2**63, 2**64 - 1)
_PIECES = (
    *(struct.pack("<d", real) for real in _REALS), *(struct.pack("<f", real) for real in (math.nan, math.inf, -1.0)),
    *(struct.pack("<Q", whole) for whole in _WHOLES), *(struct.pack("<I", whole & 0xFFFFFFFF) for whole in _WHOLES),
    b"\xff\xff", b"\x00\x00", b"\xff", b"\x00", b"\x1b[2J", b"\x9b\n\r\x07", "\u202e".encode(), b"\xed\xa0\x80",
    b"{}", b"[[", b"null", b"NaN", b"../", b"",
)  # fmt: skip
HEAD_BYTES = 64
Rng = np.random.Generator


def damaged(data: bytes, rng: Rng) -> bytes:
    """The bytes with one to four pieces of damage, half of them within the head."""
    for _ in range(int(rng.integers(1, 5))):
        reach = len(data) if rng.random() < 0.5 else min(len(data), HEAD_BYTES)
        data = _once(data, int(rng.integers(0, reach + 1)), rng)
    return data


def _once(data: bytes, at: int, rng: Rng) -> bytes:
    match int(rng.integers(0, 6)):
        case 0:
            return data[:at] + bytes(byte ^ 1 << int(rng.integers(0, 8)) for byte in data[at : at + 1]) + data[at + 1 :]
        case 1:
            return data[:at]
        case 2:
            return data[:at] + data[at + int(rng.integers(1, 9)) :]
        case 3:
            return data[:at] + data[int(rng.integers(0, at + 1)) : at] + data[at:]
        case 4:
            return data[:at] + rng.bytes(int(rng.integers(1, 20))) + data[at:]
    piece = _PIECES[int(rng.integers(0, len(_PIECES)))]
    return data[:at] + piece + data[at + len(piece) :]


def whole(rng: Rng, shape: int | tuple[int, ...]) -> np.ndarray:
    """Integers of 64 bits of any size: small ones, large ones, the ends."""
    small = rng.integers(-1000, 1000, shape)
    large = rng.integers(-(2**63), 2**63 - 1, shape, np.int64, endpoint=True)
    return np.where(rng.random(shape) < rng.random(), small, large >> rng.integers(0, 63, shape))


def real(rng: Rng) -> float:
    """A number of any size, or none."""
    return float(rng.choice(_REALS)) if rng.random() < 0.3 else float(rng.normal() * 10.0 ** rng.integers(-3, 6))
