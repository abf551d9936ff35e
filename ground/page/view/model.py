"""View model of the page: a snapshot of the station in, one plain tree for JSON out. Pure.

Every value carries `at_s`, the station time at which it was measured on the rover: onboard time by the estimated clock.
The browser adds the time since the tree was made, so a value gets older also while nothing arrives from the server.
Station times are seconds; `now_s` is the station time of the tree.
"""

from __future__ import annotations

import math
from typing import Any

from ground.link.contact import SILENT_NS
from ground.page.view.pace import unequal
from ground.page.view.snapshot import CommandRow, EventRow, Snapshot
from ground.page.view.words import DRAWN, GROUPS, command_words, label, rest, value_words
from protocol.tables.telemetry import BY_NAME, out_of_limits

MOST_EVENTS, MOST_COMMANDS = 200, 40
PREDICTED_S = 10.0  # no prediction of the place further ahead than this
_MARGIN_S = 2.0
_PERIODS = 3.0
_MOVES_MPS = 0.01
_ENDS = {"COMPLETED": "completed", "FAILED": "failed", "EXPIRED": "expired", "CANCELLED": "cancelled"}


def now_ns(shot: Snapshot, mono_ns: int) -> int:
    """Return the station's clock at a reading of the monotonic clock, also if the link's thread has stopped since."""
    return shot.now_ns + max(0, mono_ns - shot.mono_ns)


def stale_after_s(name: str, one_way_s: float) -> float:
    """Return the age at which a value is stale: three periods of its item, the way down, and a margin of 2 s."""
    row = BY_NAME.get(name)
    return (_PERIODS / row.rate_hz if row is not None else 0.0) + one_way_s + _MARGIN_S


def view(shot: Snapshot, mono_ns: int) -> dict[str, Any]:
    """Return the tree. mono_ns: monotonic clock now."""
    now = now_ns(shot, mono_ns)
    values = {name: _value(shot, name, now) for name in (*(one for _, names in GROUPS for one in names), *rest())}
    pose = _pose(shot, values, now)
    return {
        "now_s": now / 1e9,
        "utc_s": (shot.utc_ns + now) / 1e9 if shot.utc_ns else None,
        "values": values,
        "link": _link(shot, now),
        "pose": pose,
        "goal": _goal(shot),
        "events": [event_tree(row) for row in shot.events[-MOST_EVENTS:]],
        "commands": [command_tree(row) for row in shot.commands[-MOST_COMMANDS:]],
    }


def layout() -> list[dict[str, Any]]:
    """Return the groups of values in their order, each item with its label and meaning."""
    groups = [*GROUPS, ("More", rest())]
    return [
        {
            "title": title,
            "items": [{"name": name, "label": label(name), "meaning": BY_NAME[name].meaning} for name in names],
        }
        for title, names in groups
    ]


def measured_ns(shot: Snapshot, name: str, now: int) -> int | None:
    """Return the station time at which an item's newest value was measured; None: not known, so of any age.

    A value of the archive whose UTC lies in the future is of unknown age: one of the two clocks is wrong.
    """
    item = shot.items.get(name)
    if item is not None:
        if shot.clock is None or unequal(shot.pace_ratio):
            return item.at_ns - shot.rtt_ns // 2
        return min(item.at_ns, item.onboard_ns - (shot.clock.onboard_ns - shot.now_ns))
    old = shot.before.get(name)
    if old is None or not shot.utc_ns or old.utc_ns <= 0:
        return None
    at = old.utc_ns - shot.utc_ns
    return at if at <= now else None


def _number(shot: Snapshot, name: str) -> float | None:
    item, old = shot.items.get(name), shot.before.get(name)
    value = item.value if item is not None else old.value if old is not None else math.nan
    return value if math.isfinite(value) else None


def _value(shot: Snapshot, name: str, now: int) -> dict[str, Any]:
    """Return text, time, limit of age and marks of one item, and the number of one that is drawn.

    `live`: False for a value of an earlier run.
    """
    value = _number(shot, name)
    at = measured_ns(shot, name, now)
    return {
        "text": "–" if value is None else value_words(name, value),
        "at_s": None if at is None else round(at / 1e9, 3),  # the estimate moves by less at each reading
        "stale_s": round(stale_after_s(name, shot.rtt_ns / 2e9), 2),
        "live": name in shot.items,
        "bad": value is not None and out_of_limits(name, value),
        **({"number": value} if name in DRAWN else {}),
    }


def _pose(shot: Snapshot, values: dict[str, Any], now: int) -> dict[str, Any] | None:
    """Return the rover's pose with its error and its age, and the predicted place; None: no place is known."""
    x_m, y_m, yaw_rad = (_number(shot, name) for name in ("x_m", "y_m", "yaw_rad"))
    if x_m is None or y_m is None:
        return None
    at_s = values["x_m"]["at_s"]
    age_s = None if at_s is None else now / 1e9 - at_s
    fresh = age_s is not None and age_s <= values["x_m"]["stale_s"] and "x_m" in shot.items
    return {
        "x_m": x_m,
        "y_m": y_m,
        "yaw_rad": yaw_rad,
        **{name: _number(shot, name) for name in ("z_m", "roll_rad", "pitch_rad")},
        "at_s": at_s,
        "stale_s": values["x_m"]["stale_s"],
        "live": "x_m" in shot.items,
        "ellipse": _ellipse(shot),
        "sigma_yaw_rad": _number(shot, "sigma_yaw_rad"),
        "predicted": _predicted(shot, (x_m, y_m, yaw_rad), age_s) if fresh and age_s is not None else None,
    }


