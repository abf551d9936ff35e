"""News as lines for people and as JSON for programs. Degrees appear here and in no lower module."""

from __future__ import annotations

import json
import math
from enum import IntEnum
from typing import Any

from ground.link.event_words import event_words
from ground.link.news import EventHeard, News, ProductHeard, Progress, ReportHeard
from ground.link.schedule import utc_words
from ground.link.session import Session
from protocol import WireError
from protocol.link.bulk import Product
from protocol.products.way import WayProduct, decode_way
from protocol.tables.faults import named
from protocol.tables.modes import Mode, Phase
from protocol.tables.telemetry import BY_NAME, out_of_limits

WAY = "way"  # the product that answers a goto
NAMED: dict[str, type[IntEnum]] = {"mode": Mode, "phase": Phase}


def clock(now_ns: int) -> str:
    """Return the time of the run, as `  12.34 s`."""
    return f"{now_ns / 1e9:8.2f} s"


def news_line(news: News) -> str | None:
    """Return one line of text; None for items, which the status line shows."""
    match news:
        case EventHeard(at_ns, onboard_ns, _, severity, name, text):
            return f"{clock(at_ns)}  {severity:8}  {name}: {event_words(text)}  (onboard {onboard_ns / 1e9:.2f} s)"
        case ReportHeard(at_ns, name, report):
            words = f": {event_words(report.text)}" if report.text else ""
            return f"{clock(at_ns)}  command   {name} #{report.request_id} {report.state.name.lower()}{words}"
        case ProductHeard(at_ns, product) if product.name == WAY:
            return f"{clock(at_ns)}  way       {_way_or_why_not(product.data)}"
        case ProductHeard(at_ns, product):
            return f"{clock(at_ns)}  product   {product.name} ({product.codec}), {len(product.data)} B, SHA-256 right"
        case Progress(at_ns, name, have, total):
            return f"{clock(at_ns)}  transfer  {name} {have} of {total} chunks"
    return None


def news_json(news: News) -> str:
    """Return one JSON object on one line; `news` is its kind. Bytes appear as their length."""
    tree: dict[str, Any] = {"news": type(news).__name__.removesuffix("Heard").lower()}
    match news:
        case ReportHeard(at_ns, name, report):
            tree |= {"at_ns": at_ns, "command": name} | report._asdict() | {"state": report.state.name}
        case ProductHeard(at_ns, product) if (way := _way(product)) is not None:
            tree |= {"news": "way", "at_ns": at_ns, **way._asdict()}
        case ProductHeard(at_ns, product):
            tree |= {"at_ns": at_ns, **product._asdict(), "data": len(product.data)}
        case _:
            tree |= news._asdict()
    if tree.get("name") in NAMED and "value" in tree:
        tree["word"] = item_words(tree["name"], _plain(tree["value"]))
    return json.dumps({key: _plain(item) for key, item in tree.items()})


def way_words(data: bytes) -> str:
    """Return the answer to a goto in one line: length, time and the corners of the path. Raises WireError."""
    way = decode_way(data)
    if way.length_m is None:
        return f"none: {way.reason}"
    corners = dict.fromkeys(f"{x:.1f} {y:.1f}" for x, y, _ in way.path)
    return f"{way.length_m:.1f} m in about {way.time_s:.0f} s, {way.looks} looks; by {', '.join(corners)}"


def _way_or_why_not(data: bytes) -> str:
    try:
        return way_words(data)
    except WireError as error:
        return f"cannot be read: {error}"


def _way(product: Product) -> WayProduct | None:
    """Return the answer to a goto; None if the product is another one or damaged."""
    try:
        return decode_way(product.data) if product.name == WAY else None
    except WireError:
        return None


def silence_line(silent_s: float, now_ns: int) -> str:
    """Return the line for a silence of the rover."""
    return f"{clock(now_ns)}  link      no word from the rover for {silent_s:.0f} s"


def silence_json(silent_s: float, now_ns: int) -> str:
    """Return the silence as one JSON object."""
    return json.dumps({"news": "silence", "at_ns": now_ns, "silent_s": silent_s})


def contact_line(session: Session, now_ns: int) -> str:
    """Return the line for the contact state."""
    return f"{clock(now_ns)}  contact   {contact_words(session, now_ns)}"


def contact_words(session: Session, now_ns: int) -> str:
    """Return the contact state, with the time to its end or to the next contact."""
    windows = session.windows(now_ns)
    if windows is None:
        return "the windows are in onboard time, which is not known until the rover is heard"
    if not windows.spans:
        return "no windows: the link carries at any time"
    end_ns, begin_ns = windows.end_ns(now_ns), windows.next_begin_ns(now_ns)
    if end_ns is not None:
        return f"in contact, {(end_ns - now_ns) / 1e9:.0f} s left"
    if begin_ns is None:
        return "the last window is over: nothing is sent; bring the file of `contacts` up to date"
    return f"no contact: what is asked goes in {(begin_ns - now_ns) / 1e9:.0f} s"


