"""Report of `onboard status`: one dictionary of plain values, from the state of the core and of the shell."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from onboard.core.rover import Rover
from onboard.core.schedule import GROUPS
from onboard.core.tick_timing import Pace, quantile_us
from onboard.drivers.platform.realtime import Grant
from onboard.records import Machine

SHARES = {"p50": 0.5, "p99": 0.99, "p999": 0.999}


@dataclass(frozen=True, slots=True)
class ShellStatus:
    """Values that only the shell has.

    clock: mode of the clock, `wall` or `lockstep`.
    pid: process id.
    uptime_ns: time since the start.
    grants: results of the real-time requests.
    record, record_bytes: path of the record, '' without one, and its size.
    """

    clock: str
    pid: int
    uptime_ns: int
    grants: Sequence[Grant]
    record: str
    record_bytes: int


def report(rover: Rover, shell: ShellStatus) -> dict[str, Any]:
    """Return the whole report; seconds, metres, radians, bytes."""
    executive, pose = rover.executive, rover.localisation.pose
    return {
        "pid": shell.pid,
        "clock": shell.clock,
        "uptime_s": round(shell.uptime_ns / 1e9, 3),
        "mode": executive.mode.name,
        "phase": executive.phase.name,
        "pose": {"x_m": pose.x_m, "y_m": pose.y_m, "z_m": pose.z_m, "yaw_rad": pose.yaw_rad},
        "faults": list(executive.active),
        "computer": _computer(rover.computer.machine),
        **rhythm(rover, shell.grants),
        "record": {"path": shell.record, "bytes": shell.record_bytes} if shell.record else None,
    }


def rhythm(rover: Rover, grants: Sequence[Grant]) -> dict[str, Any]:
    """Timing since the start; also the last part of the record, for its report."""
    return {
        "rate_groups": _groups(rover.pace),
        "ticks": _ticks(rover.pace),
        "jobs": _jobs(rover),
        "real_time": [grant._asdict() for grant in grants],
    }


def _computer(machine: Machine | None) -> dict[str, float | None] | None:
    """Load figures of the computer; an unknown one is None, which JSON has."""
    return machine and {name: value if math.isfinite(value) else None for name, value in machine._asdict().items()}


def _groups(pace: Pace) -> list[dict[str, Any]]:
    return [
        {
            "name": row.name,
            "rate_hz": row.rate_hz,
            "budget_us": row.budget_ns / 1e3,
            "worst_us": pace.worst_ns[row.group] / 1e3,
            "over_budget": pace.over_budget[row.group],
            "slips": pace.schedule.slips[row.group],
        }
        for row in GROUPS
    ]


def _ticks(pace: Pace) -> dict[str, Any]:
    return {
        "worst_ms": pace.tick_worst_ns / 1e6,
        "late_worst_ms": pace.late_worst_ns / 1e6,
        "late_below_us": {name: quantile_us(pace.lateness, share) for name, share in SHARES.items()},
        "lateness": list(pace.lateness),
        "slipped": pace.slipped_ticks,
        "slips": [
            {"cause": cause, "job": job, "ticks": count, "worst_ms": pace.slip_worst_ns[cause, job] / 1e6}
            for (cause, job), count in pace.slips.most_common()
        ],
    }


def _jobs(rover: Rover) -> dict[str, Any]:
    kept = {
        name: {
            "done": row.done,
            "late": row.late,
            "worst_late_ticks": row.worst_late_ticks,
            "worst_ms": row.worst_ns / 1e6,
        }
        for name, row in rover.jobs.kept.items()
    }
    return {"running": list(rover.jobs.running), "kept": kept}
