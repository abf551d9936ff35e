"""Damage to bytes, from a seeded generator: flips, cuts, copies, and numbers that often cause errors."""

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
_WORDS = (
    b"[" * 3000, b"{a=" * 2000, b"nan", b"inf", b"-1", b"9" * 5000, b"0x" + b"f" * 9000, b"1e999", b"../../x", b"/etc",
    b"{goal_x}", b"{x}", b"{", b"''", b'"""', b"a." * 2000, b"true", b"1979-05-27", b"[[faults]]", b"[set]", b"=",
    b"\x93NUMPY\x01\x00", b"(999999, 999999)", b"'|O'", b"'<f8'", b"PK\x01\x02", b"PK\x05\x06", b"< frame ", b"\n\n",
)  # fmt: skip
HEAD_BYTES = 64
Rng = np.random.Generator


def damaged(data: bytes, rng: Rng) -> bytes:
    """Return the bytes with one to four pieces of damage, half of them within the head."""
    for _ in range(int(rng.integers(1, 5))):
        reach = len(data) if rng.random() < 0.5 else min(len(data), HEAD_BYTES)
        data = _once(data, int(rng.integers(0, reach + 1)), rng)
    return data


def _once(data: bytes, at: int, rng: Rng) -> bytes:
    before, after, piece = data[:at], data[at:], b""
    match int(rng.integers(0, 7)):
        case 0:
            piece, after = bytes(byte ^ 1 << int(rng.integers(0, 8)) for byte in after[:1]), after[1:]
        case 1:
            after = b""
        case 2:
            after = after[int(rng.integers(1, 9)) :]
        case 3:
            piece = before[int(rng.integers(0, at + 1)) :]
        case 4:
            piece = rng.bytes(int(rng.integers(1, 20)))
        case 5:
            piece, after = _WORDS[int(rng.integers(0, len(_WORDS)))], after[int(rng.integers(0, 11)) :]
        case _:
            piece = _PIECES[int(rng.integers(0, len(_PIECES)))]
            after = after[len(piece) :]
    return before + piece + after


def whole(rng: Rng, shape: int | tuple[int, ...]) -> np.ndarray:
    """Return 64-bit integers of any size: small ones, large ones, the limits."""
    small = rng.integers(-1000, 1000, shape)
    large = rng.integers(-(2**63), 2**63 - 1, shape, np.int64, endpoint=True)
    return np.where(rng.random(shape) < rng.random(), small, large >> rng.integers(0, 63, shape))


def real(rng: Rng) -> float:
    """Return a number of any size, or a non-finite one."""
    return float(rng.choice(_REALS)) if rng.random() < 0.3 else float(rng.normal() * 10.0 ** rng.integers(-3, 6))
