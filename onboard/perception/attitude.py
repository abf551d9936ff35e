"""Roll and pitch from the IMU: gyro over short times, gravity over long ones (a complementary filter).

The rover is slow, so over seconds the specific force is gravity's: at rest g * (-sin p, cos p sin r, cos p cos r). A
sample whose length is more than a tenth off gravity's (a wheel drops from a stone) is left out. Gravity's length and
the gyro's bias are the means of the first half second, while the rover stands.
"""

from __future__ import annotations

import math

from onboard.records import ImuSample

START_SAMPLES = 50
TIME_CONSTANT_S = 2.0
BIAS_TIME_CONSTANT_S = 20.0
GRAVITY_TOLERANCE_RATIO = 0.1


class Attitude:
    """roll_rad, pitch_rad, and yaw_rate_radps about the map's vertical with the starting bias taken out.

    Until `ready`, roll and pitch are those of the mean force so far, and the yaw rate is 0.
    """

    def __init__(self) -> None:
        self.roll_rad = self.pitch_rad = self.yaw_rate_radps = 0.0
        self._samples = 0
        self._force = [0.0, 0.0, 0.0]
        self._bias = [0.0, 0.0, 0.0]
        self._gravity_mps2 = 0.0

    @property
    def ready(self) -> bool:
        """Whether the starting means are complete."""
        return self._samples >= START_SAMPLES

    def update(self, imu: ImuSample, elapsed_s: float, standing: bool) -> None:
        """Takes one sample; `elapsed_s` since the last one. standing: the wheels rest, so the gyro reads its bias."""
        if not self.ready:
            self._start(imu)
            return
        roll, pitch, bias = self.roll_rad, self.pitch_rad, self._bias
        p, q, r = (rate - offset for rate, offset in zip(imu.gyro_radps, bias))
        sine, cosine = math.sin(roll), math.cos(roll)
        across = q * sine + r * cosine
        self.yaw_rate_radps = across / math.cos(pitch)
        roll += (p + across * math.tan(pitch)) * elapsed_s
        pitch += (q * cosine - r * sine) * elapsed_s
        ax, ay, az = imu.accel_mps2
        length = math.sqrt(ax * ax + ay * ay + az * az)
        if abs(length - self._gravity_mps2) <= GRAVITY_TOLERANCE_RATIO * self._gravity_mps2:
            share = min(1.0, elapsed_s / TIME_CONSTANT_S)
            roll += share * (math.atan2(ay, az) - roll)
            pitch += share * (math.atan2(-ax, math.hypot(ay, az)) - pitch)
        if standing:  # a gyro that stands reads its bias; that of yaw is the filter's to learn
            share = min(1.0, elapsed_s / BIAS_TIME_CONSTANT_S)
            bias[0] += share * p
            bias[1] += share * q
        self.roll_rad, self.pitch_rad = roll, pitch

    def _start(self, imu: ImuSample) -> None:
        self._samples += 1
        for k in range(3):
            self._force[k] += (imu.accel_mps2[k] - self._force[k]) / self._samples
            self._bias[k] += (imu.gyro_radps[k] - self._bias[k]) / self._samples
        ax, ay, az = self._force
        self._gravity_mps2 = math.sqrt(ax * ax + ay * ay + az * az)
        self.roll_rad, self.pitch_rad = math.atan2(ay, az), math.atan2(-ax, math.hypot(ay, az))
