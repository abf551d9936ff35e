"""Localisation: odometry, gyro and gravity between the stops, registrations at the stops (`pose_filter` weighs them).

    every tick (100 Hz)     wheel displacement and gyro rate move the pose, by plain arithmetic:
                            way = R(roll, pitch, yaw) * (dx, dy, 0); and the rover slides down the slope by
                            -slope_slip_ratio * way of the rims * tan(phi) * ln(1 - tan(slope) / tan(phi))
    every 100 ms of moving  the filter predicts the covariance over the motion since (the state has moved already)
    every 0.5 s of standing the mean of the gyro is its bias (zero-velocity update); the pose stays, except for the part
                            of the last drive's turn that the bias now explains
    at a stop               a registration corrects x, y, z, yaw, and through them slip, bias, scale, or is refused;
                            then the points enter the map at the corrected pose, which becomes the next anchor

Roll and pitch come from `attitude`. A registration that the ground fixes in every direction is accepted, however small
the filter's covariance is: a larger difference is a slide or a knock that neither wheels nor gyro measured. A weaker
registration that is not credible is refused: it never moves the pose and doubles its covariance, so the filter accepts
the third or fourth that gives the same pose. If there was nothing to compare (a look behind, ground without features),
nothing is estimated and the covariance does not grow.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from onboard.config import Localisation as LocalisationConfig
from onboard.config import Rover
from onboard.motion.odometry import Odometry, OdometryStep
from onboard.motion.wheel_health import SOUND, Wheels
from onboard.native.elementary import asin, atan2, cos, hypot, log, sin, tan
from onboard.native.linear import norm
from onboard.perception.pose.attitude import START_SAMPLES, Attitude
from onboard.perception.pose.pose_filter import BIAS, SCALE, SLIP, TURN_WALK, YAW, PoseFilter, Vector, X, Y, Z
from onboard.records import Estimate, ImuSample, Pose, Twist, WheelState

if TYPE_CHECKING:
    from onboard.perception.pose.registration import RegistrationResult

PREDICT_NS = 100_000_000
STANDING_NS = 500_000_000
IMU_STALE_NS = 100_000_000
QUIET_RADPS = 0.01  # a rate above this (and 5 sigma) while the wheels stand: the rover is pushed or slides, and turns
BIAS_FLOOR_RADPS = 1e-4
TURN_WITHOUT_GYRO = 0.05
SAME_PLACE_M = 1.0
SHARE = 0.5  # weight of a new stop in the map where it overlaps earlier ones: `merge_target` takes means of both
LEVEL_SINE = 1e-6
MOST_SHEAR = 0.95  # of the shear that the soil bears


class Localisation:
    """Pose estimator; owns odometry, attitude and filter. The map's origin is the pose at the start of the mission.

    pose: the best pose now.
    step: wheel motion of the newest tick.
    yaw_rate_radps: yaw rate now.
    """

    def __init__(self, rover: Rover, config: LocalisationConfig, stale_ns: int = 30_000_000) -> None:
        self._config = config
        self._odometry, self._attitude = Odometry(rover, stale_ns), Attitude()
        self._filter = PoseFilter(
            (config.start_x_m, config.start_y_m, config.start_yaw_rad),
            config.gyro_noise_radps / math.sqrt(START_SAMPLES) + BIAS_FLOOR_RADPS,
            (config.level_slip_ratio, config.odometry_noise_ratio),
        )
        self.pose = self._here()
        self._now_ns = self._imu_ns = -1
        self.step = OdometryStep(0.0, 0.0, 0.0, Twist(), 0.0, 0, True)
        self.yaw_rate_radps = 0.0
        self._since_ns = 0
        self._standing_since_ns = -1
        self._rates_sum, self._rates, self._fresh = 0.0, 0, False
        self._quiet_radps = max(QUIET_RADPS, 5.0 * config.gyro_noise_radps)

    @property
    def slip_ratio(self) -> float:
        """Share of the wheels' displacement that the body does not make."""
        return self._filter.state[SLIP]

    @property
    def residual_mps(self) -> float:
        """Disagreement of the wheels, m/s."""
        return self.step.residual_mps

    @property
    def ready(self) -> bool:
        """True once roll, pitch and the gyro's bias are averaged: half a second of standing after the start."""
        return self._attitude.ready

    @property
    def force_bias_mps2(self) -> tuple[float, float]:
        """Estimated bias of the accelerometer: store it with the pose of a stop, for `known_now`."""
        return self._attitude.force_bias_mps2

    @property
    def sigma(self) -> tuple[float, float]:
        """1 sigma of the place in the plan (m) and of the heading (rad)."""
        P = self._filter.covariance
        return math.sqrt(P[X, X] + P[Y, Y]), math.sqrt(P[YAW, YAW])

    @property
    def sigmas(self) -> tuple[float, float, float, float]:
        """1 sigma of x, y, z (m) and of the heading (rad)."""
        P = self._filter.covariance
        return math.sqrt(P[X, X]), math.sqrt(P[Y, Y]), math.sqrt(P[Z, Z]), math.sqrt(P[YAW, YAW])

    @property
    def estimate(self) -> Estimate:
        """The filter's estimate now; its covariance (4, 4) over x, y, z, yaw is at most 100 ms old."""
        twist = self.step.twist
        speed = (1.0 - self.slip_ratio) * hypot(twist.vx_mps, twist.vy_mps)
        return Estimate(self.pose, self._filter.covariance[:4, :4].copy(), speed, self.yaw_rate_radps)

    def known_now(self, pose: Pose, force_bias_mps2: tuple[float, float]) -> Pose:
        """The pose of an earlier stop with roll and pitch corrected by the change of the force bias since then.

        force_bias_mps2: the force bias that was estimated at that stop.
        """
        roll, pitch = self._attitude.known_now(pose.roll_rad, pose.pitch_rad, force_bias_mps2)
        return replace(pose, roll_rad=roll, pitch_rad=pitch)

    def update(
        self,
        wheels: Sequence[WheelState | None],
        imu: ImuSample | None,
        now_ns: int,
        health: Wheels = SOUND,
        slips: bool = False,
    ) -> None:
        """Process one tick.

        wheels: newest state of each wheel, None if it is not known.
        imu: newest IMU sample, None if none arrived.
        slips: SLIP_HIGH is active.
        """
        elapsed_s = (now_ns - self._now_ns) * 1e-9 if self._now_ns >= 0 else 0.0
        self._now_ns = now_ns
        step = self.step = self._odometry.update(wheels, now_ns, health)
        self._take_imu(imu, now_ns, elapsed_s)
        if step.standing and abs(self.yaw_rate_radps) < self._quiet_radps:
            self._stand(now_ns)
        else:
            self._move(step, elapsed_s, slips)
            self._standing_since_ns = -1
            if now_ns - self._since_ns >= PREDICT_NS:
                self._predict()
        self.pose = self._here()

    def _stand(self, now_ns: int) -> None:
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
        """Correct the pose by a registration and return True, or refuse it and return False.

        A refused registration that could compare points widens the covariance.
        """
        config, T = self._config, result.T_map_base
        measured = np.array([*T[:3, 3], atan2(T[1, 0], T[0, 0])])
        self._predict()
        innovation = self._filter.innovation(measured)
        credible = self._filter.credible(measured, result.covariance)
        if (
            not result.accepted
            or norm(innovation[:3]) > config.gate_m
            or abs(float(innovation[3])) > config.gate_rad
            or not (result.sure or credible)
        ):
            if result.told:
                self._filter.widen()
            return False
        if not credible:
            self._filter.doubt(innovation)
        self._filter.see_pose(measured, result.covariance)
        self.pose = self._here()
        return True

    def anchor(self, taken: RegistrationResult | None) -> Pose:
        """The pose at which the points of this stop enter the map; the next registration is relative to it.

        taken: the registration that corrected the pose; its roll and pitch fit those of the map. A scan without one,
            taken within SAME_PLACE_M of the anchor (the look behind at the start), leaves the anchor unchanged: the
            next registration uses the points of the earlier scan.
        """
        self._predict()
        if taken is None:
            if self._filter.off_anchor_m() > SAME_PLACE_M:
                self._filter.anchor()
            return self.pose
        self._filter.anchor(SHARE)
        R = taken.T_map_base[:3, :3]
        return replace(self.pose, roll_rad=atan2(R[2, 1], R[2, 2]), pitch_rad=-asin(float(R[2, 0])))

    def reset(self, pose: Pose) -> None:
        """Set the rover to an externally known pose, within 5 cm and 1 degree; the estimates of bias and slip stay."""
        self._predict()
        self._filter.reset(pose.x_m, pose.y_m, pose.z_m, pose.yaw_rad)
        self.pose = self._here()

    def doubt_bias(self, step_radps: float) -> None:
        """Estimate the gyro's bias again: its reading at rest changed by step_radps since the last rest."""
        self._filter.doubt_bias(step_radps)
        self._attitude.doubt_bias()

    def resume(self, pose: Pose, sigmas: tuple[float, float, float, float]) -> None:
        """Continue from the pose that an earlier run stored, with its `sigmas`; roll and pitch are measured again."""
        self._filter.resume((pose.x_m, pose.y_m, pose.z_m, pose.yaw_rad), sigmas)
        self.pose = self._here()

    def digest_items(self) -> tuple[float, ...]:
        """Values that enter the state digest of the record."""
        diagonal = self._filter.covariance.diagonal().tolist()
        return (*self._filter.state, self._attitude.roll_rad, self._attitude.pitch_rad, *diagonal)

    def _here(self) -> Pose:
        x, y, z, yaw = self._filter.state[:4]
        return Pose(x, y, z, self._attitude.roll_rad, self._attitude.pitch_rad, yaw)

    def _take_imu(self, imu: ImuSample | None, now_ns: int, elapsed_s: float) -> None:
        """Set the yaw rate of this tick: from the gyro (its last value is valid for 100 ms), else from the wheels."""
        self._fresh = imu is not None and imu.stamp_ns != self._imu_ns
        if imu is not None and self._fresh:
            since_s = (imu.stamp_ns - self._imu_ns) * 1e-9 if self._imu_ns >= 0 else 0.0
            self._attitude.update(imu, min(since_s, 0.1), self.step.standing)
            self._imu_ns = imu.stamp_ns
        if self._imu_ns < 0 or now_ns - self._imu_ns > IMU_STALE_NS:
            self.yaw_rate_radps = self.step.dyaw_rad / elapsed_s if elapsed_s else 0.0
        else:
            rate, state = self._attitude.yaw_rate_radps, self._filter.state
            self.yaw_rate_radps = (1.0 - state[SCALE]) * (rate - state[BIAS])

    def _move(self, step: OdometryStep, elapsed_s: float, slips: bool) -> None:
        yaw = self._filter.state[YAW]
        yaw += 0.5 * self._filter.turn(self.yaw_rate_radps, elapsed_s)
        if step.rolled_m == 0.0:
            return
        roll, pitch = self._attitude.roll_rad, self._attitude.pitch_rad
        slide = step.rolled_m * slide_ratio(roll, pitch, self._config)
        down = sin(pitch), -cos(pitch) * sin(roll)  # of the fall line
        ways = (step.dx_m, step.dy_m), (slide * down[0], slide * down[1])
        self._filter.move(*_in_map(ways, roll, pitch, yaw), step.rolled_m, slips)

    def _predict(self) -> None:
        self._since_ns = self._now_ns
        stale = self._now_ns - self._imu_ns > IMU_STALE_NS
        self._filter.predict(self._config.gyro_noise_radps, TURN_WITHOUT_GYRO if stale else TURN_WALK)

    def _learn_bias(self) -> None:
        if self._rates and self._attitude.ready:
            variance = self._config.gyro_noise_radps * self._config.gyro_noise_radps / self._rates + 1e-9
            self._filter.see_bias(self._rates_sum / self._rates, variance, STANDING_NS * 1e-9)


