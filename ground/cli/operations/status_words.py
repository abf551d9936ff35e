"""The rover's status in five lines for people: what it does, where it is, its goal, its power, the link."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from ground.cli.operations.show import item_words
from protocol.tables.telemetry import out_of_limits

Items = Mapping[str, float | None]
_UNKNOWN = "not known yet"


def status_lines(items: Items, link: Mapping[str, Any]) -> list[str]:
    """Return the lines; a sixth one names items that are out of their limits.

    items: newest value of each item in SI units, None if not known. link: as of `show.status`.
    """
    lines = [
        f"rover     {_doing(items)}",
        f"place     {_place(items)}",
        f"goal      {_goal(items)}",
        f"power     {_power(items)}",
        f"link      {_link(link)}",
    ]
    outside = [name for name, value in items.items() if value is not None and out_of_limits(name, value)]
    if outside:
        words = ", ".join(f"{name} {item_words(name, items[name])}" for name in outside)
        lines.append(f"limits    outside: {words}")
    return lines


def _doing(items: Items) -> str:
    if items.get("mode") is None:
        return _UNKNOWN
    parts = [item_words("mode", items["mode"])]
    phase = item_words("phase", items.get("phase"))
    if phase not in ("NONE", "?"):
        parts.append(f"{phase.lower()}, stop {items.get('stop') or 0:.0f}")
    faults = items.get("faults")
    parts.append("faults " + (_UNKNOWN if faults is None else item_words("faults", faults)))
    return "; ".join(parts)


def _place(items: Items) -> str:
    x_m, y_m, yaw_rad = (items.get(name) for name in ("x_m", "y_m", "yaw_rad"))
    if x_m is None or y_m is None or yaw_rad is None:
        return _UNKNOWN
    words = [f"x {x_m:.2f} m, y {y_m:.2f} m, heading {round(math.degrees(yaw_rad))}°"]
    if (sigma_m := items.get("sigma_position_m")) is not None:
        words.append(f"1 sigma {sigma_m:.2f} m")
    tilt = [
        f"{name} {round(math.degrees(angle))}°"
        for name in ("roll", "pitch")
        if (angle := items.get(f"{name}_rad")) is not None
    ]
    if (speed_mps := items.get("speed_mps")) is not None:
        tilt.append(f"{speed_mps:.2f} m/s")
    return "; ".join([*words, ", ".join(tilt)] if tilt else words)


def _goal(items: Items) -> str:
    x_m, y_m, away_m = (items.get(name) for name in ("goal_x_m", "goal_y_m", "goal_distance_m"))
    if x_m is None or y_m is None:
        return "none" if items.get("mode") is not None else _UNKNOWN
    return f"x {x_m:.2f} m, y {y_m:.2f} m" + ("" if away_m is None else f"; {away_m:.2f} m away")


def _power(items: Items) -> str:
    volts, amperes, charge = (items.get(name) for name in ("voltage_v", "current_a", "charge_ratio"))
    if volts is None:
        return _UNKNOWN
    words = [f"{volts:.1f} V"]
    words += [] if charge is None else [f"{100 * charge:.0f} % left"]
    words += [] if amperes is None else [f"{amperes:.1f} A"]
    return ", ".join(words)


def _link(link: Mapping[str, Any]) -> str:
    age_s, rtt_s = link["heard_s_ago"], link["rtt_s"]
    words = ["nothing heard yet" if age_s is None else f"heard {age_s:.1f} s ago"]
    words += [] if rtt_s is None else [f"round trip {rtt_s:.2f} s"]
    words.append(str(link["contact"]))
    if link["versions"] not in ("alike", "not known"):
        words.append(str(link["versions"]))
    return "; ".join(words)
