"""Registration of the scan of a stop to the points of earlier stops: where the rover really stands (small_gicp GICP).

GICP aligns planes with planes. Its Hessian H over (rotation, translation) of the body says which directions the ground
fixes: the blocks' eigenvalues against their largest. Flat ground leaves 1.1e-3 to 1.6e-3 (GICP's own regularisation of
the planes) in x, y and yaw; ground with waves of 2 cm 2e-3 to 3e-3 and errors of 25 mm; of 5 cm 6e-3 to 1e-2 and 5 mm.
A direction under 4e-3 is not trusted: it keeps the guess. Errors on such ground (seeds apart from the tests') were 0.1
to 0.8 of the sigmas that H gives; what H does not know (tilt, clock, a moved stone) is the configured floor.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
import small_gicp

from onboard.config import Localisation
from onboard.perception.credibility import credible
from onboard.records import F32, F64

VOXEL_M = 0.1
POINTS_AT_ONCE = 1 << 14
MARGIN_M = 2.0  # of the target around the source
MATCH_M = 0.5
NEIGHBOURS = 10
LEAST_POINTS = 200
LEAST_INLIERS_RATIO = 0.25
LEAST_OVERLAP_RATIO = 0.2  # at the guess; sectors that share 0.3 register to 30 mm or better, 0.1 to 0.4 m
OVERLAP_CELL_M = 0.5
TRUST_RATIO = 4e-3
UNKNOWN_M2 = 100.0  # variance in a direction that is not trusted
MOST_ITERATIONS = 60
SETTLING_ROUNDS = 3
SETTLED_M = 0.003
SETTLED_RAD = 0.001
AXES = ("x", "y", "z")

Prepared = tuple[small_gicp.PointCloud, small_gicp.KdTree]
Loose = tuple[F64, F64]  # (3, k) directions that are not trusted: of the rotation, of the way


@dataclass(frozen=True, slots=True)
class RegistrationResult:
    """What came out. `accepted` False: `reason` says why, and T_map_base is the guess, unchanged.

    T_map_base: (4, 4). covariance: (4, 4) over x, y, z (m), yaw (rad) in the map frame, huge where nothing fixes it.
    degenerate: the directions of the body that kept the guess. moved_m, moved_rad: what the optimiser moved the guess
    by (trusted directions only). mean_error: cost per inlier; 0.005 to 0.015 on like scans with 20 mm of range noise.
    told: False where there was nothing to compare (points, overlap or features are missing): a refusal without a word
    on the pose. A refusal that was told something speaks against the guess.
    """

    accepted: bool
    reason: str
    T_map_base: F64
    covariance: F64
    converged: bool
    inlier_ratio: float
    mean_error: float
    moved_m: float
    moved_rad: float
    degenerate: tuple[str, ...]
    told: bool = True


def register(
    source_points_base: F64 | F32,
    target_points_map: F64 | F32,
    guess: F64,
    config: Localisation,
    prior: F64 | None = None,
) -> RegistrationResult:
    """Aligns the points of a stop, (n, 3) in base_link, with those of earlier stops, (m, 3) in the map frame.

    guess: T_map_base from the filter. prior: its covariance (4, 4) over x, y, z, yaw; where given, a result that it
    makes incredible (99.9 %) is refused, as the filter itself would. Pure; one thread, the same bits every time.
    Too few points, overlap or matches raise nothing: the result is not accepted and says why.
    """
    source = _near(source_points_base, np.zeros(3), config.registration_range_m)
    reach = math.sqrt(float(np.einsum("ij,ij->i", source, source).max(initial=0.0)))
    source_count, source_cloud = len(source), _prepared(source)[0]
    del source  # 7 MB, before as much is made of the target
    target = _near(target_points_map, guess[:3, 3], reach + MARGIN_M)
    if min(source_count, len(target)) < LEAST_POINTS:
        return _refused(guess, f"{source_count} points on {len(target)} are too few: {LEAST_POINTS} needed")
    target_cloud, tree = _prepared(target)
    shared = _overlap(source_cloud.points(), target_cloud.points(), guess)
    if shared < LEAST_OVERLAP_RATIO:
        return _refused(guess, f"{shared:.2f} of the points lie where the target is: {LEAST_OVERLAP_RATIO} needed")

    def align(start: F64, iterations: int) -> small_gicp.RegistrationResult:
        return small_gicp.align(target_cloud, source_cloud, tree, start, "GICP", MATCH_M, 1, iterations, 1e-5, 1e-4)

    found = align(guess, MOST_ITERATIONS)
    inliers = int(found.num_inliers)
    if inliers < LEAST_POINTS:
        return dataclasses.replace(_refused(guess, f"{inliers} points matched: {LEAST_POINTS} needed"), told=True)
    loose = _loose(found.H[:3, :3]), _loose(found.H[3:, 3:])
    T_map_base, moved_m, moved_rad = _trusted(found.T_target_source, guess, loose)
    converged = bool(found.converged)
    for _ in range(SETTLING_ROUNDS if not converged and _count(loose) < 3 else 0):
        # It slides along what is not fixed: from where the rest came to, does the rest stay?
        again = align(T_map_base, MOST_ITERATIONS // 4)
        T_map_base, slid_m, slid_rad = _trusted(again.T_target_source, T_map_base, loose)
        if slid_m < SETTLED_M and slid_rad < SETTLED_RAD:
            converged = True
            break
    return _judged(
        RegistrationResult(
            True, "", T_map_base, _covariance(found.H, T_map_base, loose, config), converged,
            inliers / source_cloud.size(), float(found.error) / inliers, moved_m, moved_rad, _names(loose),
        ), guess, config, prior,
    )  # fmt: skip


def _judged(result: RegistrationResult, guess: F64, config: Localisation, prior: F64 | None) -> RegistrationResult:
    """The result as it is, or refused with the guess in its place."""
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
    elif prior is not None and not credible(difference(result.T_map_base, guess), prior + result.covariance):
        reason = f"moves by {moved_m:.3f} m, {moved_rad:.4f} rad: incredible to the filter"
    if not reason:
        return result
    told = len(result.degenerate) < 3
    return dataclasses.replace(result, accepted=False, reason=reason, T_map_base=guess.copy(), told=told)


@dataclass(frozen=True, slots=True)
class Alignment:
    """Of two clouds of the same ground. T_target_source: (4, 4). covariance: (6, 6) over a small rotation (rad) and way
    (m) in the source's axes, from the Hessian alone. overlap_ratio: of the source at the guess.
    """

    T_target_source: F64
    covariance: F64
    inlier_ratio: float
    overlap_ratio: float


def align(source: Prepared, target: Prepared, guess: F64) -> Alignment | None:
    """GICP in all six directions, for whoever weighs them himself; None where it does not converge or hardly matches.

    source, target: of `prepare`. guess: (4, 4) T_target_source.
    """
    clouds = [prepared[0] for prepared in (source, target)]
    shared = _overlap(clouds[0].points(), clouds[1].points(), guess)
    if shared < LEAST_OVERLAP_RATIO:
        return None
    found = small_gicp.align(clouds[1], clouds[0], target[1], guess, "GICP", MATCH_M, 1, MOST_ITERATIONS, 1e-5, 1e-4)
    inlier_ratio = int(found.num_inliers) / clouds[0].size()
    if not found.converged or inlier_ratio < LEAST_INLIERS_RATIO:
        return None
    return Alignment(found.T_target_source, np.linalg.inv(found.H), inlier_ratio, shared)


def prepare(points: F64) -> Prepared:
    """A cloud (n, 3) thinned, with the planes of its points: for `align`."""
    return _prepared(np.ascontiguousarray(points, np.float64))


def merge_target(
    target: F64 | F32, new_points_map: F64 | F32, centre_m: tuple[float, float], keep_m: float = 25.0
) -> F64:
    """The points of earlier stops with those of a new one, (m, 3): one per voxel of 0.1 m, within keep_m of the rover.

    Where old and new share a voxel their means count alike. At most about pi * (keep_m / 0.1 m)^2 points on open
    ground.
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
    """Those within radius_m of the centre, (k, 3) float64; in parts, so that temporaries stay small."""
    rows, kept = points.reshape(-1, 3), [np.empty((0, 3))]
    for first in range(0, len(rows), POINTS_AT_ONCE):
        exact = rows[first : first + POINTS_AT_ONCE].astype(np.float64)
        off = exact - centre
        kept.append(exact[np.einsum("ij,ij->i", off, off) <= radius_m * radius_m])
    return np.concatenate(kept)


