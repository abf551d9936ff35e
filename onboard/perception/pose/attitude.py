"""Roll and pitch estimator from the IMU: a Kalman filter that corrects integrated gyro rates by the accelerometer.

The rover is slow, so the mean specific force of half a second is gravity plus the accelerometer's bias:

    f = g * R^T * e_z + b + noise,   R^T * e_z = (-sin p, cos p sin r, cos p cos r)

In low gravity the bias is the larger part: 0.01 m/s^2 of 1.62 m/s^2 are 6 mrad, 5 cm at 8 m. Level error and bias
cannot be separated at rest. But the level error keeps its direction on the ground, and the bias turns with the rover.
So the filter estimates the four errors (level about the ground's two axes, bias along the body's two) together, and the
first turn on the spot separates them: the gyro measures the turn to better than a milliradian. The length of gravity
and the gyro's bias start as the means of the first half second, while the rover stands. Every stop refines the gyro's
bias.
"""

from __future__ import annotations

import math

import numpy as np

from onboard.native.elementary import atan2, cos, hypot, sin, square, tan
from onboard.native.linear import chain, inner, product, solve
from onboard.records import F64, ImuSample

START_SAMPLES = 50
WINDOW_SAMPLES = 50
MOST_SAMPLES = 2000  # of the running mean of the gyro's bias: 20 s
GRAVITY_TOLERANCE_RATIO = 0.1  # a sample whose length is farther off (a wheel drops from a stone) is left out
UNKNOWN_RAD = 0.1
BIAS_MPS2 = 0.01  # 1 sigma of the accelerometer's bias at the start
BIAS_WALK = 2e-4  # m/s^2 per sqrt(s)
LEVEL_WALK = (6e-4, 1e-4)  # rad per sqrt(s): moving (noise and wander of the gyro's bias), standing
FORCE_MPS2 = (0.008, 0.002)  # 1 sigma of a window's mean force: moving, standing
SURPRISE_LIMIT = 25.0  # chi-square, 2 degrees of freedom: once in 3e5 windows


