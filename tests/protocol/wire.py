"""Ways to hand a wire format to its reader: whole, byte by byte, in ragged pieces, with noise around it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np


def whole(data: bytes) -> list[bytes]:
    """All in one piece."""
    return [data]


def bytewise(data: bytes) -> list[bytes]:
    """One byte at a time."""
    return [data[k : k + 1] for k in range(len(data))]


def ragged(data: bytes, seed: int = 0, longest: int = 700) -> Iterator[bytes]:
    """Pieces of random length."""
    rng, at = np.random.default_rng(seed), 0
    while at < len(data):
        size = int(rng.integers(1, longest))
        yield data[at : at + size]
        at += size


def with_noise(frames: list[bytes], seed: int = 0, longest: int = 40) -> bytes:
    """The frames with random bytes (no line feed among them) and a closing LF LF between them."""
    rng, out = np.random.default_rng(seed), bytearray()
    for frame in frames:
        junk = rng.integers(0, 256, int(rng.integers(1, longest)), dtype=np.uint8).tobytes().replace(b"\n", b"?")
        out += junk + b"\n\n" + frame
    return bytes(out)


def flipped(data: bytes, at: int, mask: int = 0x01) -> bytes:
    """The data with one byte changed."""
    return data[:at] + bytes((data[at] ^ mask,)) + data[at + 1 :]
