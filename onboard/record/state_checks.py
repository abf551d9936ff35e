"""Check bytes of the state: one for each item of the core's state after a tick, so that a replay names which differs.

The digest in /out/tick says that something differs; /state says what: number of parts u8, items of each part u16, then
a byte of each item, the exclusive or of the eight bytes of its f64. One difference in 256 is not seen in it.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from itertools import chain

import numpy as np

State = Mapping[str, tuple[float, ...]]


def encode(state: State) -> bytes:
    """The message of /state of a tick; b"" without a state."""
    if not state:
        return b""
    items = tuple(chain.from_iterable(state.values()))
    packed = np.frombuffer(struct.pack(f"<{len(items)}d", *items), np.uint8)
    checks: bytes = np.bitwise_xor.reduce(packed.reshape(-1, 8), axis=1).tobytes()
    return struct.pack(f"<B{len(state)}H", len(state), *map(len, state.values())) + checks


def first_difference(recorded: bytes, state: State) -> str:
    """The first item of this state that is not the recorded one, in words; "" where none is seen to differ."""
    made = encode(state)
    if not recorded or not made or recorded == made:
        return ""
    head = 1 + 2 * len(state)
    if recorded[0] != len(state):
        return f"the state had {recorded[0]} parts, now {len(state)}"
    counts = struct.unpack_from(f"<{len(state)}H", recorded, 1)
    at = head
    for (part, items), count in zip(state.items(), counts, strict=True):
        if count != len(items):
            return f"first item of state that differs: {part} had {count} items, now {len(items)}"
        for k, item in enumerate(items):
            if recorded[at + k] != made[at + k]:
                return f"first item of state that differs: {part}[{k}], now {float(item)!r}"
        at += count
    return ""


def read(raw: bytes) -> tuple[list[int], bytes]:
    """Items of each part, and their check bytes. Raises struct.error for what is no such message."""
    counts = list(struct.unpack_from(f"<{raw[0]}H", raw, 1)) if raw else []
    return counts, raw[1 + 2 * len(counts) :]
