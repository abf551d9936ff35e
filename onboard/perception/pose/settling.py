"""Final step of a registration: point to plane, by the mean normal of each pair (symmetric ICP, Rusinkiewicz 2019).

GICP gives each point a disc a thousandth as thick as wide. So a pair also pulls within its plane, 1e-3 as hard as
across it, and tends to lay the patterns of two scans over each other: by 18 mm on scans 1.7 m apart, divided by the
information of the ground itself. On waves of 5 cm that is 4 mm, of 2 cm 20 mm, of 1 cm 80 mm, on a plane 0.7 m. Across
the planes alone the same scans align within 1, 1 and 6 mm, and a plane fixes nothing.

A normal is computed from noisy points, and its noise also seems to fix the translation along the plane. Half the
difference of a pair's normals has the noise of their mean and no information on the ground: a direction is trusted if
the means give at least twice the information of the differences (on a plane 1.0 times, on waves of 1 cm 3 times, of
2 cm 7 times).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from onboard.records import F64, Bool

LEAST_COSINE = 0.9  # of the two normals of a pair: below it they are not of one face
TRUST = 2.0  # times the information of noise
LEAST_RATIO = 1e-4  # of the information in the best fixed direction
ROUNDS = 15
STILL_M, STILL_RAD = 2e-4, 2e-5  # a smaller step is the last
SETTLED_M, SETTLED_RAD = 0.003, 0.001  # after all rounds a smaller step counts as converged
ROBUST = 3.0  # times the usual distance: beyond it a pair's weight falls

Search = Callable[[F64], tuple[list[int], list[float]]]
"""Of points (n, 3): the nearest target point of each, and the square of its distance."""


@dataclass(frozen=True, slots=True)
class Faces:
    """Points (n, 3) and unit normals (n, 3) of either sign."""

    points: F64
    normals: F64


@dataclass(frozen=True, slots=True)
class SettlingResult:
    """Result of `settle`.

    T_target_source: (4, 4).
    information: (6, 6) over a small rotation (rad) and translation (m) in the source's axes, from the distances left.
    loose: (3, k) directions of rotation, and of translation, that nothing fixes: they keep the guess.
    apart_m: root mean square distance of the planes.
    matched: number of pairs.
    converged: the iteration converged.
    """

    T_target_source: F64
    information: F64
    loose: tuple[F64, F64]
    apart_m: float
    matched: int
    converged: bool


def settle(
    source: Faces, target: Faces, search: Search, match_m: float, guess: F64, start: F64
) -> SettlingResult | None:
    """Fit the planes, starting from `start` (4, 4) T_target_source; loose directions stay at `guess`.

    None if fewer than six pairs match.
    """
    pairs = _pair(source, target, search, match_m, start)
    if len(pairs.off_m) < 6:
        return None
    loose = _loose(pairs)
    T, converged, step = _kept(start, guess, loose), False, np.full(6, np.inf)
    for _ in range(ROUNDS if loose[0].shape[1] + loose[1].shape[1] < 3 else 0):
        pairs = _pair(source, target, search, match_m, T)
        if len(pairs.off_m) < 6:
            return None
        step = _step(pairs, loose)
        T = T @ transform(step[:3], step[3:])
        converged = _under(step, STILL_M, STILL_RAD)
        if converged:
            break
    weights, J = _weights(pairs.off_m), pairs.jacobian(pairs.mean)
    square = float((weights * pairs.off_m**2).sum() / weights.sum())
    return SettlingResult(
        T,
        (J * weights[:, None]).T @ J / max(square, 1e-12),
        loose,
        square**0.5,
        len(pairs.off_m),
        converged or _under(step, SETTLED_M, SETTLED_RAD),
    )


@dataclass(frozen=True, slots=True)
class _Pairs:
    """Matched pairs, all in the source's axes.

    points: (n, 3) of the source.
    mean, noise: (n, 3) half of sum (normalised) and difference of its normal and the target's.
    off_m: (n,) distance from its plane to the target's.
    """

    points: F64
    mean: F64
    noise: F64
    off_m: F64

    def jacobian(self, normals: F64) -> F64:
        """(n, 6) derivative of off_m over rotation and translation, with these normals for the planes."""
        return np.concatenate([np.cross(self.points, normals), normals], axis=1)


def _pair(source: Faces, target: Faces, search: Search, match_m: float, T: F64) -> _Pairs:
    R = T[:3, :3]
    there = source.points @ R.T + T[:3, 3]
    found, squares = search(there)
    nearest = np.asarray(found, np.int64)
    normals = target.normals[nearest] @ R
    cosine = np.einsum("ij,ij->i", normals, source.normals)
    good: Bool = (np.asarray(squares) < match_m * match_m) & (np.abs(cosine) > LEAST_COSINE)
    theirs, ours = normals[good] * np.sign(cosine[good])[:, None], source.normals[good]
    mean = 0.5 * (theirs + ours)
    mean /= np.sqrt(np.einsum("ij,ij->i", mean, mean))[:, None]
    apart = (target.points[nearest[good]] - there[good]) @ R
    return _Pairs(source.points[good], mean, 0.5 * (theirs - ours), np.einsum("ij,ij->i", apart, mean))


def _loose(pairs: _Pairs) -> tuple[F64, F64]:
    """Directions that the mean normals do not fix better than their noise does."""
    told, noise = (J.T @ J for J in (pairs.jacobian(pairs.mean), pairs.jacobian(pairs.noise)))
    parts = []
    for part in (slice(0, 3), slice(3, 6)):
        values, vectors = np.linalg.eigh(told[part, part])
        heard = np.einsum("ik,ij,jk->k", vectors, noise[part, part], vectors)
        parts.append(vectors[:, values < np.maximum(TRUST * heard, LEAST_RATIO * values[-1])])
    return parts[0], parts[1]


def _weights(off_m: F64) -> F64:
    """(n,) Cauchy-type weights: stones that one scan saw and the other did not have little weight."""
    usual = 1.4826 * float(np.median(np.abs(off_m)))
    weights: F64 = 1.0 / (1.0 + (off_m / (ROBUST * max(usual, 1e-6))) ** 2) ** 2
    return weights


def _step(pairs: _Pairs, loose: tuple[F64, F64]) -> F64:
    """(6,) Gauss-Newton step over the fixed directions."""
    J = pairs.jacobian(pairs.mean)
    weighted = J * _weights(pairs.off_m)[:, None]
    A, free = weighted.T @ J, np.zeros((6, 6))
    free[:3, :3], free[3:, 3:] = loose[0] @ loose[0].T, loose[1] @ loose[1].T
    hold = np.eye(6) - free
    step: F64 = np.linalg.solve(hold @ A @ hold + free * A.trace(), hold @ (weighted.T @ pairs.off_m))
    return step


def _kept(T: F64, guess: F64, loose: tuple[F64, F64]) -> F64:
    """T, with the guess in the loose directions."""
    rotation, way = apart(guess, T)
    return guess @ transform(rotation - loose[0] @ (loose[0].T @ rotation), way - loose[1] @ (loose[1].T @ way))


def _under(step: F64, way_m: float, angle_rad: float) -> bool:
    return float(np.linalg.norm(step[3:])) < way_m and float(np.linalg.norm(step[:3])) < angle_rad


def apart(T: F64, other: F64) -> tuple[F64, F64]:
    """Rotation (3,) as axis times angle, well below half a turn, and translation (3,) of `other` in the axes of `T`.

    T, other: (4, 4).
    """
    off = np.linalg.inv(T) @ other
    R = off[:3, :3]
    twice = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    sine = 0.5 * float(np.linalg.norm(twice))
    angle = float(np.arctan2(sine, 0.5 * (float(np.trace(R)) - 1.0)))
    rotation: F64 = twice * (0.5 if sine < 1e-9 else 0.5 * angle / sine)
    return rotation, off[:3, 3]


def transform(rotation: F64, way: F64) -> F64:
    """(4, 4) of axis times angle (3,) (Rodrigues' formula) and translation (3,)."""
    angle = float(np.linalg.norm(rotation))
    x, y, z = rotation
    cross: F64 = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    first, second = (1.0, 0.5) if angle < 1e-9 else (np.sin(angle) / angle, (1.0 - np.cos(angle)) / angle**2)
    T: F64 = np.eye(4)
    T[:3, :3] += first * cross + second * (cross @ cross)
    T[:3, 3] = way
    return T
