"""Orientations in the engine's format: unit quaternions x y z w, as tuples."""

from __future__ import annotations

import math

from onboard.native import elementary


def rotate(q: tuple[float, ...], v: tuple[float, ...]) -> tuple[float, float, float]:
    """Rotate a vector by a unit quaternion x y z w."""
    x, y, z, w = q
    tx, ty, tz = 2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])
    return (
        v[0] + w * tx + y * tz - z * ty,
        v[1] + w * ty + z * tx - x * tz,
        v[2] + w * tz + x * ty - y * tx,
    )


def inverse(q: tuple[float, ...]) -> tuple[float, float, float, float]:
    """Inverse of a unit quaternion."""
    return -q[0], -q[1], -q[2], q[3]


def middle(a: tuple[float, ...], b: tuple[float, ...]) -> tuple[float, ...]:
    """Orientation half way between two that are close."""
    sign = math.copysign(1.0, elementary.total(p * q for p, q in zip(a, b)))
    added = [p + sign * q for p, q in zip(a, b)]
    size = math.sqrt(elementary.total(p * p for p in added))
    return tuple(p / size for p in added)