class Attitude:
    """Roll, pitch and yaw rate of the rover.

    roll_rad, pitch_rad: before `ready`, those of the mean force so far.
    yaw_rate_radps: about the map's vertical, with the starting bias removed; 0 before `ready`.
    force_bias_mps2: estimated bias of the accelerometer along x and y of the body.
    """

    def __init__(self) -> None:
        self.roll_rad = self.pitch_rad = self.yaw_rate_radps = 0.0
        self.force_bias_mps2 = (0.0, 0.0)
        self._samples = 0
        self._yaw_rad = 0.0  # since the start: direction of the level error in the body
        self._force = [0.0, 0.0, 0.0]
        self._forces, self._moved, self._since_s = 0, False, 0.0
        self._bias = [0.0, 0.0, 0.0]
        self._first_bias_radps = 0.0  # of yaw: the pose filter estimates later changes, here it serves the level alone
        self._gravity_mps2 = 0.0
        self._covariance = np.diag(np.square([UNKNOWN_RAD, UNKNOWN_RAD, BIAS_MPS2, BIAS_MPS2]))

    @property
    def ready(self) -> bool:
        """True once the starting means are complete."""
        return self._samples >= START_SAMPLES

    def update(self, imu: ImuSample, elapsed_s: float, standing: bool) -> None:
        """Process one sample.

        elapsed_s: time since the previous sample.
        standing: the wheels rest, so the gyro reads its bias.
        """
        if not self.ready:
            self._start(imu)
            return
        bias, tilt = self._bias, tan(self.pitch_rad)
        p, q, r = (rate - offset for rate, offset in zip(imu.gyro_radps, bias))
        sine, cosine, level = sin(self.roll_rad), cos(self.roll_rad), cos(self.pitch_rad)
        across = q * sine + r * cosine
        self.yaw_rate_radps = (across + (bias[2] - self._first_bias_radps) * cosine) / level
        self._yaw_rad += across / level * elapsed_s
        self.roll_rad += (p + across * tilt) * elapsed_s
        self.pitch_rad += (q * cosine - r * sine) * elapsed_s
        if standing:
            self._samples = min(self._samples + 1, MOST_SAMPLES)
            for k, rate in enumerate((p, q, r)):
                bias[k] += rate / self._samples
        self._moved = self._moved or not standing
        self._since_s += elapsed_s
        self._gather(imu)

    def doubt_bias(self) -> None:
        """Let new samples change the gyro's bias as fast as after the start, because the bias has changed."""
        self._samples = min(self._samples, START_SAMPLES)

    def known_now(self, roll_rad: float, pitch_rad: float, bias_mps2: tuple[float, float]) -> tuple[float, float]:
        """Roll and pitch of an earlier stop, corrected by the change of the estimated force bias since then.

        bias_mps2: the force bias that was estimated at that stop.
        """
        along, left = (now - then for now, then in zip(self.force_bias_mps2, bias_mps2))
        g = self._gravity_mps2
        pitch = along / (g * cos(pitch_rad))
        roll = (sin(roll_rad) * sin(pitch_rad) * pitch - left / g) / cos(roll_rad)
        return roll_rad + roll / cos(pitch_rad), pitch_rad + pitch

    def _gather(self, imu: ImuSample) -> None:
        ax, ay, az = imu.accel_mps2
        length = math.sqrt(ax * ax + ay * ay + az * az)
        if abs(length - self._gravity_mps2) <= GRAVITY_TOLERANCE_RATIO * self._gravity_mps2:
            level = cos(self.pitch_rad)  # per sample, because the rover may turn on a slope
            self._force[0] += ax + self._gravity_mps2 * sin(self.pitch_rad)
            self._force[1] += ay - self._gravity_mps2 * level * sin(self.roll_rad)
            self._forces += 1
        if self._forces >= WINDOW_SAMPLES:
            standing = not self._moved
            walk = np.array([LEVEL_WALK[standing]] * 2 + [BIAS_WALK] * 2)
            self._covariance += np.diag(np.square(walk) * self._since_s)
            self._level((self._force[0] / self._forces, self._force[1] / self._forces), standing)
            self._force, self._forces, self._moved, self._since_s = [0.0, 0.0, 0.0], 0, False, 0.0

    def _level(self, rest_mps2: tuple[float, float], standing: bool) -> None:
        """Correct level and bias (Kalman filter of their errors).

        rest_mps2: mean force along x and y of the body minus gravity at the estimated level.
        """
        g, yaw = self._gravity_mps2, self._yaw_rad
        sp, cp = sin(self.pitch_rad), cos(self.pitch_rad)
        sr, cr = sin(self.roll_rad), cos(self.roll_rad)
        heading = np.array([[cos(yaw), sin(yaw)], [-sin(yaw), cos(yaw)]])
        measures = np.hstack([product(g * np.array([[0.0, -cp], [cr, -sr * sp]]), heading), np.eye(2)])
        P = self._covariance
        noise, off = square(FORCE_MPS2[standing]) * np.eye(2), np.array(rest_mps2) - self.force_bias_mps2
        spread = chain(measures, P, measures.T) + noise
        if inner(off, solve(spread, off)) > SURPRISE_LIMIT:
            if not standing:  # the rover swings
                return
            # the gyro missed a tilt: level again from the accelerometer
            P[:2] = P[:, :2] = 0.0
            P[:2, :2] = square(UNKNOWN_RAD) * np.eye(2)
            spread = chain(measures, P, measures.T) + noise
        gain: F64 = solve(spread, product(measures, P)).T
        error = product(gain, off)
        about_x, about_y = product(heading, error[:2]).tolist()
        self.roll_rad += about_x / cp
        self.pitch_rad += about_y
        self.force_bias_mps2 = (self.force_bias_mps2[0] + float(error[2]), self.force_bias_mps2[1] + float(error[3]))
        self._covariance = P - chain(gain, spread, gain.T)

    def _start(self, imu: ImuSample) -> None:
        self._samples += 1
        for k in range(3):
            self._force[k] += (imu.accel_mps2[k] - self._force[k]) / self._samples
            self._bias[k] += (imu.gyro_radps[k] - self._bias[k]) / self._samples
        ax, ay, az = self._force
        self._gravity_mps2 = math.sqrt(ax * ax + ay * ay + az * az)
        self.roll_rad, self.pitch_rad = atan2(ay, az), atan2(-ax, hypot(ay, az))
        if self.ready:
            self._level((0.0, 0.0), standing=True)
            self._force, self._first_bias_radps = [0.0, 0.0, 0.0], self._bias[2]
