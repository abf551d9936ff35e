"""Live data as JSON messages for Foxglove: the topics and schemas of an exported record, as far as they come down.

    /pose  /tf      from the telemetry's pose          foxglove.PoseInFrame, foxglove.FrameTransform
    /log            from the events                    foxglove.Log
    /can/NAME       from the telemetry's values        eldorado.can.NAME, of wheels and battery: what the link carries
    /telemetry      every value that came              eldorado.telemetry
    /goal  /path    from telemetry and a goto's answer foxglove.PoseInFrame, foxglove.PosesInFrame
    /link           once a second                      eldorado.link

Pure: news in, messages out. Times of messages are onboard time, as in the record.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from ground.operation.show import WAY
from ground.session.news import EventHeard, Item, News, ProductHeard
from onboard.record.foxglove import VIEWS, View, of_event, of_pose
from protocol import WireError
from protocol.products.way import decode_way
from protocol.telemetry import TABLE

_NUMBER, _TEXT = {"type": "number"}, {"type": "string"}
_POSE = VIEWS["/pose"].fields
_PLACE = ("x_m", "y_m", "z_m", "roll_rad", "pitch_rad", "yaw_rad")
# topic -> field of the DBC's frame -> item of the telemetry
FRAMES: Mapping[str, Mapping[str, str]] = {
    **{
        f"/can/WHEEL_{n}_FEEDBACK": {
            "steer_rad": f"steer_{n}_rad", "rate_radps": f"rate_{n}_radps", "state": f"wheel_state_{n}",
        } for n in (1, 2, 3, 4)
    },
    "/can/POWER_STATUS": {
        "voltage_v": "voltage_v", "current_a": "current_a", "charge_ratio": "charge_ratio",
        "temperature_c": "battery_temperature_c",
    },
}  # fmt: skip
LIVE: Mapping[str, View] = {
    **{topic: VIEWS[topic] for topic in ("/pose", "/tf", "/log", *FRAMES)},
    "/telemetry": View("eldorado.telemetry", {row.name: _NUMBER for row in TABLE}, ""),
    "/goal": View("foxglove.PoseInFrame", _POSE, ""),
    "/path": View("foxglove.PosesInFrame", {
        "timestamp": _POSE["timestamp"], "frame_id": _TEXT, "poses": {"type": "array", "items": _POSE["pose"]},
    }, ""),
    "/link": View("eldorado.link", dict.fromkeys(
        ("received_s_ago", "round_trip_s", "datagrams", "refused", "in_contact"), _NUMBER), ""),
}  # fmt: skip


class Message(NamedTuple):
    """One message: topic, onboard time, JSON object."""

    topic: str
    at_ns: int
    value: dict[str, Any]


def messages(news: Sequence[News], items: Mapping[str, Item]) -> Iterator[Message]:
    """Yield the messages of one turn. items: newest value of each item."""
    for one in news:
        if isinstance(one, EventHeard):
            row = {"now_ns": one.onboard_ns, "severity": one.severity, "name": one.name, "text": one.text}
            yield from (Message(topic, one.onboard_ns, value) for topic, value in of_event(row, one.onboard_ns))
        elif isinstance(one, ProductHeard) and one.product.name == WAY:
            yield from _path(one.product.data, max((item.onboard_ns for item in items.values()), default=0))
    came = {one.name: one for one in news if isinstance(one, Item) and math.isfinite(one.value)}
    if came:
        yield from _values(came, items)


def link(received_s_ago: float, round_trip_s: float, counts: Mapping[str, int], in_contact: bool) -> dict[str, Any]:
    """Message of /link."""
    refused = sum(count for kind, count in counts.items() if kind != "ok")
    return {"received_s_ago": received_s_ago, "round_trip_s": round_trip_s, "datagrams": counts["ok"],
            "refused": refused, "in_contact": int(in_contact)}


def _values(came: Mapping[str, Item], items: Mapping[str, Item]) -> Iterator[Message]:
    at_ns = max(one.onboard_ns for one in came.values())
    yield Message("/telemetry", at_ns, {name: one.value for name, one in came.items()})
    place = _newest(items, _PLACE)
    if place is not None and came.keys() & set(_PLACE):
        pose_ns = max(items[name].onboard_ns for name in _PLACE)
        yield from (Message(topic, pose_ns, value) for topic, value in of_pose(place, pose_ns))
    goal = _newest(items, ("goal_x_m", "goal_y_m"))
    if goal is not None and "goal_x_m" in came:
        level = {**dict.fromkeys(_PLACE, 0.0), "x_m": goal["goal_x_m"], "y_m": goal["goal_y_m"]}
        yield Message("/goal", at_ns, dict(of_pose(level, at_ns))["/pose"])
    for topic, fields in FRAMES.items():
        held = {field: came[name].value for field, name in fields.items() if name in came}
        if held:
            yield Message(topic, at_ns, held)


def _newest(items: Mapping[str, Item], names: Sequence[str]) -> dict[str, float] | None:
    """Values of these items; None unless all are known."""
    found = {name: items[name].value for name in names if name in items and math.isfinite(items[name].value)}
    return found if len(found) == len(names) else None


def _path(data: bytes, at_ns: int) -> Iterator[Message]:
    """Path of a goto's answer, on the ground plane; nothing if the answer is damaged or has no path."""
    try:
        way = decode_way(data)
    except WireError:
        return
    corners = [*way.path, *((x_m, y_m, 0.0) for x_m, y_m, *_ in way.beyond)]
    poses = [dict(of_pose({**dict.fromkeys(_PLACE, 0.0), "x_m": x_m, "y_m": y_m, "yaw_rad": yaw_rad}, at_ns))["/pose"]
             for x_m, y_m, yaw_rad in corners]
    stamp = {"sec": at_ns // 1_000_000_000, "nsec": at_ns % 1_000_000_000}
    yield Message("/path", at_ns, {"timestamp": stamp, "frame_id": "map", "poses": [one["pose"] for one in poses]})
