"""Faults, telemetry values and events as ROS 2 messages."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from onboard.bringup.ros2.types import header, new, stamp
from protocol.tables.faults import FAULTS, Fault, ResponseStep, named
from protocol.tables.modes import Mode, Phase
from protocol.tables.telemetry import BY_NAME, out_of_limits

OK, WARN, ERROR = 0, 1, 2  # of diagnostic_msgs/DiagnosticStatus
HARDWARE = "el_dorado"
_STOPS = {ResponseStep.STOP, ResponseStep.SAFE, ResponseStep.ESTOP, ResponseStep.STANDBY}
_LEVELS = {"debug": 10, "info": 20, "warning": 30, "error": 40, "critical": 50}  # of rcl_interfaces/Log
_NAMED = {"mode": Mode, "phase": Phase}


def diagnostics(values: Mapping[str, float], now_ns: int) -> Any:
    """Build diagnostic_msgs/DiagnosticArray of the newest telemetry: a status for each fault, and one of all values.

    An active fault is an ERROR if its response stops the rover, else a WARN. `values` is of the names of
    protocol.tables.telemetry, with at least `faults`.
    """
    bits = int(values["faults"])
    found = [_fault(fault, bool(bits >> fault.number & 1)) for fault in FAULTS]
    return new("diagnostic_msgs/DiagnosticArray", header=header(now_ns, ""), status=[_rover(values), *found])


def log(event: Mapping[str, Any]) -> Any:
    """Build rcl_interfaces/Log of one event of /out/event."""
    return new(
        "rcl_interfaces/Log",
        stamp=stamp(event["now_ns"]),
        level=_LEVELS[event["severity"]],
        name=event["name"],
        msg=event["text"],
        file="",
        function="",
        line=0,
    )


def _fault(fault: Fault, active: bool) -> Any:
    level = OK if not active else ERROR if _STOPS & set(fault.response) else WARN
    return _status(level, f"fault: {fault.name}", fault.condition if active else "not active", ())


def _rover(values: Mapping[str, float]) -> Any:
    outside = [
        name
        for name, value in values.items()
        if name != "faults" and math.isfinite(value) and out_of_limits(name, value)
    ]
    words = f"out of limits: {', '.join(outside)}" if outside else "within limits"
    return _status(WARN if outside else OK, "rover", words, _texts(values))


def _texts(values: Mapping[str, float]) -> Iterator[tuple[str, str]]:
    for name, value in values.items():
        kind = _NAMED.get(name)
        if kind is not None and value in set(kind):
            yield name, kind(int(value)).name
        elif name == "faults":
            yield name, " ".join(named(int(value))) or "none"
        elif math.isfinite(value):
            number = f"{value:.0f}" if value == int(value) else f"{value:.6g}"
            yield name, f"{number} {BY_NAME[name].unit.removeprefix('1')}".rstrip()
        else:
            yield name, "not known"


def _status(level: int, name: str, words: str, pairs: Any) -> Any:
    return new(
        "diagnostic_msgs/DiagnosticStatus",
        level=level,
        name=name,
        message=words,
        hardware_id=HARDWARE,
        values=[new("diagnostic_msgs/KeyValue", key=key, value=text) for key, text in pairs],
    )
