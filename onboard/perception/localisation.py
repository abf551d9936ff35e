"""Where the rover is: an extended Kalman filter over x, y, z, yaw, gyro bias and slip ratio (filterpy).

    every tick (100 Hz)     way of the wheels and rate of the gyro move the pose, by plain arithmetic:
                            d(x, y, z) = (1 - slip) * R(roll, pitch, yaw) * (dx, dy, 0),  d yaw = (gyro - bias) * dt
                            and slides down the slope by slope_slip_ratio * way of the rims * sin(slope)
    every 100 ms of moving  the filter's covariance is predicted over what moved since (the state is already there)
    every 0.5 s of standing the mean of the gyro is its bias (zero-velocity update); the pose stays, but for the part of
                            the last drive's turn that the bias now explains
    at a stop               the registration corrects x, y, z, yaw, and through them slip and bias, or is refused

Roll and pitch come from `attitude`. The slip ratio is 1 - (way of the body) / (way of the wheels).
A registration that is refused doubles the covariance of the pose and never moves it, so a filter that is too sure of
itself yields to the third or fourth that says the same.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from onboard.config import Localisation as LocalisationConfig
from onboard.config import Rover
from onboard.motion.odometry import Odometry, Step
from onboard.motion.wheel_health import SOUND, Wheels
from onboard.perception.attitude import START_SAMPLES, Attitude
from onboard.perception.credibility import credible
from onboard.records import F64, Estimate, ImuSample, Pose, Twist, WheelState
from protocol.conventions import wrap_rad

if TYPE_CHECKING:
    from filterpy.kalman import ExtendedKalmanFilter

    from onboard.perception.registration import RegistrationResult

X, Y, Z, YAW, BIAS, SLIP = range(6)
PREDICT_NS = 100_000_000
STANDING_NS = 500_000_000
IMU_STALE_NS = 100_000_000
QUIET_RADPS = 0.01  # a gyro beyond this (and 5 sigma) while the wheels stand: the rover is pushed or slides, and turns
START_SIGMA = (0.001, 0.001, 0.001, 0.001)  # the map begins here: only the scale of the numbers
BIAS_FLOOR_RADPS = 1e-4
BIAS_WALK = 1e-5  # rad/s per sqrt(s)
WAY_WALK = 0.04  # m per sqrt(m), of x and y
HEIGHT_WALK = 0.03  # m per sqrt(m): one degree of pitch that is not known
TURN_WALK = 0.005  # rad per sqrt(rad): scale of the gyro
SLIP_WALK = 0.04  # per sqrt(m)
TURN_WITHOUT_GYRO = 0.05
WIDEN = 2.0
MEASURES = np.eye(4, 6)
SLIP_LIMITS = (-0.3, 0.9)


class Localisation:
    """Feeds the filter; owns odometry and attitude. The map's origin is the pose at the start of the mission."""

    def __init__(self, rover: Rover, config: LocalisationConfig, stale_ns: int = 30_000_000) -> None:
        self._config = config
        self._odometry, self._attitude = Odometry(rover, stale_ns), Attitude()
        self._filter: ExtendedKalmanFilter | None = None
        bias = config.gyro_noise_radps / math.sqrt(START_SAMPLES) + BIAS_FLOOR_RADPS
        self._covariance = np.diag([*START_SIGMA, bias, config.odometry_noise_ratio]) ** 2
        self._state = [config.start_x_m, config.start_y_m, 0.0, config.start_yaw_rad, 0.0, 0.0]
        self._now_ns = self._imu_ns = -1
        self.step = Step(0.0, 0.0, 0.0, Twist(), 0.0, 0, True)
        self.yaw_rate_radps = 0.0
        self._since_ns = 0
        self._moved = [0.0] * 6  # raw dx, dy, dz, |way|, |turn|, seconds since the last prediction
        self._standing_since_ns = -1
        self._rates_sum, self._rates, self._fresh = 0.0, 0, False
        self._quiet_radps = max(QUIET_RADPS, 5.0 * config.gyro_noise_radps)

    @property
    def slip_ratio(self) -> float:
        """Share of the wheels' way that the body does not make."""
        return self._state[SLIP]

    @property
    def residual_mps(self) -> float:
        """How much the wheels disagree."""
        return self.step.residual_mps

    @property
    def ready(self) -> bool:
        """Whether roll, pitch and the gyro's bias are averaged: half a second of standing after the start."""
        return self._attitude.ready

    @property
    def pose(self) -> Pose:
        """The best pose now."""
        x, y, z, yaw, _, _ = self._state
        return Pose(x, y, z, self._attitude.roll_rad, self._attitude.pitch_rad, yaw)

    @property
    def estimate(self) -> Estimate:
        """The filter's word now; its covariance (4, 4) over x, y, z, yaw is at most 100 ms old."""
        twist = self.step.twist
        speed = (1.0 - self._state[SLIP]) * math.hypot(twist.vx_mps, twist.vy_mps)
        return Estimate(self.pose, self._covariance[:4, :4].copy(), speed, self.yaw_rate_radps)

    def update(
        self, wheels: Sequence[WheelState | None], imu: ImuSample | None, now_ns: int, health: Wheels = SOUND
    ) -> None:
        """One tick: the newest state of each wheel (None: not known), the newest IMU sample (None: none came)."""
        elapsed_s = (now_ns - self._now_ns) * 1e-9 if self._now_ns >= 0 else 0.0
        self._now_ns = now_ns
        step = self.step = self._odometry.update(wheels, now_ns, health)
        turn = self._turn_rad(imu, now_ns, elapsed_s)
        standing = step.standing and abs(self.yaw_rate_radps) < self._quiet_radps
        if not standing:
            self._move(step, turn, elapsed_s)
            self._standing_since_ns = -1
            if now_ns - self._since_ns >= PREDICT_NS:
                self._predict()
            return
        if self._standing_since_ns < 0:
            self._predict()
            self._standing_since_ns, self._rates_sum, self._rates = now_ns, 0.0, 0
        if self._fresh:
            self._rates_sum += self._attitude.yaw_rate_radps
            self._rates += 1
        if now_ns - self._standing_since_ns >= STANDING_NS:
            self._learn_bias()
            self._standing_since_ns, self._rates_sum, self._rates = now_ns, 0.0, 0

    def register(self, result: RegistrationResult) -> bool:
        """Corrects the pose by a registration, or refuses it, widens the covariance, and says False."""
        config, T = self._config, result.T_map_base
        measured = np.array([*T[:3, 3], math.atan2(T[1, 0], T[0, 0])])
        innovation = _residual(measured, np.array(self._state[:4]))
        self._predict()
        if (
            not result.accepted
            or float(np.linalg.norm(innovation[:3])) > config.gate_m
            or abs(float(innovation[3])) > config.gate_rad
            or not credible(innovation, self._covariance[:4, :4] + result.covariance)
        ):
            scale = np.array([math.sqrt(WIDEN)] * 4 + [1.0, 1.0])
            self._covariance = self._covariance * np.outer(scale, scale)
            return False
        self._correct(measured, MEASURES, result.covariance)
        return True

    def reset(self, pose: Pose) -> None:
        """Puts the rover at a pose known from elsewhere, to within 5 cm and 1 degree; bias and slip stay as learned."""
        self._predict()
        self._state[:4] = [pose.x_m, pose.y_m, pose.z_m, pose.yaw_rad]
        covariance = np.zeros((6, 6))
        covariance[4:, 4:] = self._covariance[4:, 4:]
        covariance[:4, :4] = np.diag([0.05, 0.05, 0.05, 0.02]) ** 2
        self._covariance = covariance

    def digest_items(self) -> tuple[float, ...]:
        """What the state digest of the record is made of."""
        diagonal = self._covariance.diagonal().tolist()
        return (*self._state, self._attitude.roll_rad, self._attitude.pitch_rad, *diagonal)

    def _turn_rad(self, imu: ImuSample | None, now_ns: int, elapsed_s: float) -> float:
        """Turn of this tick: the gyro's (its last rate holds for a while), or the wheels' where the IMU is silent."""
        self._fresh = imu is not None and imu.stamp_ns != self._imu_ns
        if imu is not None and self._fresh:
            since_s = (imu.stamp_ns - self._imu_ns) * 1e-9 if self._imu_ns >= 0 else 0.0
            self._attitude.update(imu, min(since_s, 0.1), self.step.standing)
            self._imu_ns = imu.stamp_ns
        if self._imu_ns < 0 or now_ns - self._imu_ns > IMU_STALE_NS:
            self.yaw_rate_radps = self.step.twist.yaw_radps
            return self.step.dyaw_rad
        self.yaw_rate_radps = self._attitude.yaw_rate_radps - self._state[BIAS]
        return self.yaw_rate_radps * elapsed_s

    def _move(self, step: Step, turn_rad: float, elapsed_s: float) -> None:
        state, moved = self._state, self._moved
        moved[5] += elapsed_s
        yaw = state[YAW] + 0.5 * turn_rad
        state[YAW] = wrap_rad(state[YAW] + turn_rad)
        moved[4] += abs(turn_rad)
        forward, left, rolled = step.dx_m, step.dy_m, step.rolled_m
        if rolled == 0.0:
            return
        roll, pitch = self._attitude.roll_rad, self._attitude.pitch_rad
        sp, cp, sr, cr = math.sin(pitch), math.cos(pitch), math.sin(roll), math.cos(roll)
        down = self._config.slope_slip_ratio * rolled
        forward, left = forward + down * sp, left - down * sr
        level_x, level_y = cp * forward + sp * sr * left, cr * left
        sy, cy = math.sin(yaw), math.cos(yaw)
        way = (cy * level_x - sy * level_y, sy * level_x + cy * level_y, cp * sr * left - sp * forward)
        keep = 1.0 - state[SLIP]
        for k in range(3):
            state[k] += keep * way[k]
            moved[k] += way[k]
        moved[3] += rolled

    def _predict(self) -> None:
        """Covariance over what moved since the last call; the state has moved already."""
        dx, dy, dz, way, turn, seconds = self._moved
        self._since_ns = self._now_ns
        if way == 0.0 and turn == 0.0:
            return
        self._moved = [0.0] * 6
        keep = 1.0 - self._state[SLIP]
        F = np.eye(6)
        F[X, YAW], F[Y, YAW] = -keep * dy, keep * dx
        F[X, SLIP], F[Y, SLIP], F[Z, SLIP] = -dx, -dy, -dz
        F[YAW, BIAS] = -seconds
        stale = self._now_ns - self._imu_ns > IMU_STALE_NS
        yaw = self._config.gyro_noise_radps**2 * 0.01 * seconds + TURN_WALK**2 * turn
        if stale:
            yaw += TURN_WITHOUT_GYRO**2 * turn
        walk = WAY_WALK**2 * way
        Q = [walk, walk, HEIGHT_WALK**2 * way, yaw, BIAS_WALK**2 * seconds, SLIP_WALK**2 * way]
        kalman = self._kalman()
        kalman.F, kalman.Q = F, np.diag(Q)
        kalman.predict()
        self._covariance = kalman.P

    def _kalman(self) -> ExtendedKalmanFilter:
        """The filter with the state and covariance of now; made where it is first needed.

        filterpy loads all of scipy.stats, twice what all else before a first tick takes, and nothing is predicted or
        corrected before the rover has moved or stood for half a second.
        """
        if self._filter is None:
            from filterpy.kalman import ExtendedKalmanFilter

            self._filter = ExtendedKalmanFilter(dim_x=6, dim_z=4)
            self._filter.predict_x = lambda u: None  # the state has moved already
        self._filter.x, self._filter.P = np.array(self._state), self._covariance
        return self._filter

    def _learn_bias(self) -> None:
        if not self._rates or not self._attitude.ready:
            return
        noise = self._config.gyro_noise_radps**2 / self._rates + 1e-9
        measures = np.zeros((1, 6))
        measures[0, BIAS] = 1.0
        self._correct(np.array([self._rates_sum / self._rates]), measures, np.array([[noise]]))

    def _correct(self, measured: F64, measures: F64, noise: F64) -> None:
        kalman = self._kalman()
        kalman.update(
            measured, lambda x: measures, lambda x: measures @ x, R=noise,
            residual=_residual if len(measured) == 4 else np.subtract,
        )  # fmt: skip
        self._state, self._covariance = kalman.x.tolist(), kalman.P
        self._state[YAW] = wrap_rad(self._state[YAW])
        self._state[SLIP] = max(SLIP_LIMITS[0], min(SLIP_LIMITS[1], self._state[SLIP]))


def _residual(measured: F64, expected: F64) -> F64:
    """Difference of x, y, z, yaw with the yaw wrapped."""
    rest = measured - expected
    rest[3] = wrap_rad(float(rest[3]))
    return rest
