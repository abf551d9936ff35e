"""Values as data blocks: 64 characters, a sum, an LF; the last block holds what is left."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from protocol import WireError
from protocol.scip.characters import checksum

BLOCK = 64


def encode_blocks(values: NDArray[np.int32], characters: int) -> bytes:
    """Values (any shape, row by row) as data blocks with sums and LFs."""
    shifts = np.arange(6 * (characters - 1), -1, -6, dtype=np.int32)
    sixes = ((values.reshape(-1, 1) >> shifts) & 0x3F).astype(np.uint8).ravel()
    whole = len(sixes) // BLOCK
    lines = np.empty((whole, BLOCK + 2), np.uint8)
    lines[:, :BLOCK] = sixes[: whole * BLOCK].reshape(whole, BLOCK)
    lines[:, BLOCK] = lines[:, :BLOCK].sum(axis=1, dtype=np.uint8) & 0x3F
    lines[:, : BLOCK + 1] += 0x30
    lines[:, BLOCK + 1] = 0x0A
    rest = (sixes[whole * BLOCK :] + 0x30).tobytes()
    return lines.tobytes() + (rest + checksum(rest) + b"\n" if rest else b"")


def decode_blocks(body: bytes, count: int, characters: int) -> NDArray[np.int32]:
    """`count` values from data blocks whose last LF is missing (the splitter took it).

    Raises WireError: "length" (blocks too short or long, LF not where it belongs), "character", "block_sum".
    """
    whole, rest = divmod(count * characters, BLOCK)
    size = whole * (BLOCK + 2) + (rest + 2 if rest else 0)
    if len(body) + 1 != size:
        raise WireError("length", f"{len(body) + 1} bytes of data blocks where {size} belong")
    sixes = np.frombuffer(body + b"\n", np.uint8) - np.uint8(0x30)
    lines = sixes[: whole * (BLOCK + 2)].reshape(whole, BLOCK + 2)
    tail = sixes[whole * (BLOCK + 2) :]
    line_feed = np.uint8(0x0A - 0x30 & 0xFF)
    if (lines[:, -1] != line_feed).any() or (rest and tail[-1] != line_feed):
        raise WireError("length", "a block does not end where it should")
    payload = np.concatenate((lines[:, :BLOCK].ravel(), tail[:-2]))
    if payload.max(initial=0) > 0x3F:
        raise WireError("character", "a data byte outside 0x30 to 0x6F")
    sums = lines[:, :BLOCK].sum(axis=1, dtype=np.uint8) & 0x3F  # 64 * 0x30 adds nothing to the low 6 bits
    if (sums != lines[:, BLOCK]).any():
        raise WireError("block_sum")
    if rest and (int(tail[:-2].sum()) + 0x30 * rest) & 0x3F != tail[-2]:
        raise WireError("block_sum")
    wide = payload.astype(np.int32).reshape(count, characters)
    value = wide[:, 0]
    for k in range(1, characters):
        value = value << 6 | wide[:, k]
    return value
