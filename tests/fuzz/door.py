"""What a door is to the fuzz, and how one string of bytes stands for several messages."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable
from typing import NamedTuple

from tests.fuzz.damage import Rng

MOST_PARTS = 64


class Door(NamedTuple):
    """A place where bytes come in from outside.

    make(rng): bytes as the other side sends them, or as a hostile one may. feed(data): gives them to the program and
    returns where it takes them or refuses them with the documented error; whatever else it raises is found.
    """

    make: Callable[[Rng], bytes]
    feed: Callable[[bytes], None]


def join(parts: Iterable[bytes]) -> bytes:
    """Messages one after the other, each with its length."""
    return b"".join(struct.pack("<H", len(part)) + part for part in parts)


def split(data: bytes) -> list[bytes]:
    """Any bytes as messages, MOST_PARTS at most: a length that reaches too far takes what is there."""
    parts: list[bytes] = []
    at = 0
    while at + 2 <= len(data) and len(parts) < MOST_PARTS:
        size = int.from_bytes(data[at : at + 2], "little")
        parts.append(data[at + 2 : at + 2 + size])
        at += 2 + size
    return parts
