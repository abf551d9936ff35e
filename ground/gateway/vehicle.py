"""Messages of the common set that show the rover to ground programs, from the values that the session knows.

Nothing is invented: an unknown value is sent as MAVLink's "unknown", and a message whose values have not arrived is not
sent. HEARTBEAT stops while the rover is silent, so that a ground program detects the loss of contact itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

from ground.gateway.desks.modes import custom_mode
from ground.gateway.frames import mavlink as m
from ground.gateway.health import masks
from ground.gateway.origin import e7
from ground.gateway.vehicle_state import VehicleState
from protocol.mavlink_frames import frd_from_flu, ned_angles, ned_from_enu
from protocol.tables.modes import Mode

_STATES = {
    Mode.BOOT: m.MAV_STATE_BOOT, Mode.STANDBY: m.MAV_STATE_STANDBY, Mode.AUTONOMOUS: m.MAV_STATE_ACTIVE,
    Mode.TELEOP: m.MAV_STATE_ACTIVE, Mode.SEQUENCE: m.MAV_STATE_ACTIVE, Mode.SAFE: m.MAV_STATE_CRITICAL,
    Mode.ESTOP: m.MAV_STATE_EMERGENCY,
}  # fmt: skip
_CAPABILITIES = (
    m.MAV_PROTOCOL_CAPABILITY_MISSION_INT
    | m.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
    | m.MAV_PROTOCOL_CAPABILITY_MAVLINK2
    | m.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST
    | m.MAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION
)
_UNKNOWN_16, _MOST_32 = 65_535, 2**31 - 1


def heartbeat(seen: VehicleState) -> Any:
    """Make HEARTBEAT of a rover; armed: enabled at this gateway, or its wheels run."""
    mode = seen.mode
    base = m.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    if seen.armed:
        base |= m.MAV_MODE_FLAG_SAFETY_ARMED
    if mode in (Mode.AUTONOMOUS, Mode.SEQUENCE):
        base |= m.MAV_MODE_FLAG_AUTO_ENABLED | m.MAV_MODE_FLAG_GUIDED_ENABLED
    state = m.MAV_STATE_UNINIT if mode is None else _STATES[mode]
    return m.MAVLink_heartbeat_message(
        m.MAV_TYPE_GROUND_ROVER, m.MAV_AUTOPILOT_GENERIC, base, 0 if mode is None else custom_mode(mode), state, 3
    )


def _local(seen: VehicleState) -> Any:
    place = seen.all("x_m", "y_m", "z_m")
    if place is None:
        return None
    return m.MAVLink_local_position_ned_message(seen.boot_ms, *ned_from_enu(*place), *_velocity(seen))


def _velocity(seen: VehicleState) -> tuple[float, float, float]:
    known = seen.all("speed_mps", "yaw_rad")
    if known is None:
        return 0.0, 0.0, 0.0
    speed_mps, yaw_rad = known
    return ned_from_enu(speed_mps * math.cos(yaw_rad), speed_mps * math.sin(yaw_rad), 0.0)


def _heading_deg(seen: VehicleState) -> float | None:
    yaw_rad = seen.number("yaw_rad")
    return None if yaw_rad is None else math.degrees(ned_angles(0.0, 0.0, yaw_rad)[2]) % 360.0


def _global(seen: VehicleState) -> Any:
    place = seen.all("x_m", "y_m", "z_m")
    if place is None:
        return None
    lat, lon, height_m = seen.origin.globe(*place)
    heading_deg = _heading_deg(seen)
    heading = _UNKNOWN_16 if heading_deg is None else round(heading_deg * 100) % 36_000
    velocity = [_whole(v * 100, -32_768, 32_767) for v in _velocity(seen)]
    heights = [_whole(v * 1000, -_MOST_32, _MOST_32) for v in (height_m, place[2])]
    return m.MAVLink_global_position_int_message(seen.boot_ms, e7(lat), e7(lon), *heights, *velocity, heading)


def _attitude(seen: VehicleState) -> Any:
    angles = seen.all("roll_rad", "pitch_rad", "yaw_rad")
    if angles is None:
        return None
    rate_radps = seen.number("yaw_rate_radps") or 0.0
    return m.MAVLink_attitude_message(seen.boot_ms, *ned_angles(*angles), *frd_from_flu(0.0, 0.0, rate_radps))


def _hud(seen: VehicleState) -> Any:
    speed_mps, z_m = seen.number("speed_mps"), seen.number("z_m")
    heading_deg = _heading_deg(seen)
    if speed_mps is None or heading_deg is None or z_m is None:
        return None
    height_m = seen.origin.height_m + z_m
    return m.MAVLink_vfr_hud_message(0.0, abs(speed_mps), round(heading_deg) % 360, 0, height_m, 0.0)


def _status(seen: VehicleState) -> Any:
    if seen.values.get("voltage_v") is None:
        return None
    voltage_v, current_a, charge = (seen.number(n) for n in ("voltage_v", "current_a", "charge_ratio"))
    load = seen.number("cpu_ratio") or 0.0
    return m.MAVLink_sys_status_message(
        *masks(seen),
        _whole(load * 1000, 0, 1000),
        _UNKNOWN_16 if voltage_v is None else _whole(voltage_v * 1000, 0, _UNKNOWN_16 - 1),
        -1 if current_a is None else _whole(current_a * 100, -32_768, 32_767),
        -1 if charge is None else _whole(charge * 100, 0, 100),
        0,
        0,
        0,
        0,
        0,
        0,
    )


def _whole(value: float, low: int, high: int) -> int:
    """Round to the nearest integer within the range of the field."""
    return round(min(max(value, low), high))


def _home(seen: VehicleState) -> Any:
    origin = seen.origin
    return m.MAVLink_home_position_message(
        e7(origin.latitude_deg),
        e7(origin.longitude_deg),
        round(origin.height_m * 1000),
        0.0,
        0.0,
        0.0,
        [1.0, 0.0, 0.0, 0.0],
        0.0,
        0.0,
        0.0,
    )


def _origin(seen: VehicleState) -> Any:
    origin = seen.origin
    return m.MAVLink_gps_global_origin_message(
        e7(origin.latitude_deg), e7(origin.longitude_deg), round(origin.height_m * 1000)
    )


def _version(seen: VehicleState) -> Any:
    return m.MAVLink_autopilot_version_message(_CAPABILITIES, 0, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, 0)


class Shown(NamedTuple):
    """One message.

    make: returns the message, or None if its values are not known.
    items: items whose news send it; empty: only on request.
    """

    make: Callable[[VehicleState], Any]
    items: tuple[str, ...] = ()


MESSAGES: dict[str, Shown] = {
    "HEARTBEAT": Shown(heartbeat),
    "LOCAL_POSITION_NED": Shown(_local, ("x_m",)),
    "GLOBAL_POSITION_INT": Shown(_global, ("x_m",)),
    "ATTITUDE": Shown(_attitude, ("yaw_rad",)),
    "VFR_HUD": Shown(_hud, ("speed_mps",)),
    "SYS_STATUS": Shown(_status, ("voltage_v",)),
    "HOME_POSITION": Shown(_home),
    "GPS_GLOBAL_ORIGIN": Shown(_origin),
    "AUTOPILOT_VERSION": Shown(_version),
}


def told_by(seen: VehicleState, news: Iterable[str]) -> list[Any]:
    """Return the messages triggered by news of items, each at most once."""
    fresh = set(news)
    made = [shown.make(seen) for shown in MESSAGES.values() if fresh.intersection(shown.items)]
    return [message for message in made if message is not None]
