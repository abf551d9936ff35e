"""Rows of the state pane: values in people's units, each with its age, marked when late or out of limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

from rich.text import Text

from ground.operation import show
from ground.session.news import Item
from ground.session.session import Session
from ground.watch.model import late
from protocol.telemetry import out_of_limits

GOOD, LATE, WRONG, LABEL = "", "dim italic", "bold #ff8c42", "#8a94a6"
_UNKNOWN = "?"
_AGE_S = 1.5  # younger values show no age


class Row(NamedTuple):
    """One row.

    label: text at the left.
    items: telemetry items in it.
    words: makes the text of their values.
    """

    label: str
    items: tuple[str, ...]
    words: Callable[..., str]


def _degrees(*angles_rad: float) -> str:
    return " ".join(f"{math.degrees(angle):.0f}°" for angle in angles_rad)


ROWS = (
    Row("mode", ("mode", "phase"), lambda mode, phase: " / ".join(
        word for name, value in (("mode", mode), ("phase", phase))
        if (word := show.item_words(name, value)) != "NONE")),
    Row("faults", ("faults",), lambda bits: show.item_words("faults", bits)),
    Row("place", ("x_m", "y_m", "z_m"), lambda x, y, z: f"{x:.2f} {y:.2f} {z:.2f} m"),
    Row("heading", ("yaw_rad",), _degrees),
    Row("tilt", ("roll_rad", "pitch_rad"), lambda roll, pitch: f"roll {_degrees(roll)} pitch {_degrees(pitch)}"),
    Row("sigma", ("sigma_position_m", "sigma_yaw_rad"),
        lambda place, yaw: f"{place:.2f} m, {math.degrees(yaw):.1f}°"),
    Row("speed", ("speed_mps",), lambda speed: f"{speed:.3f} m/s"),
    Row("goal", ("goal_x_m", "goal_y_m", "goal_distance_m"), lambda x, y, far: f"{x:.1f} {y:.1f}, {far:.2f} m off"),
    Row("stop", ("stop",), lambda number: f"number {number:.0f}"),
    Row("battery", ("voltage_v", "current_a", "charge_ratio"),
        lambda v, a, left: f"{v:.1f} V {a:.1f} A {100 * left:.0f} %"),
    Row("steering", tuple(f"steer_{n}_rad" for n in (1, 2, 3, 4)), _degrees),
    Row("wheels", tuple(f"rate_{n}_radps" for n in (1, 2, 3, 4)),
        lambda *rates: " ".join(f"{rate:.1f}" for rate in rates) + " rad/s"),
    Row("tick", ("tick_worst_ms", "tick_late_ms"), lambda worst, wake: f"{worst:.1f} ms, late {wake:.1f} ms"),
    Row("computer", ("cpu_ratio", "free_disk_mb", "computer_temperature_c"),
        lambda cpu, disk, heat: f"cpu {100 * cpu:.0f} %, disk {disk:.0f} MB, {heat:.0f} °C"),
    Row("lease", ("lease_station",), lambda station: show.item_words("lease_station", station)),
)


def state(items: Mapping[str, Item], now_ns: int, width: int, height: int) -> Text:
    """The rows that fit, each on one line of at most `width` characters."""
    text = Text(no_wrap=True, overflow="ellipsis")
    for row in ROWS[:height]:
        words, style = row_words(row, items, now_ns)
        age = age_words([items[name] for name in row.items if name in items], now_ns)
        room = max(1, width - 10 - (len(age) + 1 if age else 0))
        text.append(f"{row.label:<9} ", LABEL)
        text.append(words if len(words) <= room else words[: room - 1] + "…", style)
        text.append(f" {age}\n" if age else "\n", LATE)
    return text


def row_words(row: Row, items: Mapping[str, Item], now_ns: int) -> tuple[str, str]:
    """Text and style of a row. A value that is not known is a question mark, never a number."""
    held = [items.get(name) for name in row.items]
    known = [item for item in held if item is not None and math.isfinite(item.value)]
    if not known:
        return _UNKNOWN, LATE
    if len(known) == len(held):
        words = row.words(*(item.value for item in known))
    else:
        words = " ".join(show.item_words(name, item.value) if item in known and item is not None else _UNKNOWN
                         for name, item in zip(row.items, held))
    if any(late(item, now_ns) for item in known):
        return words, LATE
    return words, WRONG if any(out_of_limits(item.name, item.value) for item in known) else GOOD


def age_words(items: list[Item], now_ns: int) -> str:
    """Age of the oldest value since it came here; "" while it is fresh."""
    if not items:
        return ""
    age_s = (now_ns - min(item.at_ns for item in items)) / 1e9
    return "" if age_s < _AGE_S else duration(age_s)


def duration(seconds: float) -> str:
    """A time for people: 4 s, 3 min, 2 h."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.0f} h"


def headline(session: Session, now_ns: int) -> tuple[str, str]:
    """Link in one line, and its style: last reception, round trip, refused datagrams, contact, transfers."""
    if session.heard_ns is None:
        return f"nothing received from the rover for {duration(now_ns / 1e9)}", WRONG
    age_s = (now_ns - session.heard_ns) / 1e9
    parts = [f"link: received {age_s:.1f} s ago" if age_s < 100 else f"link: SILENT for {duration(age_s)}"]
    rtt_ns = session.far_clock.rtt_ns
    parts.append(f"round trip {rtt_ns / 1e9:.1f} s" if rtt_ns else "round trip not measured")
    if refused := sum(count for kind, count in session.counts.items() if kind != "ok"):
        parts.append(f"{refused} refused here")
    if not session.in_contact(now_ns):
        parts.append(show.contact_words(session, now_ns))
    parts += [f"{name} {100 * have // max(1, total)} %" for name, (have, total) in session.transfers.items()
              if have < total]
    if session.mismatch:
        parts.append("versions differ: stop, safe, emergency-stop only")
    return ", ".join(parts), WRONG if age_s > 3.0 + rtt_ns / 1e9 else GOOD
