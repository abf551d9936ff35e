"""Codes that replace distances below DMIN; each family of sensors has its own."""

from __future__ import annotations

from enum import IntEnum


class Code(IntEnum):
    """Reason why a beam has no distance."""

    NO_OBJECT = 1
    TOO_NEAR = 2
    INTERFERENCE = 3
    NEAR_END = 4
    OTHER = 5
    TOO_WEAK = 6
    TOO_STRONG = 7


UTM_30LX = {1: Code.NO_OBJECT, 2: Code.TOO_NEAR, 3: Code.INTERFERENCE, 4: Code.NEAR_END, 5: Code.OTHER}
"""UTM-30LX, UTM-30LX-EW (SCIP 2.0, table 4)."""

URG_04LX = {
    0: Code.NO_OBJECT,  # possibly at 22 m
    **dict.fromkeys(range(1, 6), Code.TOO_WEAK),
    6: Code.OTHER,
    7: Code.INTERFERENCE,  # the beams on both sides have errors
    8: Code.INTERFERENCE,  # the two waves differ in strength
    9: Code.INTERFERENCE,  # the same beam had an error in the last two scans
    **dict.fromkeys(range(10, 18), Code.OTHER),
    18: Code.TOO_STRONG,
    19: Code.NO_OBJECT,  # not measurable
}
"""URG-04LX and its kin (SCIP 2.0, table 3)."""

_FAMILIES = (("URG-04LX", URG_04LX), ("UBG-04LX", URG_04LX), ("UTM-30LX", UTM_30LX), ("UXM-30LX", UTM_30LX),
             ("UST-", UTM_30LX))  # fmt: skip


def codes_of(model: str) -> dict[int, Code]:
    """Return the codes of the model named in MODL or PROD; an unknown model has those of the UTM-30LX."""
    return next((codes for name, codes in _FAMILIES if name in model), UTM_30LX)
