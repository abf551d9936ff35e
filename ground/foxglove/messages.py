"""Live data as JSON messages for Foxglove: topics and schemas of an exported record, as far as the link carries them.

    /pose  /tf      from the telemetry's pose          foxglove.PoseInFrame, foxglove.FrameTransform
    /log            from the events                    foxglove.Log
    /can/NAME       from the telemetry's values        eldorado.can.NAME, of wheels and battery
    /telemetry      every received value               eldorado.telemetry
    /goal  /path    from telemetry and a goto's answer foxglove.PoseInFrame, foxglove.PosesInFrame
    /link           once a second                      eldorado.link

Pure: news in, messages out. Times of messages are onboard time, as in the record.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

from ground.cli.operations.show import WAY
from ground.link.news import EventHeard, Item, News, ProductHeard
from onboard.bringup.records.foxglove import VIEWS, ExportedChannel, of_event, of_pose, stamp
from protocol import WireError
from protocol.products.way import decode_way
from protocol.tables.telemetry import TABLE

_NUMBER, _TEXT = {"type": "number"}, {"type": "string"}
_POSE = VIEWS["/pose"].fields
_PLACE = ("x_m", "y_m", "z_m", "roll_rad", "pitch_rad", "yaw_rad")
# topic -> field of the DBC's frame -> item of the telemetry
FRAMES: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        **{
            f"/can/WHEEL_{n}_FEEDBACK": {
                "steer_rad": f"steer_{n}_rad",
                "rate_radps": f"rate_{n}_radps",
                "state": f"wheel_state_{n}",
            }
            for n in (1, 2, 3, 4)
        },
        "/can/POWER_STATUS": {
            "voltage_v": "voltage_v",
            "current_a": "current_a",
            "charge_ratio": "charge_ratio",
            "temperature_c": "battery_temperature_c",
        },
    }
)
_LINK = ("received_s_ago", "round_trip_s", "datagrams", "refused", "in_contact")
CHANNELS: Mapping[str, ExportedChannel] = MappingProxyType(
    {
        **{topic: VIEWS[topic] for topic in ("/pose", "/tf", "/log", *FRAMES)},
        "/telemetry": ExportedChannel("eldorado.telemetry", {row.name: _NUMBER for row in TABLE}, ""),
        "/goal": ExportedChannel("foxglove.PoseInFrame", _POSE, ""),
        "/path": ExportedChannel(
            "foxglove.PosesInFrame",
            {
                "timestamp": _POSE["timestamp"],
                "frame_id": _TEXT,
                "poses": {"type": "array", "items": _POSE["pose"]},
            },
            "",
        ),
        "/link": ExportedChannel("eldorado.link", dict.fromkeys(_LINK, _NUMBER), ""),
    }
)


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
    received = {one.name: one for one in news if isinstance(one, Item) and math.isfinite(one.value)}
    if received:
        yield from _values(received, items)


def link(received_s_ago: float, round_trip_s: float, counts: Mapping[str, int], in_contact: bool) -> dict[str, Any]:
    """Return the message of /link."""
    refused = sum(count for kind, count in counts.items() if kind != "ok")
    values = (received_s_ago, round_trip_s, counts["ok"], refused, int(in_contact))
    return dict(zip(_LINK, values, strict=True))


def _values(received: Mapping[str, Item], items: Mapping[str, Item]) -> Iterator[Message]:
    at_ns = max(one.onboard_ns for one in received.values())
    yield Message("/telemetry", at_ns, {name: one.value for name, one in received.items()})
    place = _newest(items, _PLACE)
    if place is not None and received.keys() & set(_PLACE):
        pose_ns = max(items[name].onboard_ns for name in _PLACE)
        yield from (Message(topic, pose_ns, value) for topic, value in of_pose(place, pose_ns))
    goal = _newest(items, ("goal_x_m", "goal_y_m"))
    if goal is not None and "goal_x_m" in received:
        yield Message("/goal", at_ns, _level_pose(goal["goal_x_m"], goal["goal_y_m"], 0.0, at_ns))
    for topic, fields in FRAMES.items():
        values = {field: received[name].value for field, name in fields.items() if name in received}
        if values:
            yield Message(topic, at_ns, values)


def _newest(items: Mapping[str, Item], names: Sequence[str]) -> dict[str, float] | None:
    """Return the values of these items; None unless all are known."""
    known = {name: items[name].value for name in names if name in items and math.isfinite(items[name].value)}
    return known if len(known) == len(names) else None


def _level_pose(x_m: float, y_m: float, yaw_rad: float, at_ns: int) -> dict[str, Any]:
    """Return a foxglove.PoseInFrame on the ground plane."""
    place = {**dict.fromkeys(_PLACE, 0.0), "x_m": x_m, "y_m": y_m, "yaw_rad": yaw_rad}
    return dict(of_pose(place, at_ns))["/pose"]


def _path(data: bytes, at_ns: int) -> Iterator[Message]:
    """Yield the path of a goto's answer, on the ground plane; nothing if the answer is damaged or has no path."""
    try:
        way = decode_way(data)
    except WireError:
        return
    corners = [*way.path, *((x_m, y_m, 0.0) for x_m, y_m, *_ in way.beyond)]
    poses = [_level_pose(x_m, y_m, yaw_rad, at_ns)["pose"] for x_m, y_m, yaw_rad in corners]
    yield Message("/path", at_ns, {"timestamp": stamp(at_ns), "frame_id": "map", "poses": poses})
