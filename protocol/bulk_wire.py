"""The layouts of `bulk`, little-endian.

A chunk's payload: object u32, serial u32, index u16, data. Index 0xFFFF is the announcement, 0xFFFE a repair symbol:
base u16, span u8, data.
A bitmap's payload: object u32, echo u32, flags u8, base u16, bits of base, base + 1 ... (all below base are there).
"""

from __future__ import annotations

import struct

from protocol import WireError

CHUNK = struct.Struct("<IIH")
BITMAP = struct.Struct("<IIBH")
ANNOUNCE = struct.Struct("<IH32sBB")
ANNOUNCEMENT, REPAIR = 0xFFFF, 0xFFFE
KNOWN, COMPLETE = 1, 2
MAX_OBJECT_BYTES = 1 << 26
Announced = tuple[int, int, bytes, str, str]  # length, size, SHA-256, name, codec


def chunk_head(payload: bytes) -> tuple[int, int, int]:
    """Object, serial and index. Raises WireError."""
    if len(payload) < CHUNK.size:
        raise WireError("chunk", f"{len(payload)} B")
    object_id, serial, index = CHUNK.unpack_from(payload)
    return object_id, serial, index


def announced(body: bytes) -> Announced:
    """What an announcement says. Raises WireError."""
    try:
        length, size, sha, n_name, n_codec = ANNOUNCE.unpack_from(body)
        names = body[ANNOUNCE.size :]
        if not 0 < length <= MAX_OBJECT_BYTES or not size or len(names) != n_name + n_codec:
            raise ValueError(f"length {length}, chunks of {size}")
        return length, size, sha, names[:n_name].decode(), names[n_name:].decode()
    except (struct.error, ValueError) as error:
        raise WireError("chunk", f"announcement: {error}") from error


def bits(payload: bytes) -> tuple[int, int, int, int, bytes]:
    """Object, echo, flags, base and the bits of a bitmap. Raises WireError."""
    if len(payload) < BITMAP.size:
        raise WireError("bitmap", f"{len(payload)} B")
    return (*BITMAP.unpack_from(payload), payload[BITMAP.size :])
