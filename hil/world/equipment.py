"""Equipment of a run for its summary: scanner, soil and noise, read from the devices and the plant."""

from __future__ import annotations

from typing import Any

from hil.devices.can.errors import SensorErrors
from hil.devices.lidar.profile import Profile
from hil.devices.lidar.sensor import Lidar
from hil.world.world import World


def equipment(world: World) -> dict[str, Any]:
    """Summary's `scanner`, `soil` and `sensor_noise`."""
    plant, profile = world.plant, world.lidar.profile
    return {
        "scanner": scanner(world.lidar),
        "soil": plant.soil + (", changed in places or for a time" if plant.patches.changes else ""),
        "sensor_noise": f"{_light_noise(profile)}; {_node_noise(world.fitting.sensors)}",
    }


def scanner(lidar: Lidar) -> dict[str, Any]:
    """Profile and clock as configured; ratios as measured in this run.

    lost_ratio: share of the due beams that returned nothing; a beam is due if it is in the sector that the rover maps
        and its surface is within near_m to far_m
    lost_by: the same by cause
    outlier_ratio, mixed_ratio, speck_ratio: shares of the due beams that returned something
    """
    profile, count = lidar.profile, lidar.optics.light.count
    return {
        "profile": profile.name,
        "lost_ratio": round(count.lost_ratio, 6),
        "lost_by": {name: round(lost / count.due, 6) if count.due else 0.0 for name, lost in count.lost.items()},
        "outlier_ratio": round(count.ratio(count.outliers), 6),
        "mixed_ratio": round(count.ratio(count.mixed), 6),
        "speck_ratio": round(count.ratio(count.specks), 6),
        "rate_error_ppm": round(profile.rate_error * 1e6, 3),
        "motor_jitter_s": profile.motor_jitter_ns * 1e-9,
        "latency_s": profile.latency_ns * 1e-9,
        "turns": count.turns,
        "beams_due": count.due,
    }


def _light_noise(profile: Profile) -> str:
    return f"LIDAR {1e3 * profile.noise_near_m:.0f} mm to 10 m, {1e3 * profile.noise_far_m:.0f} mm beyond"


def _node_noise(errors: SensorErrors) -> str:
    wheel, tilt, imu = errors.wheel, errors.tilt, errors.imu
    return (
        f"steering pots {wheel.pot_noise_rad:g} rad, offset {wheel.pot_offset_rad:g} rad; "
        f"wheel rates {wheel.rate_noise_radps:g} rad/s; tilt encoder steps {tilt.encoder_step_rad:.4g} rad, "
        f"play {tilt.backlash_rad:g} rad; gyro {imu.gyro_noise_radps:g} rad/s, bias {imu.gyro_bias_radps:g} rad/s; "
        f"accelerometer {imu.accel_noise_mps2:g} m/s2, bias {imu.accel_bias_mps2:g} m/s2"
    )
