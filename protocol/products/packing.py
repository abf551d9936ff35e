"""Shared helpers of product codecs: zstandard with a known size, integers as byte planes."""

from __future__ import annotations

import numpy as np
import zstandard
from numpy.typing import NDArray

from protocol import WireError

LEVEL = 19
MOST_PLANES = 8

U8 = NDArray[np.uint8]
I64 = NDArray[np.int64]


def check(sound: bool, what: str) -> None:
    """Raise WireError("product") with the text `what` unless `sound`."""
    if not sound:
        raise WireError("product", what)


def within(most: float, *values: float) -> bool:
    """True if all values are numbers of at most this magnitude."""
    return all(abs(value) <= most for value in values)  # false for a NaN


def compress(data: bytes) -> bytes:
    """Compress into one zstandard frame that contains its content's size."""
    return zstandard.ZstdCompressor(level=LEVEL, write_content_size=True).compress(data)


def expand(data: bytes, size: int) -> U8:
    """Decompress content of `size` B. Raises WireError("product") before anything larger is allocated."""
    try:
        named = zstandard.frame_content_size(data)
        if named != size:
            raise WireError("product", f"a part of {named} B instead of {size}")
        raw = np.frombuffer(zstandard.ZstdDecompressor().decompress(data, max_output_size=size), np.uint8)
    except zstandard.ZstdError as error:
        raise WireError("product", str(error)) from error
    if len(raw) != size:
        raise WireError("product", f"{len(raw)} B instead of {size}")
    return raw


def fold(values: I64) -> I64:
    """Map signed integers to unsigned ones: 0, -1, 1, -2 ... become 0, 1, 2, 3 ..."""
    return np.where(values < 0, -2 * values - 1, 2 * values)


def unfold(values: I64) -> I64:
    """The inverse of `fold`."""
    return np.where(values & 1, -(values + 1) // 2, values // 2)


def planes_of(folded: I64) -> int:
    """Number of byte planes for these numbers, at least 1."""
    return max(1, (int(folded.max(initial=0)).bit_length() + 7) // 8)


def to_planes(folded: I64, planes: int) -> bytes:
    """Store the lowest bytes of all numbers, then the next bytes, and so on: similar bytes are adjacent."""
    return b"".join(((folded >> 8 * n) & 0xFF).astype(np.uint8).tobytes() for n in range(planes))


def from_planes(raw: U8, planes: int) -> I64:
    """The inverse of `to_planes`, flat."""
    folded = np.zeros(len(raw) // planes, np.int64)
    for n, plane in enumerate(raw.reshape(planes, -1)):
        folded |= plane.astype(np.int64) << 8 * n
    return folded


def pack_integers(values: I64) -> bytes:
    """Pack signed integers: count of planes u8, then the planes, compressed."""
    folded = fold(values.reshape(-1))
    planes = planes_of(folded)
    return bytes([planes]) + compress(to_planes(folded, planes))


def unpack_integers(data: bytes, count: int) -> I64:
    """The inverse of `pack_integers` for `count` integers, flat. Raises WireError("product")."""
    if not data or not 1 <= data[0] <= MOST_PLANES:
        raise WireError("product", "integers without a count of planes")
    return unfold(from_planes(expand(data[1:], data[0] * count), data[0]))
