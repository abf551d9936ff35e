"""One sampler for each row of protocol.tables.telemetry, and the MAVLink messages that carry the values."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from onboard.devices.lidar.clock import ClockQuality
from onboard.native.elementary import atan2, cos, hypot, sin
from onboard.records import Estimate, Event, Machine, PowerState, WheelCommand, WheelState
from protocol.conventions import cut
from protocol.generated import eldorado_dialect as mavlink
from protocol.link import events, versions
from protocol.link.versions import Versions
from protocol.mavlink_frames import frd_from_flu, ned_angles, ned_from_enu
from protocol.tables.modes import SEVERITIES, Mode, Phase
from protocol.tables.telemetry import BY_NAME, FRAMES, ITEMS_SLOTS, MESSAGES, TABLE

SYSTEM_ID, COMPONENT_ID = 1, 1
_NAN = math.nan


@dataclass(frozen=True, slots=True)
class TelemetryInputs:
    """Values of the rover that telemetry samples in one tick.

    goal_m: x, y in the map frame.
    fault_ids: numbers of the active rows.
    wheel_orders: as sent to the wheels; empty or four.
    slip_ratio: share of the wheels' travel that the body lacks.
    """

    mode: Mode = Mode.BOOT
    phase: Phase = Phase.NONE
    estimate: Estimate | None = None
    goal_m: tuple[float, float] | None = None
    stop: int = 0
    wheels: tuple[WheelState, ...] = ()
    power: PowerState | None = None
    fault_ids: tuple[int, ...] = ()
    lidar_good: int = 0
    lidar_bad: int = 0
    lidar_clock: ClockQuality = ClockQuality()
    tick_worst_ms: float = 0.0
    tick_late_ms: float = 0.0
    ticks_slipped: int = 0
    groups_over: int = 0
    jobs_late: int = 0
    link_received: int = 0
    link_refused: int = 0
    events_waiting: int = 0
    machine: Machine | None = None
    job: str = ""
    job_ratio: float = _NAN
    lease_station: int = 0
    key_epoch: int = 0
    wheel_orders: tuple[WheelCommand, ...] = ()
    slip_ratio: float = 0.0


Sampler = Callable[[TelemetryInputs], float]


def _pose(name: str) -> Sampler:
    return lambda v: _NAN if v.estimate is None else getattr(v.estimate.pose, name)


def _goal_distance_m(v: TelemetryInputs) -> float:
    if v.goal_m is None or v.estimate is None:
        return _NAN
    return hypot(v.goal_m[0] - v.estimate.pose.x_m, v.goal_m[1] - v.estimate.pose.y_m)


def _sigma_position_m(v: TelemetryInputs) -> float:
    return _NAN if v.estimate is None else math.sqrt(v.estimate.covariance[0, 0] + v.estimate.covariance[1, 1])


def _sigma_ellipse(v: TelemetryInputs) -> tuple[float, float, float]:
    """Return 1 sigma along the long axis and across it, m, and the direction of the long axis, rad; NaN: no estimate.

    Eigenvalues of the symmetric 2 x 2 covariance: middle +- radius, the long axis at half the angle of (xx - yy, 2 xy).
    """
    if v.estimate is None:
        return _NAN, _NAN, _NAN
    xx, xy, yy = (float(v.estimate.covariance[at]) for at in ((0, 0), (0, 1), (1, 1)))
    middle, radius = (xx + yy) / 2, hypot((xx - yy) / 2, xy)
    axis_rad = atan2(2 * xy, xx - yy) / 2
    return math.sqrt(max(0.0, middle + radius)), math.sqrt(max(0.0, middle - radius)), axis_rad


def _ellipse(at: int) -> Sampler:
    return lambda v: _sigma_ellipse(v)[at]


def _order(name: str, n: int) -> Sampler:
    return lambda v: _NAN if len(v.wheel_orders) < n else getattr(v.wheel_orders[n - 1], name)


def _wheel(name: str, n: int) -> Sampler:
    missing = 0.0 if name == "state" else _NAN
    return lambda v: missing if len(v.wheels) < n else getattr(v.wheels[n - 1], name)


def _power(name: str) -> Sampler:
    return lambda v: _NAN if v.power is None else getattr(v.power, name)


def _machine(name: str, unit: float = 1.0) -> Sampler:
    return lambda v: _NAN if v.machine is None else getattr(v.machine, name) / unit


def _version(name: str) -> Sampler:
    ours: int = getattr(versions.OURS, name)
    return lambda v: ours


_LIDAR_CLOCK: dict[str, Callable[[ClockQuality], float]] = {
    "offset_s": lambda q: q.offset_ns * 1e-9 if q.samples else _NAN,
    "ppm": lambda q: q.ppm if q.samples else _NAN,
    "sigma_ms": lambda q: q.sigma_ns * 1e-6 if math.isfinite(q.sigma_ns) else _NAN,
    "samples": lambda q: q.samples,
    "breaks": lambda q: q.jumps + q.reboots,
}


def _lidar_clock(name: str) -> Sampler:
    return lambda v: _LIDAR_CLOCK[name](v.lidar_clock)


SAMPLERS: dict[str, Sampler] = {
    "mode": lambda v: v.mode,
    "phase": lambda v: v.phase,
    "stop": lambda v: v.stop,
    "faults": lambda v: sum(1 << i for i in set(v.fault_ids) if 0 <= i < 64),
    "goal_x_m": lambda v: _NAN if v.goal_m is None else v.goal_m[0],
    "goal_y_m": lambda v: _NAN if v.goal_m is None else v.goal_m[1],
    "goal_distance_m": _goal_distance_m,
    "speed_mps": lambda v: _NAN if v.estimate is None else v.estimate.speed_mps,
    "sigma_position_m": _sigma_position_m,
    "sigma_yaw_rad": lambda v: _NAN if v.estimate is None else math.sqrt(v.estimate.covariance[3, 3]),
    **{name: _pose(name) for name in ("x_m", "y_m", "z_m", "roll_rad", "pitch_rad", "yaw_rad")},
    "yaw_rate_radps": lambda v: _NAN if v.estimate is None else v.estimate.yaw_rate_radps,
    **{f"steer_{n}_rad": _wheel("steer_rad", n) for n in (1, 2, 3, 4)},
    **{f"rate_{n}_radps": _wheel("rate_radps", n) for n in (1, 2, 3, 4)},
    **{f"wheel_state_{n}": _wheel("state", n) for n in (1, 2, 3, 4)},
    "voltage_v": _power("voltage_v"),
    "current_a": _power("current_a"),
    "charge_ratio": _power("charge_ratio"),
    "battery_temperature_c": _power("temperature_c"),
    "lidar_good": lambda v: v.lidar_good,
    "lidar_bad": lambda v: v.lidar_bad,
    **{f"lidar_clock_{name}": _lidar_clock(name) for name in _LIDAR_CLOCK},
    "tick_worst_ms": lambda v: v.tick_worst_ms,
    "tick_late_ms": lambda v: v.tick_late_ms,
    "ticks_slipped": lambda v: v.ticks_slipped,
    "groups_over": lambda v: v.groups_over,
    "jobs_late": lambda v: v.jobs_late,
    "cpu_ratio": _machine("cpu_ratio"),
    "process_ratio": _machine("process_ratio"),
    "rss_mb": _machine("rss_bytes", 1e6),
    "free_memory_mb": _machine("free_memory_bytes", 1e6),
    "computer_temperature_c": _machine("temperature_c"),
    "free_disk_mb": _machine("free_disk_bytes", 1e6),
    "link_received": lambda v: v.link_received,
    "link_refused": lambda v: v.link_refused,
    "events_waiting": lambda v: v.events_waiting,
    "job_ratio": lambda v: v.job_ratio,
    **{f"{name}_version": _version(name) for name in Versions._fields},
    "lease_station": lambda v: v.lease_station,
    "key_epoch": lambda v: v.key_epoch,
    "sigma_major_m": _ellipse(0),
    "sigma_minor_m": _ellipse(1),
    "sigma_axis_rad": _ellipse(2),
    "slip_ratio": lambda v: v.slip_ratio,
    **{f"steer_ordered_{n}_rad": _order("steer_rad", n) for n in (1, 2, 3, 4)},
    **{f"rate_ordered_{n}_radps": _order("rate_radps", n) for n in (1, 2, 3, 4)},
}
_NAMES = {message: tuple(row.name for row in TABLE if row.message == message) for message in MESSAGES}


def _read(message: str, view: TelemetryInputs) -> list[float]:
    return [SAMPLERS[name](view) for name in _NAMES[message]]


def _rover_state(view: TelemetryInputs, ms: int) -> list[Any]:
    mode, phase, stop, faults, *rest = _read("ROVER_STATE", view)
    return [mavlink.MAVLink_rover_state_message(ms, int(faults), *rest, int(stop) & 0xFFFF, int(mode), int(phase))]


def _position(view: TelemetryInputs, ms: int) -> list[Any]:
    x_m, y_m, z_m = _read("LOCAL_POSITION_NED", view)
    if view.estimate is None:
        return []
    yaw_rad, speed_mps = view.estimate.pose.yaw_rad, view.estimate.speed_mps
    velocity = ned_from_enu(speed_mps * cos(yaw_rad), speed_mps * sin(yaw_rad), 0.0)
    return [mavlink.MAVLink_local_position_ned_message(ms, *ned_from_enu(x_m, y_m, z_m), *velocity)]


def _attitude(view: TelemetryInputs, ms: int) -> list[Any]:
    roll_rad, pitch_rad, yaw_rad, yaw_rate_radps = _read("ATTITUDE", view)
    if view.estimate is None:
        return []
    rates = frd_from_flu(0.0, 0.0, yaw_rate_radps)
    return [mavlink.MAVLink_attitude_message(ms, *ned_angles(roll_rad, pitch_rad, yaw_rad), *rates)]


def _wheels(view: TelemetryInputs, ms: int) -> list[Any]:
    read = _read("WHEELS", view)
    return [mavlink.MAVLink_wheels_message(ms, read[:4], read[4:8], [int(s) & 0xFF for s in read[8:]])]


def _sys_status(view: TelemetryInputs, ms: int) -> list[Any]:
    if view.power is None:
        return []
    scaled = [
        round(value * BY_NAME[name].scale) for name, value in zip(_NAMES["SYS_STATUS"], _read("SYS_STATUS", view))
    ]
    milli_v, centi_a, percent = (
        min(max(v, low), high) for v, low, high in zip(scaled, (0, -32768, 0), (65535, 32767, 100))
    )
    return [mavlink.MAVLink_sys_status_message(0, 0, 0, 0, milli_v, centi_a, percent, 0, 0, 0, 0, 0, 0)]


def _progress(view: TelemetryInputs, ms: int) -> list[Any]:
    return [mavlink.MAVLink_progress_message(ms, view.job_ratio, view.job.encode()[:16])] if view.job else []


def _link_state(view: TelemetryInputs, ms: int) -> list[Any]:
    return [mavlink.MAVLink_link_state_message(ms, *(int(value) for value in _read("LINK_STATE", view)))]


def _items(view: TelemetryInputs, ms: int) -> list[Any]:
    made = []
    for part in (rows for message, rows in FRAMES if not message):
        ids, read = [row.id for row in part], [float(SAMPLERS[row.name](view)) for row in part]
        empty = [0] * (ITEMS_SLOTS - len(part))
        made.append(mavlink.MAVLink_items_message(ms, read + [0.0] * len(empty), ids + empty))
    return made


def _heartbeat(view: TelemetryInputs, ms: int) -> list[Any]:
    """custom_mode is mode * 256 + phase."""
    kind, pilot, custom = mavlink.MAV_TYPE_GROUND_ROVER, mavlink.MAV_AUTOPILOT_GENERIC, view.mode << 8 | view.phase
    flags = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    return [mavlink.MAVLink_heartbeat_message(kind, pilot, flags, custom, _STATUS[view.mode], 3)]


_BUILDERS: dict[str, Callable[[TelemetryInputs, int], list[Any]]] = {
    "HEARTBEAT": _heartbeat,
    "ROVER_STATE": _rover_state,
    "LOCAL_POSITION_NED": _position,
    "ATTITUDE": _attitude,
    "LINK_STATE": _link_state,
    "WHEELS": _wheels,
    "SYS_STATUS": _sys_status,
    "PROGRESS": _progress,
    "": _items,
}
_ACTIVE, _STANDBY, _CRITICAL = mavlink.MAV_STATE_ACTIVE, mavlink.MAV_STATE_STANDBY, mavlink.MAV_STATE_CRITICAL
_STATUS = {
    Mode.BOOT: mavlink.MAV_STATE_BOOT,
    Mode.STANDBY: _STANDBY,
    Mode.AUTONOMOUS: _ACTIVE,
    Mode.SAFE: _CRITICAL,
    Mode.ESTOP: _CRITICAL,
    Mode.TELEOP: _ACTIVE,
    Mode.SEQUENCE: _ACTIVE,
}
_SEVERITY = dict(zip(SEVERITIES, (7, 6, 4, 3, 2)))


class Packer:
    """Packer of values into MAVLink 2 frames; the only state is the sequence number."""

    def __init__(self) -> None:
        self._mav = mavlink.MAVLink(None, SYSTEM_ID, COMPONENT_ID)

    def _pack(self, message: Any) -> bytes:
        frame: bytes = message.pack(self._mav)
        self._mav.seq = (self._mav.seq + 1) % 256
        return frame

    def message(self, name: str, view: TelemetryInputs, now_ns: int) -> list[bytes]:
        """Frames of HEARTBEAT or of a row of protocol.tables.telemetry.MESSAGES; none if there is no source."""
        return [self._pack(m) for m in _BUILDERS[name](view, now_ns // 1_000_000 & 0xFFFFFFFF)]

    def event(self, event: Event, serial: int) -> bytes:
        """Return the EVENT frame; a text longer than the field is cut at a whole character."""
        text = cut(event.text, events.TEXT_BYTES)
        return self._pack(
            mavlink.MAVLink_event_message(
                event.now_ns // 1000, serial, _SEVERITY.get(event.severity, 6), event.name.encode()[:24], text
            )
        )
