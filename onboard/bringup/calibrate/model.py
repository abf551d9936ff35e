r"""Measurement model of the calibration: evidence predicted from unknowns; residuals, each over its sigma.

unknowns    radius, four steering offsets, scanner (x, y, z, roll, pitch, yaw), inertial sensor (roll, pitch, yaw),
            grip, bias of the accelerometer (3), gravity, and of each stop k the pose T_k of base_link (x, y, z, roll,
            pitch, yaw) in axes whose z is up

wheels      way and yaw of a leg = sum of its blocks; in each the body moves so that the wheels slip least:
            min sum_i (hub_i . along_i - radius * rolled_i)^2 + grip * (hub_i . across_i)^2
gyro        R_imu * turn * R_imu^T = R_k^T R_k+1
force       R_imu (force - bias) = g * R_k^T e_z
scans       X^-1 T_i^-1 T_j X = T_ij                        X: the tilt unit in base_link
ground      the plane before a stop is z = 0 of base_link
believed    the configured values with their sigmas: decide only what the drive does not show
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from onboard.bringup.calibrate.evidence import Evidence
from onboard.config import Rover
from onboard.extrinsics import lidar_place, steer_offsets_rad
from onboard.motion.kinematics import wheel_places
from onboard.records import F64

CALIBRATED = {  # key of `rover` -> 1 sigma of its configured value
    "wheel_radius_m": 0.005, "steer_1_offset_rad": 0.05, "steer_2_offset_rad": 0.05, "steer_3_offset_rad": 0.05,
    "steer_4_offset_rad": 0.05, "lidar_x_m": 0.03, "lidar_y_m": 0.002, "lidar_z_m": 0.03, "lidar_roll_rad": 0.05,
    "lidar_pitch_rad": 0.05, "lidar_yaw_rad": 0.05, "imu_roll_rad": 0.05, "imu_pitch_rad": 0.05, "imu_yaw_rad": 0.05,
}  # fmt: skip
STEERS, LIDAR, IMU = slice(1, 5), slice(5, 11), slice(11, 14)
GRIP, BIAS, GRAVITY, POSES = 14, slice(15, 18), 18, 19
GRIP_SIGMA, BIAS_SIGMA_MPS2 = 0.3, 0.02
WAY_M, WAY_RATIO = 0.003, 0.003  # 1 sigma of a leg by wheels: constant, and ratio of its length
YAW_RAD, YAW_RATIO, YAW_RADPM = 0.003, 0.005, 0.003
GYRO_RAD, GYRO_RATIO = 0.0007, 0.0012
FORCE_MPS2 = 0.004
GROUND_RAD, GROUND_M = 0.004, 0.004
GAUGE = 1e-4  # m and rad: of the first stop's pose


@dataclass(frozen=True, slots=True)
class Model:
    """Residuals of one drive's evidence.

    evidence: the evidence.
    before: the rover as configured.
    """

    evidence: Evidence
    before: Rover
    _newest: dict[bytes, F64] = field(default_factory=dict)  # ways of the newest wheels: most steps change poses only

    def start(self) -> F64:
        """Start values: the configuration; the first stop levelled by its force, the others by wheels and gyro."""
        e, force = self.evidence, self.evidence.forces_mps2[0]
        gravity = float(np.linalg.norm(e.forces_mps2, axis=1).mean())
        unknowns = np.concatenate([believed(self.before), [0.0, 0.0, 0.0, 0.0, gravity], np.zeros(6 * e.stops)])
        imu = turned(unknowns[IMU])
        x, y, z = imu @ force
        at, turn, poses = np.zeros(3), turned(np.array([math.atan2(y, z), math.atan2(-x, math.hypot(y, z)), 0.0])), []
        for way, gyro in zip([*self.ways(unknowns), None], [*e.turns, None]):
            poses.append([*at, *angles(turn)])
            if way is not None:
                at, turn = at + turn @ (way[0], way[1], 0.0), turn @ imu @ gyro @ imu.T
        unknowns[POSES:] = np.ravel(poses)
        return unknowns

    def ways(self, unknowns: F64) -> F64:
        """(legs, 3) motion of each leg by the wheels: x, y in the axes of its start (headings by the gyro), and yaw."""
        e, wheels = self.evidence, unknowns[[0, 1, 2, 3, 4, GRIP]].tobytes()
        if wheels in self._newest:
            return self._newest[wheels]
        moved = body_motions(
            unknowns[0] * e.rolled_rad,
            e.steer_rad + unknowns[STEERS],
            np.exp(unknowns[GRIP]),
            np.array(wheel_places(self.before)),
        )
        cosine, sine = np.cos(e.yaw_rad), np.sin(e.yaw_rad)
        x, y = cosine * moved[:, 0] - sine * moved[:, 1], sine * moved[:, 0] + cosine * moved[:, 1]
        found: F64 = np.column_stack([np.bincount(e.leg, part, len(e.turns)) for part in (x, y, moved[:, 2])])
        self._newest.clear()
        self._newest[wheels] = found
        return found

    def data(self, unknowns: F64) -> F64:
        """Residuals of the measurements."""
        poses = unknowns[POSES:].reshape(-1, 6)
        turns, imu = turned(poses[:, 3:]), turned(unknowns[IMU])
        legs = np.swapaxes(turns[:-1], 1, 2) @ turns[1:]
        return np.concatenate(
            [
                self._wheels(unknowns, poses, turns, legs),
                self._gyro(legs, imu),
                self._force(unknowns, turns, imu),
                self.scans(unknowns).ravel(),
                self._ground(unknowns),
            ]
        )

    def belief(self, unknowns: F64) -> F64:
        """Residuals against the configured values, and the gauge: the first stop is the origin, looking along x."""
        sigmas = np.array(list(CALIBRATED.values()))
        first = unknowns[POSES : POSES + 6][[0, 1, 2, 5]]
        return np.concatenate(
            [
                (unknowns[:GRIP] - believed(self.before)) / sigmas,
                unknowns[GRIP : GRIP + 1] / GRIP_SIGMA,
                unknowns[BIAS] / BIAS_SIGMA_MPS2,
                first / GAUGE,
            ]
        )

    def _wheels(self, unknowns: F64, poses: F64, turns: F64, legs: F64) -> F64:
        ways, rolled_m = self.ways(unknowns), unknowns[0] * self.evidence.rolled_in_leg_rad
        true_m = np.einsum("nji,nj->ni", turns[:-1], np.diff(poses[:, :3], axis=0))
        yaw = np.arctan2(legs[:, 1, 0], legs[:, 0, 0])
        off_m = (ways[:, :2] - true_m[:, :2]) / (WAY_M + WAY_RATIO * rolled_m)[:, None]
        off_rad = np.remainder(ways[:, 2] - yaw + np.pi, 2 * np.pi) - np.pi
        return np.concatenate([off_m.ravel(), off_rad / (YAW_RAD + YAW_RATIO * np.abs(yaw) + YAW_RADPM * rolled_m)])

    def _gyro(self, legs: F64, imu: F64) -> F64:
        e = self.evidence
        off = off_rad(np.swapaxes(legs, 1, 2) @ (imu @ e.turns @ imu.T))
        return (off / (GYRO_RAD + GYRO_RATIO * e.turned_rad)[:, None]).ravel()

    def _force(self, unknowns: F64, turns: F64, imu: F64) -> F64:
        felt = (self.evidence.forces_mps2 - unknowns[BIAS]) @ imu.T
        off: F64 = (felt - unknowns[GRAVITY] * turns[:, 2]) / FORCE_MPS2  # the row is R^T e_z
        return off.ravel()

    def scans(self, unknowns: F64) -> F64:
        """(pairs, 6) residuals of the aligned scans, in sigmas."""
        poses, pairs = unknowns[POSES:].reshape(-1, 6), self.evidence.pairs
        turns = turned(poses[:, 3:])
        eyes, centres = turns @ turned(unknowns[LIDAR][3:]), poses[:, :3] + turns @ unknowns[LIDAR][:3]
        back = np.swapaxes(eyes[pairs.i], 1, 2)
        turn = off_rad(np.swapaxes(eyes[pairs.j], 1, 2) @ eyes[pairs.i] @ pairs.turns)
        gone_m = np.einsum("nkl,nl->nk", back, centres[pairs.j] - centres[pairs.i])
        way = np.einsum("nlk,nl->nk", pairs.turns, pairs.ways_m - gone_m)
        whitened: F64 = np.einsum("nkl,nl->nk", pairs.whiten, np.concatenate([turn, way], axis=1))
        return whitened

    def _ground(self, unknowns: F64) -> F64:
        normals = self.evidence.normals @ turned(unknowns[LIDAR][3:]).T
        depths_m = self.evidence.depths_m - normals @ unknowns[LIDAR][:3]
        off: F64 = np.column_stack([normals[:, :2] / GROUND_RAD, depths_m / GROUND_M])
        return off.ravel()


def believed(rover: Rover) -> F64:
    """The calibrated values of a configuration, in the order of CALIBRATED."""
    return np.array(
        [
            rover.wheel_radius_m,
            *steer_offsets_rad(rover),
            *lidar_place(rover),
            rover.lidar_roll_rad,
            rover.lidar_pitch_rad,
            rover.lidar_yaw_rad,
            rover.imu_roll_rad,
            rover.imu_pitch_rad,
            rover.imu_yaw_rad,
        ]
    )


def turned(angles_rad: F64) -> F64:
    """(..., 3, 3) rotations by (..., 3) roll, pitch, yaw: vectorised `onboard.extrinsics.rotation`."""
    (sr, sp, sy), (cr, cp, cy) = np.moveaxis(np.sin(angles_rad), -1, 0), np.moveaxis(np.cos(angles_rad), -1, 0)
    rows = np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
    made: F64 = np.moveaxis(rows, (0, 1), (-2, -1))
    return made


def angles(matrix: F64) -> tuple[float, float, float]:
    """Roll, pitch, yaw of a rotation (3, 3)."""
    return (math.atan2(matrix[2, 1], matrix[2, 2]), -math.asin(matrix[2, 0]), math.atan2(matrix[1, 0], matrix[0, 0]))


def off_rad(matrices: F64) -> F64:
    """(n, 3) small rotations as vectors (axis times sine)."""
    m = matrices
    return 0.5 * np.stack([m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]], axis=1)


def body_motions(rolled_m: F64, angle_rad: F64, grip: float, places_m: F64) -> F64:
    """(n, 3) x, y, yaw of the body in each block, by least slip.

    rolled_m, angle_rad: (n, 4).
    places_m: (4, 2).
    """
    cosine, sine = np.cos(angle_rad), np.sin(angle_rad)
    a, b = places_m.T
    along = np.stack([cosine, sine, a * sine - b * cosine], axis=-1)  # hub . along = row . (x, y, yaw)
    across = np.stack([-sine, cosine, a * cosine + b * sine], axis=-1)
    left = np.einsum("nik,nil->nkl", along, along) + grip * np.einsum("nik,nil->nkl", across, across)
    right = np.einsum("nik,ni->nk", along, rolled_m)
    found: F64 = np.linalg.solve(left, right[..., None])[..., 0]
    return found
