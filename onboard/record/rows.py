"""TABLE of channels: decoders of messages to rows of named values, for people and for other tools."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from onboard.record import registrations, state_checks
from onboard.record.schema import (
    CANCELLED,
    FRAME_OUT,
    INPUTS,
    PAYLOAD,
    POSE,
    SAVE,
    TICK,
    input_checks,
    read_bus,
    read_chunks,
    read_frames,
    read_link,
    read_machine,
    read_record,
    read_saved,
    read_timing,
)
from onboard.records import BusTrouble, Health, PortState
from protocol import WireError
from protocol.generated.can_codec import TABLE
from protocol.link.datagrams import DatagramKind

Row = dict[str, Any]
_DIGEST_BYTES = 8
_POSE_FIELDS = ("x_m", "y_m", "z_m", "roll_rad", "pitch_rad", "yaw_rad")


def _tick_in(raw: bytes) -> Iterator[Row]:
    tick, now_ns, lidar, link, *health = TICK.unpack_from(raw)
    yield {
        "tick": tick,
        "now_ns": now_ns,
        "lidar_state": PortState(lidar).name,
        "link_state": PortState(link).name,
        **Health(*health)._asdict(),
        "jobs_taken": _ids(raw[TICK.size :]),
    }


def _bus_in(raw: bytes) -> Iterator[Row]:
    bus = read_bus(raw)
    errors = {f"{BusTrouble(kind).name.lower()}_frames": count for kind, count in enumerate(bus.error_frames)}
    yield {
        "state": bus.state.name,
        "error": bus.error,
        "send_failures": bus.send_failures,
        "openings": bus.openings,
        **errors,
    }


def _time_in(raw: bytes) -> Iterator[Row]:
    timing = read_timing(raw)
    yield {"late_ns": timing.late_ns, "group_ns": list(timing.group_ns), "job_ns": list(timing.job_ns)}


def _machine_in(raw: bytes) -> Iterator[Row]:
    if machine := read_machine(raw):
        yield machine._asdict()


def _record_in(raw: bytes) -> Iterator[Row]:
    record = read_record(raw)
    yield {**record._asdict(), "keeps": record.keeps.name, "trouble": record.trouble.name}


def _can_in(raw: bytes) -> Iterator[Row]:
    for can_id, data, stamp_ns in read_frames(raw):
        yield {"stamp_ns": stamp_ns, **frame(can_id, data)}


def _lidar_in(raw: bytes) -> Iterator[Row]:
    for rx_ns, data in read_chunks(raw):
        yield {"rx_ns": rx_ns, "bytes": len(data), "text": data.decode("latin-1")}


def _link_in(raw: bytes) -> Iterator[Row]:
    for message in read_link(raw):
        yield {**message._asdict(), "kind": _kind(message.kind), "payload": message.payload.hex()}


def _disk_in(raw: bytes) -> Iterator[Row]:
    for name, error in read_saved(raw):
        yield {"name": name, "error": error}


def _registration_in(raw: bytes) -> Iterator[Row]:
    for job_id, fields in registrations.decode(raw):
        matrices = {name: fields[name].ravel().tolist() for name in ("T_map_base", "covariance")}
        yield {"job_id": job_id, **fields, **matrices, "degenerate": list(fields["degenerate"])}


def _tick_out(raw: bytes) -> Iterator[Row]:
    at = _DIGEST_BYTES + 4 * len(INPUTS)
    checks = {f"crc_of{topic.replace('/', '_')}": f"{check:08x}" for topic, check in input_checks(raw).items()}
    ids = _ids(raw[at + 1 :])
    yield {
        "state_digest": raw[:_DIGEST_BYTES].hex(),
        "connect_lidar": raw[at] & 1,
        "connect_can": raw[at] >> 1 & 1,
        "reboot": raw[at] >> 2 & 1,
        "jobs": [i for i in ids if i < CANCELLED],
        "cancelled": [i - CANCELLED for i in ids if i >= CANCELLED],
        **checks,
    }


def _can_out(raw: bytes) -> Iterator[Row]:
    at = 0
    while at < len(raw):
        can_id, size = FRAME_OUT.unpack_from(raw, at)
        at += FRAME_OUT.size + size
        yield frame(can_id, raw[at - size : at])


def _lidar_out(raw: bytes) -> Iterator[Row]:
    yield {"bytes": len(raw), "text": raw.decode("latin-1")}


def _link_out(raw: bytes) -> Iterator[Row]:
    at = 0
    while at < len(raw):
        kind, size = PAYLOAD.unpack_from(raw, at)
        at += PAYLOAD.size + size
        yield {"kind": _kind(kind), "payload": raw[at - size : at].hex()}


def _event_out(raw: bytes) -> Iterator[Row]:
    yield from json.loads(raw)


def _pose_out(raw: bytes) -> Iterator[Row]:
    yield dict(zip(_POSE_FIELDS, POSE.unpack(raw), strict=True))


def _disk_out(raw: bytes) -> Iterator[Row]:
    at = 0
    while at < len(raw):
        name_size, size = SAVE.unpack_from(raw, at)
        at += SAVE.size
        yield {"name": raw[at : at + name_size].decode(), "data": raw[at + name_size : at + name_size + size].hex()}
        at += name_size + size


def _state(raw: bytes) -> Iterator[Row]:
    counts, checks = state_checks.read(raw)
    yield {"items": counts, "checks": checks.hex()}


def _plan(raw: bytes) -> Iterator[Row]:
    yield {"bytes": len(raw)}


ROWS: Mapping[str, Callable[[bytes], Iterator[Row]]] = {
    "/in/tick": _tick_in, "/in/bus": _bus_in, "/in/time": _time_in, "/in/machine": _machine_in,
    "/in/record": _record_in, "/in/can": _can_in,
    "/in/lidar": _lidar_in, "/in/disk": _disk_in, "/in/link": _link_in, "/in/registration": _registration_in,
    "/out/tick": _tick_out, "/out/can": _can_out, "/out/lidar": _lidar_out, "/out/link": _link_out,
    "/out/event": _event_out, "/out/pose": _pose_out, "/out/disk": _disk_out, "/state": _state, "/plan": _plan,
}  # fmt: skip


def frame(can_id: int, data: bytes) -> Row:
    """Decode a CAN frame; with its signals if the DBC has it and they are within their ranges."""
    head = {"can_id": can_id, "data": data.hex()}
    known = TABLE.get(can_id)
    if known is None:
        return {**head, "frame": ""}
    try:
        return {**head, "frame": known.name, **dict(zip(known.fields, known.decode(data), strict=True))}
    except WireError as error:
        return {**head, "frame": known.name, "error": str(error)}


def first_difference(topic: str, recorded: bytes, made: bytes) -> str:
    """Describe the first difference of two messages of a channel: byte and, if it can be named, row and field."""
    at = next((k for k, (a, b) in enumerate(zip(recorded, made)) if a != b), min(len(recorded), len(made)))
    field = _first_field(topic, recorded, made)
    return (
        f"byte {at}: recorded {recorded[at : at + 8].hex() or 'nothing'}, now {made[at : at + 8].hex() or 'nothing'} "
        f"(lengths {len(recorded)}, {len(made)}){field}"
    )


def _first_field(topic: str, recorded: bytes, made: bytes) -> str:
    try:
        old, new = (list(ROWS[topic](raw)) if raw else [] for raw in (recorded, made))
    except (ValueError, IndexError, KeyError, struct.error):
        return ""
    for k, (was, now) in enumerate(zip(old, new)):
        for name in {**was, **now}:
            if was.get(name) != now.get(name):
                return f"; row {k}, {name}: recorded {was.get(name)}, now {now.get(name)}"
    return f"; rows: recorded {len(old)}, now {len(new)}"


def _ids(raw: bytes) -> list[int]:
    return list(struct.unpack(f"<{len(raw) // 4}I", raw[: len(raw) // 4 * 4]))


def _kind(number: int) -> str:
    return DatagramKind(number).name if number in set(DatagramKind) else str(number)
