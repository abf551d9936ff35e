"""TABLE of the devices in SYS_STATUS: telemetry that shows each one present, enabled and healthy.

Nothing is invented: until the rover has reported its faults no device is present, and a device that no telemetry shows
stays absent. A fault that is masked on board is not reported, so it makes no device unhealthy.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from ground.gateway.frames import mavlink as m
from protocol.tables.faults import named
from protocol.tables.modes import TABLE as MODES

if TYPE_CHECKING:
    from ground.gateway.vehicle_state import VehicleState

_GRACE_NS = 1_000_000_000  # in which a starting rover reports no IMU_DEAD yet
_RATES = tuple(f"rate_{n}_radps" for n in (1, 2, 3, 4))


class Masks(NamedTuple):
    """The three fields of SYS_STATUS, each a mask of MAV_SYS_STATUS_SENSOR bits."""

    present: int = 0
    enabled: int = 0
    healthy: int = 0


class Device(NamedTuple):
    """One row.

    bit: of MAV_SYS_STATUS_SENSOR.
    there: True if telemetry shows the device.
    faults: rows of the fault table that make it unhealthy.
    means: the condition of `there`, in words.
    off: True if the device has no power in modes whose wheels are off.
    """

    bit: int
    there: Callable[[VehicleState], bool]
    faults: tuple[str, ...]
    means: str
    off: bool = False


def _imu(seen: VehicleState) -> bool:
    return seen.onboard_ns > _GRACE_NS


DEVICES = (
    Device(m.MAV_SYS_STATUS_SENSOR_3D_GYRO, _imu, ("IMU_DEAD", "IMU_BIAS", "CAN_BUS_OFF"), "the rover reports faults"),
    Device(m.MAV_SYS_STATUS_SENSOR_3D_ACCEL, _imu, ("IMU_DEAD", "CAN_BUS_OFF"), "the rover reports faults"),
    Device(
        m.MAV_SYS_STATUS_SENSOR_LASER_POSITION,
        lambda seen: (seen.number("lidar_good") or 0.0) > 0.0,
        ("LIDAR_SILENT", "LIDAR_GARBLED", "LIDAR_DIRTY", "LIDAR_CLOCK"),
        "the scanner gave a frame in this start",
    ),
    Device(
        m.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS,
        lambda seen: any(seen.number(name) is not None for name in _RATES),
        (
            "WHEEL_STALE",
            "WHEEL_SILENT",
            "ENCODER_BAD",
            "WHEEL_STUCK",
            "WHEEL_FREE",
            "WHEEL_WEAK",
            "STEER_STUCK",
            "STEER_OFFSET",
            "CAN_BUS_OFF",
        ),
        "a wheel tells its rate",
        off=True,
    ),
    Device(
        m.MAV_SYS_STATUS_SENSOR_BATTERY,
        lambda seen: seen.number("voltage_v") is not None,
        ("POWER_LOW", "BROWN_OUT"),
        "the power node tells its voltage",
    ),
    Device(m.MAV_SYS_STATUS_AHRS, lambda seen: seen.number("x_m") is not None, ("POSE_UNSURE",), "a pose is told"),
)


def masks(seen: VehicleState) -> Masks:
    """Return the masks of devices present, enabled and healthy, from the telemetry so far."""
    told = seen.number("faults")
    if told is None:
        return Masks()
    active = set(named(int(told)))
    off = {row.mode for row in MODES if row.wheels == "off"}
    present = enabled = healthy = 0
    for device in DEVICES:
        if device.there(seen):
            present |= device.bit
            enabled |= 0 if device.off and seen.mode in off else device.bit
            healthy |= device.bit if active.isdisjoint(device.faults) else 0
    return Masks(present, enabled, healthy)
