"""Values for people: units, degrees, names of modes; and which values belong together on the page."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from ground.cli.operations.show import item_words
from protocol.tables import commands
from protocol.tables.telemetry import BY_NAME, TABLE
from protocol.visible import visible

WHEEL_ITEMS = (("steer", "rad"), ("steer_ordered", "rad"), ("rate", "radps"), ("rate_ordered", "radps"))
DRAWN = frozenset(f"{what}_{n}_{unit}" for n in (1, 2, 3, 4) for what, unit in WHEEL_ITEMS)
GROUPS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("Rover", ("mode", "phase", "stop", "faults", "goal_distance_m", "speed_mps", "job_ratio")),
    ("Pose", ("x_m", "y_m", "z_m", "yaw_rad", "roll_rad", "pitch_rad", "yaw_rate_radps", "sigma_position_m",
              "sigma_major_m", "sigma_minor_m", "sigma_axis_rad", "sigma_yaw_rad")),
    ("Wheels", ("slip_ratio", *(f"{what}_{n}_{unit}" for n in (1, 2, 3, 4) for what, unit in WHEEL_ITEMS))),
    ("Power", ("voltage_v", "current_a", "charge_ratio", "battery_temperature_c")),
    ("Computer", ("cpu_ratio", "rss_mb", "free_memory_mb", "free_disk_mb", "computer_temperature_c", "tick_worst_ms")),
    ("Link on board", ("link_received", "link_refused", "events_waiting", "lease_station", "key_epoch")),
)  # fmt: skip
LABELS = {
    "goal_distance_m": "to the goal", "speed_mps": "speed", "job_ratio": "computing", "x_m": "east (x)",
    "y_m": "north (y)", "z_m": "height (z)", "yaw_rad": "heading", "roll_rad": "roll", "pitch_rad": "pitch",
    "yaw_rate_radps": "turn rate", "sigma_position_m": "1σ of place", "sigma_major_m": "1σ, long axis",
    "sigma_minor_m": "1σ, short axis", "sigma_axis_rad": "long axis from east", "slip_ratio": "slip",
    "sigma_yaw_rad": "1σ of heading",
    "voltage_v": "battery", "current_a": "current", "charge_ratio": "charge", "battery_temperature_c": "battery temp.",
    "cpu_ratio": "processor", "rss_mb": "program memory", "free_memory_mb": "free memory", "free_disk_mb": "free disk",
    "computer_temperature_c": "computer temp.", "tick_worst_ms": "longest tick", "link_received": "received",
    "link_refused": "refused", "events_waiting": "events waiting", "lease_station": "control lease",
    "key_epoch": "key epoch", "faults": "faults", "stop": "scan stop", "mode": "mode", "phase": "phase",
    **{f"steer_{n}_rad": f"wheel {n} steering" for n in (1, 2, 3, 4)},
    **{f"rate_{n}_radps": f"wheel {n} rate" for n in (1, 2, 3, 4)},
    **{f"steer_ordered_{n}_rad": f"wheel {n} steering, ordered" for n in (1, 2, 3, 4)},
    **{f"rate_ordered_{n}_radps": f"wheel {n} rate, ordered" for n in (1, 2, 3, 4)},
}  # fmt: skip
_DECIMALS = {"m": 2, "m/s": 2, "V": 1, "A": 1, "°C": 0, "ms": 1, "MB": 0, "ppm": 0, "s": 3}
_PERCENT = {"charge_ratio", "cpu_ratio", "job_ratio", "process_ratio", "slip_ratio"}
assert all(name in BY_NAME for _, names in GROUPS for name in names)


def value_words(name: str, value: float) -> str:
    """Return a value with its unit, angles in degrees; "?" for a value that is no number."""
    row = BY_NAME.get(name)
    if not math.isfinite(value):
        return "?"
    if row is None or not row.unit:
        return item_words(name, value)
    if name in _PERCENT:
        return f"{100 * value:.0f} %"
    if row.unit in ("rad", "rad/s"):
        decimals = 1 if name.startswith("sigma") or abs(value) < math.radians(10) else 0
        return f"{math.degrees(value):.{decimals}f}{'°' if row.unit == 'rad' else ' °/s'}"
    return (
        f"{value:.{_DECIMALS.get(row.unit, 2)}f} {row.unit}".rstrip(" 1")
        if row.unit == "1"
        else (f"{value:.{_DECIMALS.get(row.unit, 2)}f} {row.unit}")
    )


def label(name: str) -> str:
    """Return an item's name for people."""
    return LABELS.get(name, name)


def rest() -> tuple[str, ...]:
    """Return the items of no group, in the order of the table."""
    grouped = {name for _, names in GROUPS for name in names}
    return tuple(row.name for row in TABLE if row.name not in grouped)


def command_words(name: str, arguments: Mapping[str, Any]) -> str:
    """Return a request as people type it, angles in degrees."""
    try:
        row = commands.command(name)
    except ValueError:
        return visible(f"{name} {dict(arguments)}")
    shown = [
        _argument(argument.name, arguments[argument.name])
        for argument in row.arguments
        if arguments.get(argument.name) is not None
    ]
    return visible(" ".join([row.typed, *shown]))


def _argument(name: str, value: Any) -> str:
    if isinstance(value, float):
        return f"{math.degrees(value):g}°" if name.endswith("_rad") else f"{value:g}"
    return str(value)
