"""Elementary functions with the same bits on every processor: of a number, or of each number of an array.

`math` and numpy ask the C library and vector units, whose last bits differ by the processor (docs/determinism.md).
Errors are at most 2.2 units in the last place. NaN where a function has no value. An array comes back with its shape
and dtype; other numbers than float64 are computed in float64.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, overload

import numpy as np

from onboard.native.variant import kernels
from onboard.records import F64

_One = Callable[[float], float]


class _Function:
    """One of them."""

    def __init__(self, name: str) -> None:
        self._one, self._into = getattr(kernels, name), getattr(kernels, f"{name}_into")

    @overload
    def __call__(self, x: float) -> float: ...
    @overload
    def __call__(self, x: F64) -> F64: ...
    def __call__(self, x: Any) -> Any:
        if not isinstance(x, np.ndarray):
            return self._one(x)
        flat = np.ascontiguousarray(x, np.float64).reshape(-1)
        out = np.empty_like(flat)
        self._into(flat, out)
        return out.reshape(x.shape).astype(x.dtype if x.dtype == np.float32 else np.float64, copy=False)


sin, cos, tan, asin, acos, exp, log = (
    _Function(name) for name in ("sin", "cos", "tan", "asin", "acos", "exp", "log")
)


@overload
def atan2(y: float, x: float) -> float: ...
@overload
def atan2(y: F64, x: F64 | float) -> F64: ...
def atan2(y: Any, x: Any) -> Any:
    """The angle of (x, y), rad, in [-pi, pi]."""
    if not isinstance(y, np.ndarray) and not isinstance(x, np.ndarray):
        return kernels.atan2(y, x)
    a, b = np.broadcast_arrays(np.asarray(y, np.float64), np.asarray(x, np.float64))
    out = np.empty(a.size)
    kernels.atan2_into(np.ascontiguousarray(a).reshape(-1), np.ascontiguousarray(b).reshape(-1), out)
    return out.reshape(a.shape)


@overload
def hypot(x: float, y: float) -> float: ...
@overload
def hypot(x: F64, y: F64 | float) -> F64: ...
def hypot(x: Any, y: Any) -> Any:
    """Length of (x, y), without the care for squares beyond 1e308."""
    root = np.sqrt if isinstance(x, np.ndarray) or isinstance(y, np.ndarray) else math.sqrt
    return root(x * x + y * y)


def dist(a: tuple[float, ...], b: tuple[float, ...]) -> float:
    """Between two places of the same number of axes."""
    total = 0.0
    for p, q in zip(a, b, strict=True):
        total += (p - q) * (p - q)
    return math.sqrt(total)
