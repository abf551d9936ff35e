"""Frames, axes, wheel numbers and small helpers that all packages share.

REP-103: x forward, y left, z up; map frame east, north, up. `base_link` is the centre of the rectangle of the
four wheel contact points, on the ground. Positive tilt is down (rotation about +y). Angles wrap to (-pi, pi].

        x (forward)
    1 ----+---- 4        wheel 1 front left  (+l, +d)
      |   |   |          wheel 2 rear left   (-l, +d)
   y--+---o   |          wheel 3 rear right  (-l, -d)
      |       |          wheel 4 front right (+l, -d)
    2 --------- 3
"""

import math

WHEELS = (1, 2, 3, 4)
WHEEL_SIGNS = ((+1, +1), (-1, +1), (-1, -1), (+1, -1))  # of (l, d), wheels 1 to 4 (Eq. 31, 32)

TICK_NS = 10_000_000  # the fixed-rate scheduler: 100 Hz


def cut(text: str, most_bytes: int) -> bytes:
    """Encode a text as UTF-8 of at most `most_bytes`; a text that is too long is cut and ends with an ellipsis."""
    raw = text.encode()
    if len(raw) <= most_bytes:
        return raw
    return raw[: most_bytes - 3].decode(errors="ignore").encode() + "…".encode()


def wrap_rad(angle_rad: float) -> float:
    """Wrap an angle to (-pi, pi]."""
    wrapped = math.remainder(angle_rad, math.tau)
    return math.pi if wrapped == -math.pi else wrapped
