"""Evidence of a drive, computed from its log: stops, legs between them, and aligned pairs of scans.

stop --leg--> stop --leg--> stop ...      a stop is a scan of the standing rover, a leg all motion in between
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from onboard.bringup.calibrate.log import Log
from onboard.config import Rover
from onboard.extrinsics import imu_rotation, lidar_place, lidar_rotation
from onboard.motion.kinematics import wheel_places
from onboard.perception.pose.registration import align, prepare
from onboard.records import F64, Bool

BLOCK = 20  # ticks that count as one motion
LEAST_M = 0.9  # nearer points are the rover itself
GROUND_M, GROUND_OFF_M = (0.6, 2.2, 1.1), 0.25  # the ground before the wheels: x from, x to, |y| to; |z| to
PAIR_RAD, PAIR_M = 0.001, 0.002  # 1 sigma floor of an alignment
PLANE_ROUNDS, LEAST_OF_PLANE = 4, 300
NEIGHBOURS = 2  # a scan is aligned to those of this many stops before


class EvidenceError(ValueError):
    """Log without the data that an estimate needs: one line."""


class Pairs(NamedTuple):
    """Aligned pairs of scans.

    i, j: (n,) numbers of the two scans.
    turns: (n, 3, 3), ways_m: (n, 3): transform of j into the axes of i.
    whiten: (n, 6, 6) converts an error of rotation and translation, in the axes of j, into sigmas.
    """

    i: NDArray[np.int64]
    j: NDArray[np.int64]
    turns: F64
    ways_m: F64
    whiten: F64

    def without(self, odd: Bool) -> Pairs:
        """The pairs that are not flagged."""
        kept = ~odd
        return Pairs(self.i[kept], self.j[kept], self.turns[kept], self.ways_m[kept], self.whiten[kept])


@dataclass(frozen=True, slots=True)
class Evidence:
    """Evidence of K stops, n blocks of all legs, and p ground planes.

    forces_mps2: (K, 3) mean specific force in the sensor's axes.
    turns: (K - 1, 3, 3) rotation of each leg by the gyro, in the sensor's axes.
    leg: (n,) number of the block's leg.
    rolled_rad: (n, 4) rotation of each wheel.
    steer_rad: (n, 4) mean steering angle by each wheel's unit.
    yaw_rad: (n,) yaw since the leg's start by the gyro.
    pairs: aligned pairs of scans.
    normals, depths_m: (p, 3) and (p,): the ground before the wheels, in the tilt unit's axes, at the stops where it is
        seen; normal . p = -depth.
    """

    forces_mps2: F64
    turns: F64
    leg: NDArray[np.int64]
    rolled_rad: F64
    steer_rad: F64
    yaw_rad: F64
    pairs: Pairs
    normals: F64
    depths_m: F64

    @property
    def stops(self) -> int:
        """Number of stops."""
        return len(self.forces_mps2)

    @property
    def turned_rad(self) -> F64:
        """(K - 1,) angle of rotation of each leg."""
        cosine = 0.5 * (np.trace(self.turns, axis1=1, axis2=2) - 1.0)
        turned: F64 = np.arccos(np.clip(cosine, -1.0, 1.0))
        return turned

    @property
    def rolled_in_leg_rad(self) -> F64:
        """(K - 1,) rotation of the wheels in each leg, mean of the four."""
        rolled: F64 = np.bincount(self.leg, np.abs(self.rolled_rad).mean(axis=1), self.stops - 1).astype(np.float64)
        return rolled


def evidence(log: Log, before: Rover) -> Evidence:
    """Evidence of a log. Raises EvidenceError.

    before: the rover as configured during the drive, for first guesses.
    """
    scans = [k for k, cloud in enumerate(log.clouds) if cloud is not None and (log.step == k).any()]
    if len(scans) < 2:
        raise EvidenceError(f"{len(scans)} scans: at least 2, with a drive between them, are needed")
    stands = [(log.step == k) & log.standing for k in scans]
    if not all(stand.sum() > 100 for stand in stands):
        raise EvidenceError("the rover did not stand a whole second at each of its scans")
    biases = np.array([log.gyro_radps[stand].mean(axis=0) for stand in stands])
    legs = [_leg(log, a, b, 0.5 * (p + q), before) for a, b, p, q in zip(scans, scans[1:], biases, biases[1:])]
    clouds = [_far(log.clouds[k]) for k in scans]
    planes = [plane for cloud in clouds if (plane := _plane(cloud, before)) is not None]
    return Evidence(
        np.array([log.accel_mps2[stand].mean(axis=0) for stand in stands]),
        np.array([leg.turn.as_matrix() for leg in legs]),
        np.concatenate([np.full(len(leg.rolled_rad), k) for k, leg in enumerate(legs)]),
        np.concatenate([leg.rolled_rad for leg in legs]),
        np.concatenate([leg.steer_rad for leg in legs]),
        np.concatenate([leg.yaw_rad for leg in legs]),
        _pairs(clouds, _guesses(legs, before), before),
        np.array([normal for normal, _ in planes]).reshape(-1, 3),
        np.array([depth_m for _, depth_m in planes]),
    )


class _Leg(NamedTuple):
    turn: Rotation
    rolled_rad: F64
    steer_rad: F64
    yaw_rad: F64


def _leg(log: Log, first: int, last: int, bias_radps: F64, before: Rover) -> _Leg:
    """All ticks from the middle of one scan's standing to that of the other, in blocks."""
    rows = np.flatnonzero((log.step > first) & (log.step < last))
    rows = np.arange(rows[0] - 1, rows[-1] + 2)[: len(rows) // BLOCK * BLOCK + 1]
    gaps_s = np.diff(log.time_s[rows])
    small = Rotation.from_rotvec((log.gyro_radps[rows[1:]] - bias_radps) * gaps_s[:, None])
    turn, yaws, mount = Rotation.identity(), [0.0], _turned(imu_rotation(before))
    for block in range(0, len(gaps_s), BLOCK):
        for tick in range(block, block + BLOCK):
            turn = turn * small[tick]
        yaws.append(float((mount * turn * mount.inv()).as_euler("ZYX")[0]))
    yaw = np.unwrap(yaws)
    ends = rows[::BLOCK]
    steer = np.add.reduceat(log.steer_rad[rows[:-1]], np.arange(0, len(rows) - 1, BLOCK), axis=0) / BLOCK
    return _Leg(turn, np.diff(log.position_rad[ends], axis=0), steer, 0.5 * (yaw[1:] + yaw[:-1]))


def _turned(rows: object) -> Rotation:
    return Rotation.identity() if rows is None else Rotation.from_matrix(np.array(rows))


def _far(cloud: F64 | None) -> F64:
    assert cloud is not None
    far: F64 = cloud[np.linalg.norm(cloud, axis=1) >= LEAST_M]
    return far


def _guesses(legs: list[_Leg], before: Rover) -> list[F64]:
    """T_start_base of each stop by wheels and gyro."""
    places, at = np.array(wheel_places(before)), np.eye(4)
    found = [at]
    for leg in legs:
        way = _mean_way(leg, places, before)
        step = np.eye(4)
        mount = _turned(imu_rotation(before))
        step[:3, :3], step[:2, 3] = (mount * leg.turn * mount.inv()).as_matrix(), way
        at = at @ step
        found.append(at)
    return found


def _mean_way(leg: _Leg, places: F64, before: Rover) -> F64:
    """(2,) translation of base_link in the axes of the leg's start."""
    direction = np.stack([np.cos(leg.steer_rad), np.sin(leg.steer_rad)], axis=-1)
    way = (before.wheel_radius_m * leg.rolled_rad[..., None] * direction).mean(axis=1)  # the wheels' mean place is 0
    cosine, sine = np.cos(leg.yaw_rad), np.sin(leg.yaw_rad)
    total: F64 = np.array([cosine @ way[:, 0] - sine @ way[:, 1], sine @ way[:, 0] + cosine @ way[:, 1]])
    return total


def _pairs(clouds: list[F64], guesses: list[F64], before: Rover) -> Pairs:
    mount = np.eye(4)
    turned = lidar_rotation(before)
    mount[:3, :3], mount[:3, 3] = np.eye(3) if turned is None else turned, lidar_place(before)
    ready = [prepare(cloud) for cloud in clouds]
    seen = [guess @ mount for guess in guesses]
    asked = [(i, j) for i, j in combinations(range(len(clouds)), 2) if j - i <= NEIGHBOURS or i == 0]
    found = [(i, j, align(ready[j], ready[i], np.linalg.inv(seen[i]) @ seen[j])) for i, j in asked]
    made = [(i, j, aligned) for i, j, aligned in found if aligned is not None]
    floor = np.diag([PAIR_RAD**2] * 3 + [PAIR_M**2] * 3)
    if not made:
        raise EvidenceError("no scan could be aligned to another: there must be rocks or boxes around, within 8 m")
    T = np.array([aligned.T_target_source for _, _, aligned in made])
    return Pairs(
        np.array([i for i, _, _ in made]),
        np.array([j for _, j, _ in made]),
        T[:, :3, :3],
        T[:, :3, 3],
        np.array([np.linalg.inv(np.linalg.cholesky(a.covariance + floor)) for _, _, a in made]),
    )


def _plane(cloud: F64, before: Rover) -> tuple[F64, float] | None:
    """Normal and depth of the ground before the wheels; None if hardly any points lie there."""
    turned = lidar_rotation(before)
    near = (cloud if turned is None else cloud @ turned.T) + lidar_place(before)
    x0, x1, y1 = GROUND_M
    inside = (near[:, 0] >= x0) & (near[:, 0] <= x1) & (np.abs(near[:, 1]) <= y1) & (np.abs(near[:, 2]) <= GROUND_OFF_M)
    points = cloud[inside]
    for _ in range(PLANE_ROUNDS):
        if len(points) < LEAST_OF_PLANE:
            return None
        centre = points.mean(axis=0)
        normal = np.linalg.svd(points - centre, full_matrices=False)[2][2]
        off_m = (points - centre) @ normal
        points = points[np.abs(off_m) <= 3.0 * off_m.std()]
    normal = normal if normal[2] > 0 else -normal
    return normal, -float(normal @ centre)
