"""Several echoes of one beam, in ND, NE, HD, HE: the first one as in MD, each further one after an `&`.

    one echo   RRR          with intensity   RRRIII
    three      RRR&RRR&RRR                   RRRIII&RRRIII&RRRIII

An `&` lies outside the 64 data characters, counts in the 64 of its block and in the sum, and may begin a block.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from protocol import WireError
from protocol.scip.blocks import cut, join, sixes_of, values_of

MISSING = -1
_AND = np.uint8(0x26 - 0x30 & 0xFF)


def encode_echoes(values: NDArray[np.int32], characters: int) -> bytes:
    """Encode values (beams, echoes, channels) as blocks; an echo of range MISSING and those after it are not sent.

    Raises ValueError if a beam has no first echo.
    """
    beams, echoes, channels = values.shape
    sent = np.logical_and.accumulate(values[:, :, 0] != MISSING, axis=1)
    if not sent[:, 0].all():
        raise ValueError("a beam without its first echo: it has at least a code")
    text = np.full((beams, echoes, 1 + channels * characters), _AND, np.uint8)
    text[:, :, 1:] = sixes_of(np.maximum(values, 0), characters).reshape(beams, echoes, -1)
    there = np.broadcast_to(sent[:, :, None], text.shape).copy()
    there[:, 0, 0] = False
    return cut(text[there])


def decode_echoes(body: bytes, beams: int, shape: tuple[int, int, int]) -> NDArray[np.int32]:
    """Decode blocks whose last LF is missing into values (beams, echoes, channels), MISSING for a missing echo.

    shape: (echoes at most, channels, characters). Raises WireError: as `join`, "character", "length" (too few or too
    many beams, an echo cut short, more echoes than allowed).
    """
    echoes, channels, characters = shape
    sixes, wide = join(body), channels * characters
    ands = np.flatnonzero(sixes == _AND)
    plain = np.delete(sixes, ands)
    if plain.max(initial=0) > 0x3F:
        raise WireError("character", "a data byte outside 0x30 to 0x6F and no &")
    further, cut_short = np.divmod(ands - np.arange(len(ands)), wide)
    total = len(plain) // wide
    if len(plain) % wide or cut_short.any() or (np.diff(further) == 0).any():
        raise WireError("length", "an echo is cut short")
    if len(ands) and (further[0] == 0 or further[-1] >= total):
        raise WireError("length", "an & without an echo on both sides")
    first = np.ones(total, bool)
    first[further] = False
    beam = np.cumsum(first) - 1
    order = np.arange(total) - np.flatnonzero(first)[beam]
    if total - len(ands) != beams or order.max(initial=0) >= echoes:
        raise WireError("length", f"{total} echoes of {total - len(ands)} beams where {beams} beams belong")
    values = np.full((beams, echoes, channels), MISSING, np.int32)
    values[beam, order] = values_of(plain, total * channels, characters).reshape(total, channels)
    return values
