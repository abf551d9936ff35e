"""Products and linear equations of small matrices, with the same bits on every processor.

`@`, `np.dot` and `np.linalg` call BLAS and LAPACK, whose order of summation differs by the processor
(docs/determinism.md). Here each sum goes from its first term to its last.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from onboard.native.arrays import F64
from onboard.native.variant import kernels


def product(a: ArrayLike, b: ArrayLike) -> F64:
    """Return `a @ b` for one or two axes each, in float64. Raises ValueError if the shapes do not fit."""
    left, right = np.asarray(a, np.float64), np.asarray(b, np.float64)
    n, k = left.shape if left.ndim == 2 else (1, *left.shape)
    rows, m = right.shape if right.ndim == 2 else (*right.shape, 1)
    if k != rows:
        raise ValueError(f"no product of {left.shape} and {right.shape}: the inner sides differ")
    out = np.empty((n, m))
    kernels.product_into(np.ascontiguousarray(left).reshape(n, k), np.ascontiguousarray(right).reshape(k, m), out)
    return out.reshape(left.shape[:-1] + right.shape[1:])


def chain(*factors: ArrayLike) -> F64:
    """Product of the factors, from the first to the last."""
    out = np.asarray(factors[0], np.float64)
    for factor in factors[1:]:
        out = product(out, factor)
    return out


def inner(a: ArrayLike, b: ArrayLike) -> float:
    """Inner product of two vectors of the same length."""
    return float(product(a, b))


def norm(vector: NDArray[Any]) -> float:
    """Length of a vector."""
    return math.sqrt(inner(vector, vector))


def solve(a: F64, b: F64) -> F64:
    """Solve a x = b: a (n, n), b (n,) or (n, m); or many systems, a (count, n, n), b (count, n).

    Raises numpy.linalg.LinAlgError if one is singular, ValueError if shapes do not fit.
    """
    a, b = np.asarray(a, np.float64), np.asarray(b, np.float64)
    n, many = a.shape[-1] if a.ndim else 0, a.ndim == 3
    fit = a.ndim in (2, 3) and a.shape[-2] == n and b.ndim in (1, 2)
    if not fit or (b.shape != a.shape[:-1] if many else b.shape[0] != n):
        raise ValueError(f"no equations: {a.shape} and {b.shape}")
    used = np.array(a, order="C").reshape(-1, n, n)
    x = np.array(b, order="C").reshape(len(used), n, 1 if many or b.ndim == 1 else b.shape[1])
    if not kernels.solve_into(used, x):
        raise np.linalg.LinAlgError("Singular matrix")
    return x.reshape(b.shape)


def decorrelated(noise: F64, rows: F64, off: F64) -> tuple[list[float], tuple[F64, F64]]:
    """Transform measurements of correlated noise (n, n) into combinations whose noise is independent.

    rows: (n, m), measurement matrix. off: (n,), offsets. Returns the variances, and the transformed rows and offsets:
    noise = L D L^T, L with ones on its diagonal; from each row its shares of the earlier rows are subtracted.
    """
    rest, variances = noise.astype(np.float64), []
    rows, off = rows.astype(np.float64), off.astype(np.float64)
    for k in range(len(rest)):
        variances.append(float(rest[k, k]))
        if rest[k, k] > 0.0:
            share = rest[k + 1 :, k] / rest[k, k]
            rest[k + 1 :, k + 1 :] -= share[:, None] * rest[k, k + 1 :]
            rows[k + 1 :] -= share[:, None] * rows[k]
            off[k + 1 :] -= share * off[k]
    return variances, (rows, off)


class Matrix(np.ndarray[Any, np.dtype[np.float64]]):
    """Array for foreign code: its `dot` and `@` call `product`."""

    def dot(self, b: Any, out: Any = None) -> Any:
        """Return the product, like `ndarray.dot`."""
        return product(self.view(np.ndarray), b).view(Matrix)

    def __matmul__(self, other: Any) -> Any:
        return self.dot(other)

    def __rmatmul__(self, other: Any) -> Any:
        return product(other, self.view(np.ndarray)).view(Matrix)

    def __array_function__(self, func: Any, types: Any, args: Any, kwargs: Any) -> Any:
        if func is np.dot:
            return product(*(np.asarray(argument) for argument in args)).view(Matrix)
        return super().__array_function__(func, types, args, kwargs)


def matrix(a: ArrayLike) -> Matrix:
    """Convert an array to a Matrix."""
    return np.asarray(a, np.float64).view(Matrix)
