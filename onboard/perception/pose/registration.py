"""Registration of the scan of a stop to the points of earlier stops: measures the true pose of the rover.

GICP of small_gicp brings the scan near. `settling` then fits its planes exactly to those of earlier stops and finds
which directions the ground fixes and how well. A direction that the ground does not fix keeps the guess. Errors that
the planes do not show (tilt, clock, a moved stone) are the configured floor of the covariance.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
import small_gicp

from onboard.config import Localisation
from onboard.perception.pose.settling import Faces, SettlingResult, apart, settle
from onboard.records import F32, F64

VOXEL_M = 0.1
POINTS_AT_ONCE = 1 << 14
MARGIN_M = 2.0  # of the target around the source
MATCH_M = 0.5
CLOSE_M = 0.15  # of the planes at the end: a plane may continue farther from the seen ground than the ground does
NEIGHBOURS = 10
LEAST_POINTS = 200
LEAST_INLIERS_RATIO = 0.25
SURE_RATIO = 0.5
LEAST_OVERLAP_RATIO = 0.2  # at the guess; with an overlap of 0.3 the error is 30 mm or less, with 0.1 up to 0.4 m
OVERLAP_CELL_M = 0.5
UNKNOWN_M2 = 100.0  # variance in a direction that is not trusted
MOST_ITERATIONS = 20  # of GICP: fixed directions are near by then, loose ones slide on
NEAR_RAD, NEAR_M = 1e-3, 1e-2  # a smaller step of GICP is its last
AXES = ("x", "y", "z")

Prepared = tuple[small_gicp.PointCloud, small_gicp.KdTree]
Loose = tuple[F64, F64]  # (3, k) directions that are not trusted: of the rotation, of the translation


@dataclass(frozen=True, slots=True)
class RegistrationResult:
    """Result of a registration.

    accepted: False if it is refused.
    reason: reason of the refusal.

    T_map_base: (4, 4); if refused, the guess, unchanged.
    covariance: (4, 4) over x, y, z (m), yaw (rad) in the map frame, huge where nothing fixes it.
    converged: the iteration converged.
    inlier_ratio: share of the points that matched.
    apart_m: root mean square distance of the planes; 3 to 5 mm on like scans with 20 mm of range noise.
    moved_m, moved_rad: distance from the guess.
    degenerate: the directions of the body that kept the guess.
    told: False if there was nothing to compare (points, overlap or features are missing): such a refusal gives no
        information on the pose. A refusal with told True contradicts the guess.
    """

    accepted: bool
    reason: str
    T_map_base: F64
    covariance: F64
    converged: bool
    inlier_ratio: float
    apart_m: float
    moved_m: float
    moved_rad: float
    degenerate: tuple[str, ...]
    told: bool = True

    @property
    def sure(self) -> bool:
        """True if the ground fixes every direction and most of the scan was seen before."""
        return self.accepted and not self.degenerate and self.inlier_ratio >= SURE_RATIO


def register(
    source_points_base: F64 | F32,
    target_points_map: F64 | F32,
    guess: F64,
    config: Localisation,
) -> RegistrationResult:
    """Align the points of a stop, (n, 3) in base_link, with those of earlier stops, (m, 3) in the map frame.

    guess: T_map_base from the filter. Pure; one thread, the same bits every time. Too few points, overlap or matches
        raise nothing: the result is not accepted and has the reason.
    """
    source = _near(source_points_base, np.zeros(3), config.registration_range_m)
    reach = math.sqrt(float(np.einsum("ij,ij->i", source, source).max(initial=0.0)))
    source_count, source_cloud = len(source), _prepared(source)[0]
    del source  # 7 MB, freed before the target needs as much
    target = _near(target_points_map, guess[:3, 3], reach + MARGIN_M)
    if min(source_count, len(target)) < LEAST_POINTS:
        return refused(guess, f"{source_count} points on {len(target)} are too few: {LEAST_POINTS} needed")
    target_cloud, tree = _prepared(target)
    shared = _overlap(source_cloud.points(), target_cloud.points(), guess)
    if shared < LEAST_OVERLAP_RATIO:
        return refused(guess, f"{shared:.2f} of the points lie where the target is: {LEAST_OVERLAP_RATIO} needed")

    found = _settled(source_cloud, (target_cloud, tree), guess)
    if found is None or found.matched < LEAST_POINTS:
        return dataclasses.replace(refused(guess, f"fewer than {LEAST_POINTS} points match"), told=True)
    turned, way = apart(guess, found.T_target_source)
    return _judged(
        RegistrationResult(
            True,
            "",
            found.T_target_source,
            _covariance(found, config),
            found.converged,
            found.matched / source_cloud.size(),
            found.apart_m,
            float(np.linalg.norm(way)),
            float(np.linalg.norm(turned)),
            _names(found.loose),
        ),
        guess,
        config,
    )


def _judged(result: RegistrationResult, guess: F64, config: Localisation) -> RegistrationResult:
    """The result unchanged, or refused with the guess in its place."""
    moved_m, moved_rad, inlier_ratio = result.moved_m, result.moved_rad, result.inlier_ratio
    reason = ""
    if len(result.degenerate) >= 3:
        reason = f"the ground is featureless: {', '.join(result.degenerate)} are not fixed by it"
    elif not result.converged:
        reason = "did not converge"
    elif inlier_ratio < LEAST_INLIERS_RATIO:
        reason = f"{inlier_ratio:.2f} of the points matched: {LEAST_INLIERS_RATIO} needed"
    elif moved_m > config.gate_m or moved_rad > config.gate_rad:
        reason = f"moves by {moved_m:.3f} m, {moved_rad:.4f} rad: {config.gate_m} m, {config.gate_rad:.4f} rad allowed"
    if not reason:
        return result
    told = len(result.degenerate) < 3
    return dataclasses.replace(result, accepted=False, reason=reason, T_map_base=guess.copy(), told=told)


@dataclass(frozen=True, slots=True)
class Alignment:
    """Alignment of two clouds of the same ground.

    T_target_source: (4, 4).
    covariance: (6, 6) over a small rotation (rad) and translation (m) in the source's axes, from the planes.
    inlier_ratio: share of the source's points that matched.
    overlap_ratio: share of the source that overlaps the target at the guess.
    """

    T_target_source: F64
    covariance: F64
    inlier_ratio: float
    overlap_ratio: float


def align(source: Prepared, target: Prepared, guess: F64) -> Alignment | None:
    """Align two clouds, for callers that weigh the directions themselves.

    source, target: of `prepare`.
    guess: (4, 4) T_target_source.

    Returns None if the fit does not converge or hardly any points overlap or match.
    """
    moving = source[0]
    shared = _overlap(moving.points(), target[0].points(), guess)
    if shared < LEAST_OVERLAP_RATIO:
        return None
    found = _settled(moving, target, guess)
    if found is None or not found.converged or found.matched < LEAST_INLIERS_RATIO * moving.size():
        return None
    return Alignment(found.T_target_source, _told(found), found.matched / moving.size(), shared)


def prepare(points: F64) -> Prepared:
    """A cloud (n, 3) downsampled, with the planes of its points: input of `align`."""
    return _prepared(np.ascontiguousarray(points, np.float64))


def merge_target(
    target: F64 | F32, new_points_map: F64 | F32, centre_m: tuple[float, float], keep_m: float = 25.0
) -> F64:
    """The points of earlier stops with those of a new one, (m, 3): one per voxel of 0.1 m, within keep_m of the rover.

    Where old and new points share a voxel, their means count equally. At most about pi * (keep_m / 0.1 m)^2 points on
    open ground.
    """
    centre = np.array([centre_m[0], centre_m[1], 0.0])
    new = small_gicp.voxelgrid_sampling(np.ascontiguousarray(new_points_map, np.float64), VOXEL_M, 1).points()[:, :3]
    both = np.concatenate([np.asarray(target, np.float64).reshape(-1, 3), new])
    both = both[np.hypot(both[:, 0] - centre[0], both[:, 1] - centre[1]) <= keep_m]
    if not len(both):
        return np.empty((0, 3))
    merged: F64 = np.ascontiguousarray(small_gicp.voxelgrid_sampling(both, VOXEL_M, 1).points()[:, :3])
    return merged


def difference(T_map_base: F64, guess: F64) -> F64:
    """(4,) float64: x, y, z (m) and yaw (rad, wrapped) of a transform (4, 4) minus those of another."""
    yaw = math.atan2(T_map_base[1, 0], T_map_base[0, 0]) - math.atan2(guess[1, 0], guess[0, 0])
    x, y, z = T_map_base[:3, 3] - guess[:3, 3]
    return np.array([x, y, z, math.remainder(yaw, math.tau)])


def _prepared(points: F64) -> Prepared:
    prepared: Prepared = small_gicp.preprocess_points(points, VOXEL_M, NEIGHBOURS, 1)
    return prepared


def _near(points: F64 | F32, centre: F64, radius_m: float) -> F64:
    """Points within radius_m of the centre, (k, 3) float64; computed in parts, so that temporaries stay small."""
    rows, kept = points.reshape(-1, 3), [np.empty((0, 3))]
    for first in range(0, len(rows), POINTS_AT_ONCE):
        exact = rows[first : first + POINTS_AT_ONCE].astype(np.float64)
        off = exact - centre
        kept.append(exact[np.einsum("ij,ij->i", off, off) <= radius_m * radius_m])
    return np.concatenate(kept)


def _settled(moving: small_gicp.PointCloud, target: Prepared, guess: F64) -> SettlingResult | None:
    """Alignment by GICP, then plane to plane."""
    fixed, tree = target
    near = small_gicp.align(fixed, moving, tree, guess, "GICP", MATCH_M, 1, MOST_ITERATIONS, NEAR_RAD, NEAR_M)
    return settle(
        _faces(moving), _faces(fixed), tree.batch_nearest_neighbor_search, CLOSE_M, guess, near.T_target_source
    )


def _faces(cloud: small_gicp.PointCloud) -> Faces:
    return Faces(np.ascontiguousarray(cloud.points()[:, :3]), np.ascontiguousarray(cloud.normals()[:, :3]))


def _names(loose: Loose) -> tuple[str, ...]:
    rotation, way = ([AXES[int(np.abs(v).argmax())] for v in block.T] for block in loose)
    return (*way, *(f"rotation about {axis}" for axis in rotation))


def _overlap(source: F64, target: F64, guess: F64) -> float:
    """Share of the source's points (n, 4) in horizontal cells that contain target points (m, 4)."""
    placed = source @ guess.T
    cells = [np.floor(points[:, :2] / OVERLAP_CELL_M).astype(np.int64) @ (1 << 20, 1) for points in (placed, target)]
    return float(np.isin(cells[0], cells[1]).mean())


