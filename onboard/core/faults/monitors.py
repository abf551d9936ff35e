"""Fault monitors: one small function for each row of protocol.tables.faults says whether the fault is raised."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import NamedTuple

from onboard.config import Config
from onboard.core.faults import can as can_monitors
from onboard.core.faults.computer import COMPUTER_ROWS
from onboard.core.faults.devices.watch import DEVICE_ROWS
from onboard.core.faults.power import POWER_ROWS
from onboard.core.faults.wheels.watch import WHEEL_ROWS
from onboard.devices.lidar.session import LidarSession
from onboard.devices.nodes import Nodes
from onboard.planning.mission_rule import RECORD_STOPS
from onboard.planning.plan_records import PlanResult
from onboard.records import Pose, RecordStatus, RecordTrouble
from protocol.link.events import TEXT_BYTES
from protocol.link.transactions import Order
from protocol.tables.faults import BY_NAME

_GRACE_NS = 1_000_000_000  # from the start until a node must have sent
_HEARTBEAT_NS = 1_500_000_000
_IMU_NS = 30_000_000
_HALTING = frozenset({"stop", "safe", "emergency_stop"})


class MonitorInputs(NamedTuple):
    """Inputs of the monitors in one tick."""

    now_ns: int
    config: Config
    lidar: LidarSession
    nodes: Nodes
    pose: Pose
    pose_sigma: tuple[float, float]
    last_contact_ns: int
    overdue_ticks: int
    in_mission: bool
    hazard: bool
    keep_out: str = ""  # name of the fence that the rover's outline touches
    found: Collection[str] = ()  # rows found by a watch: wheels, devices, power, computer
    plan: PlanResult | None = None  # newest result of the mission that runs, or of the last one
    orders: Sequence[Order] = ()  # received in this tick
    record: RecordStatus = RecordStatus()


def _lidar_silent(w: MonitorInputs) -> bool:
    return w.lidar.silent(w.now_ns)


def _wheels_older_than(w: MonitorInputs, limit_ns: int) -> bool:
    return w.now_ns > _GRACE_NS and any(w.nodes.wheel_age_ns(n, w.now_ns) > limit_ns for n in (1, 2, 3, 4))


def _wheel_stale(w: MonitorInputs) -> bool:
    return _wheels_older_than(w, w.config.can.stale_ns)


def _wheel_silent(w: MonitorInputs) -> bool:
    return _wheels_older_than(w, w.config.can.silent_ns)


def _node_lost(w: MonitorInputs) -> bool:
    return w.now_ns > 2 * _HEARTBEAT_NS and any(
        w.nodes.heartbeat_age_ns(node, w.now_ns) > _HEARTBEAT_NS for node in ("TILT", "IMU", "POWER")
    )


def _imu_dead(w: MonitorInputs) -> bool:
    return w.now_ns > _GRACE_NS and w.nodes.imu_age_ns(w.now_ns) > _IMU_NS


def _tilt_angle(w: MonitorInputs) -> bool:
    limit = w.config.safety.tilt_limit_rad
    return abs(w.pose.roll_rad) > limit or abs(w.pose.pitch_rad) > limit


def _pose_unsure(w: MonitorInputs) -> bool:
    limits = w.config.safety.pose_sigma_m, w.config.safety.heading_sigma_rad
    return w.in_mission and any(sigma > limit for sigma, limit in zip(w.pose_sigma, limits))


def _command_lost(w: MonitorInputs) -> bool:
    return w.in_mission and w.now_ns - w.last_contact_ns > w.config.safety.command_lost_ns


def _job_late(w: MonitorInputs) -> bool:
    return w.overdue_ticks > 0


def _estop_pressed(w: MonitorInputs) -> bool:
    return w.nodes.emergency is not None


def _found(name: str) -> Callable[[MonitorInputs], bool]:
    return lambda w: name in w.found


def _of_nodes(monitor: Callable[[Nodes], bool]) -> Callable[[MonitorInputs], bool]:
    return lambda w: monitor(w.nodes)


def _hazard_ahead(w: MonitorInputs) -> bool:
    return w.hazard


def _keep_out(w: MonitorInputs) -> bool:
    return bool(w.keep_out)


def _no_path(w: MonitorInputs) -> bool:
    return w.plan is not None and w.plan.decision.kind == "unreachable"


def _loop(w: MonitorInputs) -> bool:
    """True if R10 overrules a strategy; not for `optimistic`: it is R5 alone, and a detour lowers nothing at first."""
    mission = w.config.mission
    guarded = w.in_mission and mission.guard and mission.strategy != "optimistic"
    return guarded and w.plan is not None and w.plan.state.since_record >= RECORD_STOPS


def _operator(w: MonitorInputs) -> bool:
    return any(order.name in _HALTING for order in w.orders)


def _disk_full(w: MonitorInputs) -> bool:
    return w.record.trouble is RecordTrouble.FULL


def _record_fail(w: MonitorInputs) -> bool:
    return w.record.trouble is RecordTrouble.FAILED


MONITORS: Mapping[str, Callable[[MonitorInputs], bool]] = {
    "LIDAR_SILENT": _lidar_silent,
    "WHEEL_STALE": _wheel_stale,
    "WHEEL_SILENT": _wheel_silent,
    "NODE_LOST": _node_lost,
    "IMU_DEAD": _imu_dead,
    "TILT_ANGLE": _tilt_angle,
    "COMMAND_LOST": _command_lost,
    "JOB_LATE": _job_late,
    "ESTOP_PRESSED": _estop_pressed,
    **{name: _of_nodes(monitor) for name, monitor in can_monitors.MONITORS.items()},
    "POSE_UNSURE": _pose_unsure,
    "HAZARD_AHEAD": _hazard_ahead,
    "KEEP_OUT": _keep_out,
    "NO_PATH": _no_path,
    "LOOP": _loop,
    "OPERATOR": _operator,
    "DISK_FULL": _disk_full,
    "RECORD_FAIL": _record_fail,
    **{name: _found(name) for name in (*WHEEL_ROWS, *DEVICE_ROWS, *POWER_ROWS, *COMPUTER_ROWS)},
}


def active_faults(watched: MonitorInputs) -> tuple[str, ...]:
    """Names of the faults active now, in the table's order, without those that another active fault explains."""
    found = {name for name, monitor in MONITORS.items() if monitor(watched)}
    if not found:
        return ()
    return tuple(name for name in BY_NAME if name in found and not found.intersection(BY_NAME[name].suppressed_by))


def over_limit(nodes: Nodes, used_up: Collection[str], active: tuple[str, ...]) -> frozenset[str]:
    """Return the active faults that have used up their tries or passed their second limit."""
    return frozenset(
        name for name in active if name in used_up or (name in can_monitors.LIMITS and can_monitors.LIMITS[name](nodes))
    )


def words(nodes: Nodes, seen: str, name: str) -> str:
    """Text of an active fault: its condition, then the details from its monitor or from `seen` if there are any.

    If both are longer than an event on the link allows, the details come first: the fault table has the condition.
    """
    more = can_monitors.WORDS[name](nodes) if name in can_monitors.WORDS else seen
    condition = BY_NAME[name].condition
    both = f"{name}: {condition}" + (f" ({more})" if more else "")
    return both if not more or len(both.encode()) <= TEXT_BYTES else f"{name}: {more} ({condition})"
