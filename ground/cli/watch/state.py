"""Rows of the state pane: values in people's units, each with its age, marked when stale or out of limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import NamedTuple

from rich.text import Text

from ground.cli.operations import show
from ground.cli.watch.model import Freshness
from ground.link.news import Item
from ground.link.session import Session
from protocol.tables.telemetry import BY_NAME, out_of_limits

GOOD, STALE, WRONG, LABEL = "", "dim italic", "bold #ff8c42", "#8a94a6"
_UNKNOWN = "?"
_AGE_S = 1.5  # younger values show no age, unless they are stale


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
    return " ".join(f"{math.degrees(angle):z.0f}°" for angle in angles_rad)


def _mode(mode: float, phase: float) -> str:
    words = (show.item_words("mode", mode), show.item_words("phase", phase))
    return " / ".join(word for word in words if word != "NONE")


ROWS = (
    Row("mode", ("mode", "phase"), _mode),
    Row("faults", ("faults",), lambda bits: show.item_words("faults", bits)),
    Row("place", ("x_m", "y_m", "z_m"), lambda x, y, z: f"{x:z.2f} {y:z.2f} {z:z.2f} m"),
    Row("heading", ("yaw_rad",), _degrees),
    Row("tilt", ("roll_rad", "pitch_rad"), lambda roll, pitch: f"roll {_degrees(roll)} pitch {_degrees(pitch)}"),
    Row("sigma", ("sigma_position_m", "sigma_yaw_rad"), lambda xy, yaw: f"{xy:.2f} m, {math.degrees(yaw):.1f}°"),
    Row("speed", ("speed_mps",), lambda speed: f"{speed:z.3f} m/s"),
    Row("goal", ("goal_x_m", "goal_y_m", "goal_distance_m"), lambda x, y, far: f"{x:z.1f} {y:z.1f}, {far:.2f} m away"),
    Row("stop", ("stop",), lambda number: f"number {number:.0f}"),
    Row(
        "battery",
        ("voltage_v", "current_a", "charge_ratio"),
        lambda volts, amperes, charge: f"{volts:.1f} V {amperes:z.1f} A {100 * charge:.0f} %",
    ),
    Row("steering", tuple(f"steer_{n}_rad" for n in (1, 2, 3, 4)), _degrees),
    Row(
        "wheels",
        tuple(f"rate_{n}_radps" for n in (1, 2, 3, 4)),
        lambda *rates: " ".join(f"{rate:z.1f}" for rate in rates) + " rad/s",
    ),
    Row("slip", ("slip_ratio",), lambda ratio: f"{100 * ratio:.0f} %"),
    Row("lease", ("lease_station",), lambda station: show.item_words("lease_station", station)),
    Row("tick", ("tick_worst_ms", "tick_late_ms"), lambda worst, wake: f"{worst:.1f} ms, late {wake:z.1f}"),
    Row(
        "computer",
        ("cpu_ratio", "free_disk_mb", "computer_temperature_c"),
        lambda cpu, disk, heat: f"cpu {100 * cpu:.0f} %, disk {disk:.0f} MB, {heat:.0f} °C",
    ),
)
_SHOWN = {name for row in ROWS for name in row.items}


def state(items: Mapping[str, Item], freshness: Freshness, width: int, height: int) -> Text:
    """Return the rows that fit, each on one line of at most `width` characters; below them the other known items."""
    text = Text(no_wrap=True, overflow="ellipsis")
    for row in (*ROWS, *_others(items))[:height]:
        words, style = row_words(row, items, freshness)
        age = age_words([items[name] for name in row.items if name in items], freshness) if words != _UNKNOWN else ""
        label = f"{row.label:<9} "
        room = max(1, width - len(label) - (len(age) + 1 if age else 0))
        text.append(label, LABEL)
        text.append(words if len(words) <= room else words[: room - 1] + "…", style)
        text.append(f" {age}\n" if age else "\n", STALE)
    return text


def _others(items: Mapping[str, Item]) -> Iterator[Row]:
    """Yield a row for each item that the table of rows lacks, in the order of the telemetry table."""
    for name in BY_NAME:
        if name in items and name not in _SHOWN:
            yield Row(f"{name:<22}", (name,), partial(show.item_words, name))


def row_words(row: Row, items: Mapping[str, Item], freshness: Freshness) -> tuple[str, str]:
    """Return text and style of a row. A value that is not known is a question mark, never a number."""
    shown = [items.get(name) for name in row.items]
    known = [item for item in shown if item is not None and math.isfinite(item.value)]
    if not known:
        return _UNKNOWN, STALE
    if len(known) == len(shown):
        words = row.words(*(item.value for item in known))
    else:
        words = " ".join(
            show.item_words(name, item.value) if item in known and item is not None else _UNKNOWN
            for name, item in zip(row.items, shown)
        )
    if any(freshness.stale(item) for item in known):
        return words, STALE
    return words, WRONG if any(out_of_limits(item.name, item.value) for item in known) else GOOD


def age_words(items: Sequence[Item], freshness: Freshness) -> str:
    """Return the age of the oldest value; "" while it is fresh."""
    if not items:
        return ""
    oldest_s = max(freshness.age_s(item) for item in items)
    fresh = oldest_s < _AGE_S + freshness.one_way_s and not any(freshness.stale(item) for item in items)
    return "" if fresh else duration(oldest_s)


def duration(seconds: float) -> str:
    """Return a time for people: 4 s, 3 min, 2 h."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.0f} h"


def headline(session: Session, now_ns: int) -> tuple[str, str]:
    """Return the link in one line, and its style: last reception, round trip, refusals, contact, transfers."""
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
    parts += [
        f"{name} {100 * have // max(1, total)} %" for name, (have, total) in session.transfers.items() if have < total
    ]
    if session.mismatch:
        parts.append("versions differ: stop, safe, emergency-stop only")
    return ", ".join(parts), WRONG if age_s > 3.0 + rtt_ns / 1e9 else GOOD
