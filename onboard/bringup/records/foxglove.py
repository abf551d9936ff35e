"""Export of a record as an MCAP file for Foxglove: JSON with schemas, the pose and events in Foxglove's own types.

/pose  /tf    from /out/pose    foxglove.PoseInFrame, foxglove.FrameTransform (base_link in map)
/log          from /out/event   foxglove.Log
/health       from /in/tick     eldorado.health     /machine    from /in/machine   eldorado.machine
/can/NAME     from /in/can and /out/can, a channel for each frame of the DBC: its signals by name
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from mcap.writer import CompressionType, Writer

from onboard.record.reader import Record, reading, time_ns_of
from onboard.record.rows import ROWS
from onboard.records import Health, Machine
from protocol.generated.can_codec import TABLE
from protocol.tables.modes import SEVERITIES

Value = dict[str, Any]
EVERY = {"/out/pose": 5, "/in/tick": 50}  # ticks: 20 and 2 a second are enough for display
_NUMBER, _TEXT = {"type": "number"}, {"type": "string"}
_STAMP = {"type": "object", "properties": {"sec": _NUMBER, "nsec": _NUMBER}}
_XYZ = {"type": "object", "properties": {axis: _NUMBER for axis in "xyz"}}
_XYZW = {"type": "object", "properties": {axis: _NUMBER for axis in "xyzw"}}


class ExportedChannel(NamedTuple):
    """One exported channel.

    schema: name of its schema.
    fields: name -> JSON schema.
    source: channel of the record from which it is computed.
    """

    schema: str
    fields: Mapping[str, Value]
    source: str


VIEWS: Mapping[str, ExportedChannel] = {
    "/pose": ExportedChannel("foxglove.PoseInFrame", {
        "timestamp": _STAMP, "frame_id": _TEXT,
        "pose": {"type": "object", "properties": {"position": _XYZ, "orientation": _XYZW}},
    }, "/out/pose"),
    "/tf": ExportedChannel("foxglove.FrameTransform", {
        "timestamp": _STAMP, "parent_frame_id": _TEXT, "child_frame_id": _TEXT, "translation": _XYZ, "rotation": _XYZW,
    }, "/out/pose"),
    "/log": ExportedChannel("foxglove.Log", {
        "timestamp": _STAMP, "level": _NUMBER, "message": _TEXT, "name": _TEXT, "file": _TEXT, "line": _NUMBER,
    }, "/out/event"),
    "/health": ExportedChannel("eldorado.health", dict.fromkeys(Health._fields, _NUMBER), "/in/tick"),
    "/machine": ExportedChannel("eldorado.machine", dict.fromkeys(Machine._fields, _NUMBER), "/in/machine"),
    **{
        f"/can/{frame.name}": ExportedChannel(
            f"eldorado.can.{frame.name}", dict.fromkeys(frame.fields, _NUMBER),
            "/out/can" if frame.sender == "COMPUTER" else "/in/can",
        )
        for frame in TABLE.values()
    },
}  # fmt: skip


def write_foxglove(record: Record, channels: Sequence[str], out: Path) -> int:
    """Write the views of some channels. Returns the number of messages."""
    count = 0
    with out.open("wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD)
        writer.start(profile="", library="el-dorado")
        ids = {topic: _register(writer, topic) for topic, view in VIEWS.items() if view.source in channels}
        for number, messages in record.ticks():
            now_ns = time_ns_of(number, messages)
            for source in channels:
                if source in messages and number % EVERY.get(source, 1) == 0:
                    with reading(number, f"channel {source}"):
                        made = list(_made(source, messages[source], now_ns))
                    for topic, value in made:
                        writer.add_message(ids[topic], now_ns, json.dumps(value).encode(), now_ns, number)
                        count += 1
        writer.finish()  # type: ignore[no-untyped-call]
    return count


def _register(writer: Writer, topic: str) -> int:
    view = VIEWS[topic]
    shape = {"type": "object", "title": view.schema, "properties": dict(view.fields)}
    return writer.register_channel(
        topic, "json", writer.register_schema(view.schema, "jsonschema", json.dumps(shape).encode())
    )


def _made(source: str, raw: bytes, now_ns: int) -> Iterator[tuple[str, Value]]:
    """Yield (topic, message) for Foxglove from one message of the record."""
    for row in ROWS[source](raw) if source in _MAKERS else ():
        yield from _MAKERS[source](row, now_ns)


def of_pose(row: Value, now_ns: int) -> Iterator[tuple[str, Value]]:
    """Yield the views of a pose: x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad."""
    place = {axis: row[f"{axis}_m"] for axis in "xyz"}
    turn = _quaternion(row["roll_rad"], row["pitch_rad"], row["yaw_rad"])
    at = {"timestamp": stamp(now_ns)}
    yield "/pose", {**at, "frame_id": "map", "pose": {"position": place, "orientation": turn}}
    yield (
        "/tf",
        {
            **at,
            "parent_frame_id": "map",
            "child_frame_id": "base_link",
            "translation": place,
            "rotation": turn,
        },
    )


def of_event(row: Value, now_ns: int) -> Iterator[tuple[str, Value]]:
    """Yield the view of an event: now_ns, severity, name, text."""
    level = SEVERITIES.index(row["severity"]) + 1  # foxglove.Log counts from 1, debug, to 5, fatal
    yield (
        "/log",
        {
            "timestamp": stamp(row["now_ns"]),
            "level": level,
            "message": row["text"],
            "name": row["name"],
            "file": "",
            "line": 0,
        },
    )


def _of_tick(row: Value, now_ns: int) -> Iterator[tuple[str, Value]]:
    yield "/health", {name: row[name] for name in Health._fields}


def _of_machine(row: Value, now_ns: int) -> Iterator[tuple[str, Value]]:
    yield "/machine", {name: number for name, number in row.items() if number == number}  # JSON has no NaN


def _of_frame(row: Value, now_ns: int) -> Iterator[tuple[str, Value]]:
    if row["frame"] and "error" not in row:
        topic = f"/can/{row['frame']}"
        yield topic, {name: row[name] for name in VIEWS[topic].fields}


_MAKERS = {
    "/out/pose": of_pose, "/out/event": of_event, "/in/tick": _of_tick,
    "/in/machine": _of_machine, "/in/can": _of_frame, "/out/can": _of_frame,
}  # fmt: skip


def stamp(now_ns: int) -> Value:
    """Time as Foxglove's schemas have it."""
    return {"sec": now_ns // 1_000_000_000, "nsec": now_ns % 1_000_000_000}


def _quaternion(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Value:
    """Quaternion of intrinsic z-y-x angles."""
    cr, sr = math.cos(roll_rad / 2), math.sin(roll_rad / 2)
    cp, sp = math.cos(pitch_rad / 2), math.sin(pitch_rad / 2)
    cy, sy = math.cos(yaw_rad / 2), math.sin(yaw_rad / 2)
    return {
        "x": sr * cp * cy - cr * sp * sy,
        "y": cr * sp * cy + sr * cp * sy,
        "z": cr * cp * sy - sr * sp * cy,
        "w": cr * cp * cy + sr * sp * sy,
    }
