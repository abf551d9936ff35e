"""Data blocks: 64 characters, a sum, an LF; the last block holds the rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from protocol import WireError
from protocol.scip.characters import checksum

BLOCK = 64
_LINE_FEED = np.uint8(0x0A - 0x30 & 0xFF)


def sixes_of(values: NDArray[np.int32], characters: int) -> NDArray[np.uint8]:
    """Split values of any shape, row by row, into characters less 0x30."""
    shifts = np.arange(6 * (characters - 1), -1, -6, dtype=np.int32)
    return ((values.reshape(-1, 1) >> shifts) & 0x3F).astype(np.uint8).ravel()


def values_of(sixes: NDArray[np.uint8], count: int, characters: int) -> NDArray[np.int32]:
    """Join `count * characters` characters less 0x30 into values."""
    wide = sixes.astype(np.int32).reshape(count, characters)
    value = wide[:, 0]
    for k in range(1, characters):
        value = value << 6 | wide[:, k]
    return value


def cut(sixes: NDArray[np.uint8]) -> bytes:
    """Format characters less 0x30 as blocks with sums and LFs."""
    whole = len(sixes) // BLOCK
    lines = np.empty((whole, BLOCK + 2), np.uint8)
    lines[:, :BLOCK] = sixes[: whole * BLOCK].reshape(whole, BLOCK)
    lines[:, BLOCK] = lines[:, :BLOCK].sum(axis=1, dtype=np.uint8) & 0x3F  # 64 * 0x30 adds nothing to the low 6 bits
    lines[:, : BLOCK + 1] += 0x30
    lines[:, BLOCK + 1] = 0x0A
    rest = (sixes[whole * BLOCK :] + np.uint8(0x30)).tobytes()
    return lines.tobytes() + (rest + checksum(rest) + b"\n" if rest else b"")


def join(body: bytes) -> NDArray[np.uint8]:
    """Return the characters less 0x30 of blocks whose last LF is missing (the splitter removed it).

    Raises WireError: "length" (LF not where it belongs, an empty last block), "block_sum".
    """
    whole, rest = divmod(len(body) + 1, BLOCK + 2)
    sixes = np.frombuffer(body + b"\n", np.uint8) - np.uint8(0x30)
    lines = sixes[: whole * (BLOCK + 2)].reshape(whole, BLOCK + 2)
    tail = sixes[whole * (BLOCK + 2) :]
    if (lines[:, -1] != _LINE_FEED).any() or (rest and (rest < 3 or tail[-1] != _LINE_FEED)):
        raise WireError("length", "a block does not end where it should")
    if (lines[:, :BLOCK].sum(axis=1, dtype=np.uint8) & 0x3F != lines[:, BLOCK]).any():
        raise WireError("block_sum")
    if rest and int(tail[:-2].sum(dtype=np.uint8)) + 0x30 * (rest - 2) & 0x3F != tail[-2]:
        raise WireError("block_sum")
    return np.concatenate((lines[:, :BLOCK].ravel(), tail[:-2]))


def encode_blocks(values: NDArray[np.int32], characters: int) -> bytes:
    """Encode values (any shape, row by row) as data blocks with sums and LFs."""
    return cut(sixes_of(values, characters))


def decode_blocks(body: bytes, count: int, characters: int) -> NDArray[np.int32]:
    """Decode `count` values from data blocks whose last LF is missing.

    Raises WireError: "length" (blocks too short or long, LF not where it belongs), "character", "block_sum".
    """
    whole, rest = divmod(count * characters, BLOCK)
    size = whole * (BLOCK + 2) + (rest + 2 if rest else 0)
    if len(body) + 1 != size:
        raise WireError("length", f"{len(body) + 1} bytes of data blocks where {size} belong")
    sixes = join(body)
    if sixes.max(initial=0) > 0x3F:
        raise WireError("character", "a data byte outside 0x30 to 0x6F")
    return values_of(sixes, count, characters)