def _covariance(found: SettlingResult, config: Localisation) -> F64:
    body = config.registration_scale**2 * _told(found)
    R, to_map = found.T_target_source[:3, :3], np.zeros((4, 6))
    to_map[:3, 3:] = R
    to_map[3, :3] = R[2]
    floor = [config.registration_sigma_m**2] * 3 + [config.registration_sigma_rad**2]
    covariance: F64 = to_map @ body @ to_map.T + np.diag(floor)
    return covariance


def _told(found: SettlingResult) -> F64:
    """(6, 6) covariance over rotation and translation in the source's axes, huge in loose directions."""
    covariance: F64 = np.asarray(np.linalg.inv(found.information), np.float64)
    covariance[:3, :3] += UNKNOWN_M2 * found.loose[0] @ found.loose[0].T
    covariance[3:, 3:] += UNKNOWN_M2 * found.loose[1] @ found.loose[1].T
    return covariance


def refused(guess: F64, reason: str) -> RegistrationResult:
    """The guess (4, 4), unchanged, with nothing to compare it with."""
    return RegistrationResult(
        False,
        reason,
        guess.copy(),
        np.diag([UNKNOWN_M2] * 4),
        False,
        0.0,
        math.inf,
        0.0,
        0.0,
        (*AXES, "rotation"),
        told=False,
    )