def _ellipse(shot: Snapshot) -> dict[str, float] | None:
    """Return the 1 sigma ellipse of the place: half axes, m, and direction of the long one; a circle if that is all.

    The circle has the root of the sum of both variances, so it is never too small. None: not known.
    """
    major_m, minor_m, axis_rad = (_number(shot, name) for name in ("sigma_major_m", "sigma_minor_m", "sigma_axis_rad"))
    if major_m is not None and minor_m is not None and axis_rad is not None:
        return {"major_m": major_m, "minor_m": minor_m, "axis_rad": axis_rad}
    sigma_m = _number(shot, "sigma_position_m")
    return None if sigma_m is None else {"major_m": sigma_m, "minor_m": sigma_m, "axis_rad": 0.0}


def _predicted(shot: Snapshot, pose: tuple[float, float, float | None], age_s: float) -> dict[str, float] | None:
    """Return where the rover is now if it kept its speed and heading since the value was measured; None: it stands."""
    speed_mps, (x_m, y_m, yaw_rad) = _number(shot, "speed_mps"), pose
    if yaw_rad is None or speed_mps is None or abs(speed_mps) < _MOVES_MPS or not 0.0 < age_s <= PREDICTED_S:
        return None
    way_m = speed_mps * age_s
    return {
        "x_m": x_m + way_m * math.cos(yaw_rad),
        "y_m": y_m + way_m * math.sin(yaw_rad),
        "yaw_rad": yaw_rad,
        "ahead_s": age_s,
    }


def _goal(shot: Snapshot) -> list[float] | None:
    x_m, y_m = _number(shot, "goal_x_m"), _number(shot, "goal_y_m")
    return None if x_m is None or y_m is None else [x_m, y_m]


def link_state(shot: Snapshot, now: int) -> str:
    """Return "closed", "never", "silent", "no contact" or "heard"."""
    if not shot.linked:
        return "closed"
    if shot.heard_ns is None:
        return "never"
    if not shot.in_contact:
        return "no contact"
    return "silent" if now - shot.heard_ns > SILENT_NS // 3 else "heard"


def _link(shot: Snapshot, now: int) -> dict[str, Any]:
    open_ones = [row for row in shot.commands if row.ended_ns is None and row.requested_ns is not None]
    refused = {kind: n for kind, n in shot.counts.items() if kind != "ok" and n}
    return {
        "state": link_state(shot, now),
        "trouble": shot.trouble,
        "mismatch": shot.mismatch,
        "heard_s": None if shot.heard_ns is None else shot.heard_ns / 1e9,
        "rtt_s": shot.rtt_ns / 1e9 or None,
        "boot_id": shot.boot_id,
        "station": shot.station,
        "received": shot.counts.get("ok", 0),
        "refused": refused,
        "sent": shot.sent,
        "contact": shot.contact,
        "clock": shot.clock_words,
        "may_command": shot.may_command,
        "error_s": shot.clock.error_ns / 1e9 if shot.clock is not None and shot.clock.error_ns is not None else None,
        "on_its_way": [command_words(row.name, row.arguments) for row in open_ones if row.heard_ns is None],
        "transfers": [[name, have, total] for name, (have, total) in shot.transfers.items()],
        "says": list(shot.says),
        "pace": _pace_words(shot),
    }


def _pace_words(shot: Snapshot) -> str:
    if shot.pace_ratio is None or not unequal(shot.pace_ratio):
        return ""
    return (
        f"The rover's clock runs at {shot.pace_ratio:.2f} of this computer's, as in a slow simulation: "
        "ages count from the arrival here."
    )


def event_tree(row: EventRow) -> dict[str, Any]:
    """Return an event for the page. key: identifies it."""
    return {
        "key": f"{row.boot_id}-{row.serial}",
        "utc_s": row.utc_ns / 1e9 or None,
        "severity": row.severity,
        "name": row.name,
        "text": row.text,
    }


def command_tree(row: CommandRow) -> dict[str, Any]:
    """Return a request for the page, with the chain of its steps: each a name and its station time, None: not yet."""
    end = _ENDS.get(row.state)
    steps = [
        ["requested", row.requested_ns],
        ["sent", row.sent_ns],
        ["heard", row.heard_ns],
        ["accepted", row.accepted_ns],
        [end or "completed", row.ended_ns],
    ]
    return {
        "id": row.request_id,
        "station": row.station,
        "words": command_words(row.name, row.arguments),
        "asked_by": row.asked_by,
        "utc_s": row.utc_ns / 1e9 or None,
        "state": row.state,
        "text": row.text,
        "copies": row.copies,
        "final": end is not None,
        "good": row.state == "COMPLETED",
        "steps": [[name, None if at is None else at / 1e9] for name, at in steps],
    }
