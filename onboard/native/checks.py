"""What may cross the border to the kernels: arrays of the right kind, or a ValueError that says what is wrong."""

from __future__ import annotations

import numpy as np
from numpy.typing import DTypeLike


def check_array(name: str, array: object, shape: tuple[int | None, ...], dtype: DTypeLike) -> None:
    """Raises ValueError unless `array` is contiguous, of `dtype` and of `shape` (None: any length)."""
    wanted = f"{np.dtype(dtype)} ({', '.join('any' if n is None else str(n) for n in shape)})"
    if not isinstance(array, np.ndarray):
        raise ValueError(f"{name}: expected an array {wanted}, given {type(array).__name__}")
    fits = array.ndim == len(shape) and all(n is None or n == m for n, m in zip(shape, array.shape))
    if array.dtype != np.dtype(dtype) or not fits:
        raise ValueError(f"{name}: expected {wanted}, given {array.dtype} {array.shape}")
    if not array.flags.c_contiguous:
        raise ValueError(f"{name}: expected contiguous rows (numpy.ascontiguousarray), given strides {array.strides}")
