"""Elementary functions of one number, with the same bits on every processor; for arrays: `each`.

`math` calls the C library, whose last bits differ by the processor (docs/determinism.md). Errors are at most 2.2 units
in the last place. The result is NaN where a function has no value: nothing raises.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from onboard.native.variant import kernels

sin, cos, tan = kernels.sin, kernels.cos, kernels.tan
asin, acos, atan2 = kernels.asin, kernels.acos, kernels.atan2
exp, log, hypot = kernels.exp, kernels.log, kernels.hypot


def dist(a: tuple[float, ...] | list[float], b: tuple[float, ...] | list[float]) -> float:
    """Distance between two points with the same number of axes."""
    total = 0.0
    for p, q in zip(a, b, strict=True):
        total += (p - q) * (p - q)
    return math.sqrt(total)


def square(x: float) -> float:
    """Square by a product, because `**` calls the C library's power."""
    return x * x


def total(numbers: Iterable[float]) -> float:
    """Sum in order of the terms; the built-in `sum` of floats rounds differently from Python 3.12 on."""
    so_far = 0.0
    for number in numbers:
        so_far += number
    return so_far
