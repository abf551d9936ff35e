"""Repair symbols of bulk objects: XORs of chunks that restore lost chunks.

    chunks   a  b  c  d  e        symbol 7 = a^c^d      symbol 8 = b^e^...      each over `span` chunks from `base` on
    there    a  .  c  .  e        7: d = 7^a^c          8: b = ...              two losses, any two symbols that differ

Object, serial, base and span determine the chunks of a symbol, so nothing else is sent: the bits of a hash select half
of the chunks. Of m lost chunks, m + 2 such symbols restore all in three of four cases. A chunk that is shorter than the
others counts as padded with zeros. Chunks are Python integers here: a thousand bytes are XORed in 0.1 us.
"""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Callable, Mapping
from typing import NamedTuple

from protocol import WireError

MAX_SPAN = 255
_HEAD = struct.Struct("<HB")
HEAD_BYTES = _HEAD.size


def members(object_id: int, serial: int, base: int, span: int) -> int:
    """Chunks of a symbol as a bit mask: bit n is chunk base + n. Never 0."""
    digest = hashlib.sha256(struct.pack("<IIHB", object_id, serial, base, span)).digest()
    every = (1 << span) - 1
    return int.from_bytes(digest, "little") & every or every


class Symbol(NamedTuple):
    """One repair symbol as sent over the link.

    base: index of the first chunk of its span.
    span: number of chunks in the span.
    data: XOR of the selected chunks.
    """

    base: int
    span: int
    data: bytes


def encode(object_id: int, serial: int, base: int, span: int, chunk: Callable[[int], bytes], size: int) -> bytes:
    """Encode a symbol's body: head and `size` bytes of data. chunk(index) returns a chunk."""
    mask, total = members(object_id, serial, base, span), 0
    for n in range(span):
        if mask >> n & 1:
            total ^= int.from_bytes(chunk(base + n), "little")
    return _HEAD.pack(base, span) + total.to_bytes(size, "little")


def decode(body: bytes) -> Symbol:
    """Decode a symbol's body. Raises WireError("chunk") if it is not a symbol."""
    if len(body) <= _HEAD.size or not body[2]:
        raise WireError("chunk", f"repair symbol of {len(body)} B")
    base, span = _HEAD.unpack_from(body)
    return Symbol(base, span, body[_HEAD.size :])


class Solver:
    """Incremental solver over GF(2): symbols and chunks in, restored chunks out."""

    def __init__(self) -> None:
        self._rows: dict[int, tuple[int, int]] = {}  # highest bit -> chunks (bit n is chunk n), their XOR
        self._size = 0

    def __len__(self) -> int:
        return len(self._rows)

    def add(self, mask: int, symbol: Symbol, known: Mapping[int, bytes]) -> dict[int, bytes]:
        """Add a symbol; return the chunks that it restores, by index. mask: result of `members`."""
        self._size = len(symbol.data)
        total, bits = int.from_bytes(symbol.data, "little"), 0
        for n in range(symbol.span):
            if mask >> n & 1:
                found = known.get(symbol.base + n)
                if found is None:
                    bits |= 1 << symbol.base + n
                else:
                    total ^= int.from_bytes(found, "little")
        self._insert(bits, total)
        return self._solved()

    def learn(self, index: int, chunk: bytes) -> dict[int, bytes]:
        """Add a received chunk; return the further chunks that it restores, by index."""
        bit, value = 1 << index, int.from_bytes(chunk, "little")
        for pivot in [p for p, (bits, _) in self._rows.items() if bits & bit]:
            bits, total = self._rows.pop(pivot)
            self._insert(bits ^ bit, total ^ value)
        return self._solved()

    def _insert(self, bits: int, total: int) -> None:
        """Insert an equation, fully reduced: the highest bit of each row is in no other row."""
        for pivot, (others, value) in self._rows.items():
            if bits >> pivot & 1:
                bits, total = bits ^ others, total ^ value
        if not bits:
            return
        pivot = bits.bit_length() - 1
        for other, (others, value) in self._rows.items():
            if others >> pivot & 1:
                self._rows[other] = (others ^ bits, value ^ total)
        self._rows[pivot] = (bits, total)

    def _solved(self) -> dict[int, bytes]:
        found = {p: total for p, (bits, total) in self._rows.items() if bits == 1 << p}
        for pivot in found:
            del self._rows[pivot]
        return {index: total.to_bytes(self._size, "little") for index, total in found.items()}
