"""Elementary functions of arrays, with the same bits as `elementary` gives for one number.

Computed and returned in float64; only `hypot` of two float32 arrays stays in float32.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from onboard.native.arrays import F32, F64
from onboard.native.variant import kernels


class Each:
    """One function, by its kernel into(from, to)."""

    def __init__(self, into: Callable[[F64, F64], None]) -> None:
        self._into = into

    def __call__(self, x: NDArray[np.floating[Any]]) -> F64:
        """Return the function of each number, in the shape of x."""
        numbers = np.asarray(x, np.float64)
        flat = np.ascontiguousarray(numbers).reshape(-1)
        out = np.empty_like(flat)
        self._into(flat, out)
        return out.reshape(numbers.shape)


sin, cos, tan = Each(kernels.sin_into), Each(kernels.cos_into), Each(kernels.tan_into)
asin, acos = Each(kernels.asin_into), Each(kernels.acos_into)
exp, log = Each(kernels.exp_into), Each(kernels.log_into)


def atan2(y: ArrayLike, x: ArrayLike) -> F64:
    """Angles of (x, y), rad, in [-pi, pi]."""
    a, b = np.broadcast_arrays(np.asarray(y, np.float64), np.asarray(x, np.float64))
    out = np.empty(a.size)
    kernels.atan2_into(np.ascontiguousarray(a).reshape(-1), np.ascontiguousarray(b).reshape(-1), out)
    return out.reshape(a.shape)


@overload
def hypot(x: F32, y: F32) -> F32: ...
@overload
def hypot(x: ArrayLike, y: ArrayLike) -> F64: ...
def hypot(x: Any, y: Any) -> Any:
    """Lengths of (x, y); squares beyond 1e308 overflow. Raises ValueError for text; None is NaN."""
    a, b = np.asarray(x), np.asarray(y)
    if not a.dtype == b.dtype == np.float32:
        a, b = np.asarray(x, np.float64), np.asarray(y, np.float64)
    return np.sqrt(np.multiply(a, a) + np.multiply(b, b))