def _loose(block: F64) -> F64:
    """(3, k) directions of a block of the Hessian that are not trusted."""
    values, vectors = np.linalg.eigh(block)
    loose: F64 = vectors[:, values < TRUST_RATIO * values[-1]]
    return loose


def _names(loose: Loose) -> tuple[str, ...]:
    rotation, way = ([AXES[int(np.abs(v).argmax())] for v in block.T] for block in loose)
    return (*way, *(f"rotation about {axis}" for axis in rotation))


def _count(loose: Loose) -> int:
    return int(loose[0].shape[1] + loose[1].shape[1])


def _overlap(source: F64, target: F64, guess: F64) -> float:
    """Share of the source's points (n, 4) in cells of the plan that hold target points (m, 4)."""
    placed = source @ guess.T
    cells = [np.floor(points[:, :2] / OVERLAP_CELL_M).astype(np.int64) @ (1 << 20, 1) for points in (placed, target)]
    return float(np.isin(cells[0], cells[1]).mean())


def _trusted(T_map_base: F64, guess: F64, loose: Loose) -> tuple[F64, float, float]:
    """The guess moved in trusted directions only, and by how much."""
    loose_rotation, loose_way = loose
    step = np.linalg.inv(guess) @ T_map_base
    way, rotation = step[:3, 3], _rotation_vector(step[:3, :3])
    way = way - loose_way @ (loose_way.T @ way)
    rotation = rotation - loose_rotation @ (loose_rotation.T @ rotation)
    angle = float(np.linalg.norm(rotation))
    small = np.eye(4)
    small[:3, :3] = _rotation_matrix(rotation)
    small[:3, 3] = way
    return guess @ small, float(np.linalg.norm(way)), angle


