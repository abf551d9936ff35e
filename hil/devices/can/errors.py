"""TABLE of the errors of the emulated nodes: noise, offsets, lags, limits. A scenario's [sensors] may change each.

    [sensors.imu]
    lever_x_m = 0.12

Sources: [DBC] the range of the wire; [STUDY] the study of scanner and tilt axis, 4096 counts a turn and backlash as of
a small servo; [?] no source, a plain guess for the class of part: no parts of a real rover were measured. Sigma: one
standard deviation. Errors of the scanner: hil/devices/lidar/profile.py.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from onboard.config import value


@dataclass(frozen=True, slots=True)
class WheelErrors:
    """Errors of each wheel node."""

    pot_noise_rad: float = value(0.0005, "[?] steering pot, sigma of a sample", low=0, high=0.1)
    pot_offset_rad: float = value(0.001, "[?] steering pot, sigma of its offset, drawn once", low=0, high=0.1)
    rate_noise_radps: float = value(0.003, "[?] wheel rate, sigma of a sample", low=0, high=1)
    current_noise_a: float = value(0.02, "[?] drive and steering current, sigma of a sample", low=0, high=5)


@dataclass(frozen=True, slots=True)
class TiltErrors:
    """Errors of the scanner's tilt axis."""

    lag_s: float = value(0.003, "[?] time constant of the servo", low=1e-4, high=0.5)
    encoder_step_rad: float = value(math.tau / 4096, "[STUDY] of the motor's encoder; 0: none", low=0, high=0.1)
    backlash_rad: float = value(0.0, "[STUDY] play between motor and scanner, from end to end", low=0, high=0.1)
    rate_error_ratio: float = value(50e-6, "[?] error of the node's clock, drawn once up to this", low=0, high=1e-3)


@dataclass(frozen=True, slots=True)
class ImuErrors:
    """Errors of the inertial sensor. lever: its place relative to base_link, in base axes."""

    lever_x_m: float = value(0.0, "[?] ahead of base_link; the flight program takes 0 for granted", low=-3, high=3)
    lever_y_m: float = value(0.0, "[?] left of it", low=-3, high=3)
    lever_z_m: float = value(0.0, "[?] above it", low=-3, high=3)
    gyro_noise_radps: float = value(0.001, "[?] sigma of a sample at 100 Hz", low=0, high=1)
    gyro_bias_radps: float = value(0.0005, "[?] sigma of the bias, drawn once an axis", low=0, high=1)
    gyro_walk_radps: float = value(2e-6, "[?] sigma of the bias's step in 10 ms", low=0, high=1)
    accel_noise_mps2: float = value(0.01, "[?] sigma of a sample at 100 Hz", low=0, high=10)
    accel_bias_mps2: float = value(0.01, "[?] sigma of the bias, drawn once an axis", low=0, high=10)
    accel_walk_mps2: float = value(2e-5, "[?] sigma of the bias's step in 10 ms", low=0, high=10)
    scale_error_ratio: float = value(0.001, "[?] sigma of each axis's scale, drawn once", low=0, high=0.2)
    gyro_limit_radps: float = value(3.2767, "[DBC] saturation", low=0.01, high=3.2767)
    accel_limit_mps2: float = value(32.767, "[DBC] saturation", low=0.01, high=32.767)


@dataclass(frozen=True, slots=True)
class PowerErrors:
    """Errors of battery and power node; its faults are separate."""

    capacity_j: float = value(500.0 * 3600.0, "[?] of the full battery", low=1e3, high=1e9)
    start_ratio: float = value(0.95, "[?] charge at the start", low=0, high=1)
    rest_w: float = value(35.0, "[?] what all but the wheels takes", low=0, high=1e4)
    inner_ohm: float = value(0.08, "[?] inner resistance", low=0, high=10)
    efficiency_ratio: float = value(0.6, "[?] of drive, motor and gear", low=0.01, high=1)
    current_noise_a: float = value(0.01, "[?] sigma of a sample", low=0, high=5)
    brown_out_v: float = value(20.0, "[?] voltage under which the brown-out bit is set", low=0, high=40)


@dataclass(frozen=True, slots=True)
class SensorErrors:
    """Errors of all nodes."""

    wheel: WheelErrors = WheelErrors()
    tilt: TiltErrors = TiltErrors()
    imu: ImuErrors = ImuErrors()
    power: PowerErrors = PowerErrors()


USUAL = SensorErrors()
