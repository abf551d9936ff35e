"""The interface of a door, and the coding of several messages in one string of bytes."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable
from typing import NamedTuple

from tests.fuzz.damage import Rng

MOST_PARTS = 64


class Door(NamedTuple):
    """Input from outside.

    make(rng): bytes as the other side sends them, or as a hostile one may.
    feed(data): passes them to the program and returns if it accepts them or refuses them with the documented error; any
    other exception is a finding.
    """

    make: Callable[[Rng], bytes]
    feed: Callable[[bytes], None]


def join(parts: Iterable[bytes]) -> bytes:
    """Join messages, each with its length."""
    return b"".join(struct.pack("<H", len(part)) + part for part in parts)


def split(data: bytes) -> list[bytes]:
    """Split any bytes into messages, MOST_PARTS at most; a length beyond the end takes what is there."""
    parts: list[bytes] = []
    at = 0
    while at + 2 <= len(data) and len(parts) < MOST_PARTS:
        size = int.from_bytes(data[at : at + 2], "little")
        parts.append(data[at + 2 : at + 2 + size])
        at += 2 + size
    return parts