def _covariance(hessian: F64, T_map_base: F64, loose: Loose, config: Localisation) -> F64:
    body = config.registration_scale**2 * np.linalg.inv(hessian)
    body[:3, :3] += UNKNOWN_M2 * loose[0] @ loose[0].T
    body[3:, 3:] += UNKNOWN_M2 * loose[1] @ loose[1].T
    to_map = np.zeros((4, 6))
    to_map[:3, 3:] = T_map_base[:3, :3]
    to_map[3, :3] = T_map_base[2, :3]
    floor = [config.registration_sigma_m**2] * 3 + [config.registration_sigma_rad**2]
    covariance: F64 = to_map @ body @ to_map.T + np.diag(floor)
    return covariance


def _rotation_vector(matrix: F64) -> F64:
    """Axis times angle of a rotation well below half a turn."""
    twice = np.array([matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]])
    sine = 0.5 * float(np.linalg.norm(twice))
    angle = math.atan2(sine, 0.5 * (float(np.trace(matrix)) - 1.0))
    vector: F64 = twice * (0.5 if sine < 1e-9 else 0.5 * angle / sine)
    return vector


def _rotation_matrix(vector: F64) -> F64:
    """Rodrigues' formula."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector
    cross: F64 = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    first, second = (1.0, 0.5) if angle < 1e-9 else (math.sin(angle) / angle, (1.0 - math.cos(angle)) / angle**2)
    turned: F64 = np.eye(3) + first * cross + second * (cross @ cross)
    return turned


def _refused(guess: F64, reason: str) -> RegistrationResult:
    return RegistrationResult(
        False, reason, guess.copy(), np.diag([UNKNOWN_M2] * 4), False, 0.0, math.inf, 0.0, 0.0, (*AXES, "rotation"),
        told=False,
    )
