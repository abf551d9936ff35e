"""Wire layouts of `bulk`, little-endian.

A chunk's payload: object u32, serial u32, index u16, data. Index 0xFFFF is the announcement, 0xFFFE a repair symbol:
base u16, span u8, data.
A bitmap's payload: object u32, echo u32, flags u8, base u16, bits of base, base + 1 ... (all chunks below base are
present).
"""

from __future__ import annotations

import re
import struct

from protocol import WireError

CHUNK = struct.Struct("<IIH")
BITMAP = struct.Struct("<IIBH")
ANNOUNCE = struct.Struct("<IH32sBB")
ANNOUNCEMENT, REPAIR = 0xFFFF, 0xFFFE
KNOWN, COMPLETE = 1, 2
MAX_OBJECT_BYTES = 1 << 26
_WORD = re.compile(rb"[A-Za-z0-9][A-Za-z0-9._-]*")  # it may become the name of a file
Announced = tuple[int, int, bytes, str, str]  # length, size, SHA-256, name, codec


def chunk_head(payload: bytes) -> tuple[int, int, int]:
    """Decode a chunk's object id, serial and index. Raises WireError("chunk")."""
    if len(payload) < CHUNK.size:
        raise WireError("chunk", f"{len(payload)} B")
    object_id, serial, index = CHUNK.unpack_from(payload)
    return object_id, serial, index


def announced(body: bytes) -> Announced:
    """Decode and check an announcement. Raises WireError("chunk")."""
    try:
        length, size, sha, n_name, n_codec = ANNOUNCE.unpack_from(body)
        names = body[ANNOUNCE.size :]
        if not 0 < length <= MAX_OBJECT_BYTES or not size or len(names) != n_name + n_codec:
            raise ValueError(f"length {length}, chunks of {size}")
        if -(-length // size) > REPAIR:
            raise ValueError(f"{-(-length // size)} chunks, numbers are there for {REPAIR}")
        name, codec = names[:n_name], names[n_name:]
        if not _WORD.fullmatch(name) or (codec and not _WORD.fullmatch(codec)):
            raise ValueError(f"{name!r} in codec {codec!r}: names are letters, digits, dot, dash")
        return length, size, sha, name.decode(), codec.decode()
    except (struct.error, ValueError) as error:
        raise WireError("chunk", f"announcement: {error}") from error


def bits(payload: bytes) -> tuple[int, int, int, int, bytes]:
    """Decode a bitmap: object id, echo, flags, base and bits. Raises WireError("bitmap")."""
    if len(payload) < BITMAP.size:
        raise WireError("bitmap", f"{len(payload)} B")
    return (*BITMAP.unpack_from(payload), payload[BITMAP.size :])