def slide_ratio(roll_rad: float, pitch_rad: float, config: LocalisationConfig) -> float:
    """Slide of a rover down its slope, as a ratio of the rim displacement times the sine of the slope.

    Soil of internal friction phi bears a shear of tan(slope) at a displacement j, tan(slope) = tan(phi) *
    (1 - e^(-j / K)) (Janosi and Hanamoto), and j grows with the rim displacement. The slide, as a share of the rim
    displacement, is slope_slip_ratio * -tan(phi) * ln(1 - tan(slope) / tan(phi)); for a small slope it is
    slope_slip_ratio * tan(slope). Above 0.95 of tan(phi) the value at 0.95 is used.
    """
    cosine = cos(pitch_rad) * cos(roll_rad)
    sine = math.sqrt(1.0 - cosine * cosine)
    if sine < LEVEL_SINE:
        return config.slope_slip_ratio
    friction = tan(config.soil_friction_rad)
    return -config.slope_slip_ratio * friction * log(1.0 - min(sine / (cosine * friction), MOST_SHEAR)) / sine


def _in_map(
    ways_m: tuple[tuple[float, float], tuple[float, float]], roll_rad: float, pitch_rad: float, yaw_rad: float
) -> tuple[Vector, Vector]:
    """Two displacements of the body (ahead, left), in the plane of its wheels, along the map's axes."""
    sr, cr, sp, cp = sin(roll_rad), cos(roll_rad), sin(pitch_rad), cos(pitch_rad)
    sy, cy = sin(yaw_rad), cos(yaw_rad)

    def turned(forward_m: float, left_m: float) -> Vector:
        ahead, aside = cp * forward_m + sp * sr * left_m, cr * left_m
        return cy * ahead - sy * aside, sy * ahead + cy * aside, cp * sr * left_m - sp * forward_m

    return turned(*ways_m[0]), turned(*ways_m[1])