def clock_words(session: Session, now_ns: int) -> str:
    """Return onboard time, the UTC of its zero, and the error bound."""
    found = session.far_clock.at(now_ns)
    if found is None:
        return "not known until the rover is heard"
    off = "its error unknown" if found.error_ns is None else f"at most {found.error_ns / 1e9:.3f} s off"
    zero_ns = session.utc_ns + now_ns - found.onboard_ns
    zero = f", its zero at {utc_words(zero_ns)}" if session.utc_ns else ""
    return f"{found.onboard_ns / 1e9:.2f} s{zero}, {off}"


def _plain(item: Any) -> Any:
    return None if isinstance(item, float) and not math.isfinite(item) else item


def status(session: Session, now_ns: int) -> dict[str, Any]:
    """Return the known state of the rover: the newest value of every item, and the state of the link."""
    age_s = None if session.heard_ns is None else (now_ns - session.heard_ns) / 1e9
    clock = session.far_clock.at(now_ns)
    refused = {kind: n for kind, n in session.counts.items() if kind != "ok"}
    link = {
        "heard_s_ago": age_s,
        "boot_id": session.boot_id,
        "rtt_s": session.far_clock.rtt_ns / 1e9 or None,
        "datagrams": session.counts["ok"],
        "refused": refused,
        "epoch": session.kept.epoch,
        "contact": contact_words(session, now_ns),
        "clock": clock_words(session, now_ns),
        "clock_error_s": None if clock is None or clock.error_ns is None else clock.error_ns / 1e9,
        "versions": session.mismatch or ("alike" if session.versions else "not known"),
    }
    items = {name: _plain(item.value) for name, item in session.items.items()}
    return {"items": items, "words": {name: item_words(name, items.get(name)) for name in NAMED}, "link": link}


def item_line(name: str, value: float | None) -> str:
    """Return one line for an item, marked if its value is out of its limits; None: not known."""
    marked = value is not None and out_of_limits(name, value)
    return f"{name:24} {item_words(name, value)}{'  out of limits' if marked else ''}"


def status_line(session: Session, now_ns: int) -> str:
    """Return one line: mode, phase, pose, distance to the goal, age; or that none of them has arrived yet."""
    if session.heard_ns is None:
        return f"{clock(now_ns)}  nothing heard yet"
    parts = [clock(now_ns), " " + "/".join(_names(session))]
    x_m, y_m, yaw_rad = (_number(session, name) for name in ("x_m", "y_m", "yaw_rad"))
    if x_m is not None and y_m is not None:
        parts.append(f"x {x_m:.2f} m  y {y_m:.2f} m")
    if yaw_rad is not None:
        parts.append(f"yaw {math.degrees(yaw_rad):.0f}°")
    distance_m = _number(session, "goal_distance_m")
    if distance_m is not None:
        parts.append(f"to goal {distance_m:.2f} m")
    if parts[1:] == [" ?"]:
        return f"{parts[0]}  waiting for telemetry"
    parts.append(f"({(now_ns - session.heard_ns) / 1e9:.1f} s old)")
    return "  ".join(parts)


def item_words(name: str, value: float | None) -> str:
    """Return an item's value in words: name of a mode or phase, names of faults, else the number; "?" if not known."""
    kind = NAMED.get(name)
    if value is None:
        return "?"
    if name.endswith("_version"):
        return f"{int(value):08x}"
    if name == "faults":
        return " ".join(named(int(value))) or "none"
    if name == "lease_station":
        return f"{value:g}" if value else "nobody"
    if kind and int(value) in kind.__members__.values():
        return kind(int(value)).name
    return measured(value, BY_NAME[name].unit if name in BY_NAME else "")


def measured(value: float, unit: str) -> str:
    """Return a number with its unit as people read it: angles in degrees, ratios bare."""
    if unit.startswith("rad"):
        return f"{math.degrees(value):.4g}{unit.replace('rad', '°')}"
    return f"{value:g} {unit}" if unit and unit != "1" else f"{value:g}"


def _names(session: Session) -> list[str]:
    known = ((name, _number(session, name)) for name in NAMED)
    words = [item_words(name, number) for name, number in known if number is not None]
    return [word for word in words if word != "NONE"] or ["?"]


def _number(session: Session, name: str) -> float | None:
    item = session.items.get(name)
    if item is None or not math.isfinite(item.value):
        return None
    return item.value
