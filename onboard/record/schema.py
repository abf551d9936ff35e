"""Channels of a record: encoding of one tick's inputs and outputs, and decoding of inputs.

Each channel is one MCAP topic with one message for each tick in which it has data; LAYOUTS describes its bytes.
"""

from __future__ import annotations

import json
import struct
import zlib

from onboard.record import registrations
from onboard.records import (
    BusStatus,
    BusTrouble,
    Chunk,
    Frame,
    Health,
    Inputs,
    LinkMessage,
    Machine,
    Outputs,
    PortState,
    RecordedParts,
    RecordStatus,
    RecordTrouble,
    Timing,
)
from onboard.records.status import SaveResult

TICK = struct.Struct("<QqBB3q")
_BUS = struct.Struct(f"<BII{len(BusTrouble)}I")
_TIME = struct.Struct("<qBB")
_RECORD = struct.Struct("<BBQ")
_MACHINE = struct.Struct(f"<{len(Machine._fields)}d")
CANCELLED = 1 << 31
_FRAME_IN = struct.Struct("<qHB")
_CHUNK = struct.Struct("<qI")
_MESSAGE = struct.Struct("<qBBBBH")
FRAME_OUT = struct.Struct("<HB")
PAYLOAD = struct.Struct("<BH")
_SAVED, SAVE = struct.Struct("<BB"), struct.Struct("<BI")
POSE = struct.Struct("<6d")

# little-endian; rows follow each other without a gap
LAYOUTS = {
    "/in/tick": "tick u64, now_ns i64, lidar_state u8, link_state u8, health 3 x i64, then ids (u32) of jobs taken",
    "/in/bus": "of a CAN bus that is not as at the start: state u8, send failures u32, openings u32, error frames by "
    "kind 9 x u32, then the error's words",
    "/in/time": "of a tick that was measured: late_ns i64, numbers of groups and of jobs u8 each, nanoseconds i64 of "
    "each",
    "/in/machine": "of a tick after a look at the computer: the fields of onboard.records.status.Machine, 6 x f64",
    "/in/record": "of a record that is not all well: keeps u8, trouble u8, lost ticks u64, then the error's words",
    "/in/can": "per frame: stamp_ns i64, id u16, length u8, data",
    "/in/lidar": "per chunk: rx_ns i64, length u32, data",
    "/in/disk": "per result of a save: name length u8, error length u8, both",
    "/in/registration": "per registration whose job was taken: its id u32, length u32, then T_map_base and covariance "
    "(each 16 x f64, row by row), inlier ratio, apart_m, moved_m, moved_rad (f64), JSON of the "
    "rest: onboard.record.registrations",
    "/in/link": "per message: rx_ns i64, accepted u8, station u8, kind u8, verdict length u8, payload length u16, both",
    "/out/tick": "state digest 8 B, CRC-32 of the ten input messages (10 x u32, in the order of this list), connect "
    "u8 (1 LIDAR, 2 CAN, 4 reboot), then ids (u32) of new jobs, with the highest bit set cancelled ones",
    "/out/can": "per frame: id u16, length u8, data",
    "/out/lidar": "bytes",
    "/out/link": "per payload: kind u8, length u16, data",
    "/out/event": "JSON: a list of now_ns, severity, name, text",
    "/out/pose": "estimate: x, y, z (m), roll, pitch, yaw (rad), 6 x f64",
    "/out/disk": "per save: name length u8, data length u32, both",
    "/state": "which item of state differs: number of parts u8, items of each u16, a check byte of each item: "
    "onboard.record.state_checks",
    "/plan": "of a tick that took a plan: onboard.planning.archive, .npz",
}
INPUTS = tuple(topic for topic in LAYOUTS if topic.startswith("/in/"))
OUTPUTS = tuple(topic for topic in LAYOUTS if topic.startswith("/out/"))
_CHECKS = struct.Struct(f"<{len(INPUTS)}I")
LEAN = ("/out/tick", "/out/event")  # recorded even if the disk accepts little: see onboard.records.status.RecordedParts


def encode_inputs(inputs: Inputs) -> dict[str, bytes]:
    """Encode inputs: topic -> message, for the channels that have data; /in/tick always."""
    ids = b"".join(struct.pack("<I", job.job_id) for job in inputs.jobs)
    head = TICK.pack(
        inputs.tick,
        inputs.now_ns,
        inputs.lidar_state,
        inputs.link_state,
        *inputs.health,
    )
    messages = {"/in/tick": head + ids}
    if inputs.can != BusStatus():
        messages["/in/bus"] = _bus_bytes(inputs.can)
    if inputs.timing != Timing():
        messages["/in/time"] = _time_bytes(inputs.timing)
    if inputs.machine is not None:
        messages["/in/machine"] = _MACHINE.pack(*inputs.machine)
    if inputs.record != RecordStatus():
        messages["/in/record"] = _record_bytes(inputs.record)
    if inputs.can_frames:
        messages["/in/can"] = b"".join(
            _FRAME_IN.pack(stamp, can_id, len(data)) + data for can_id, data, stamp in inputs.can_frames
        )
    if inputs.lidar_chunks:
        messages["/in/lidar"] = b"".join(_CHUNK.pack(rx, len(data)) + data for rx, data in inputs.lidar_chunks)
    if inputs.link_messages:
        messages["/in/link"] = b"".join(
            _MESSAGE.pack(m.rx_ns, m.accepted, m.station, m.kind, len(m.verdict), len(m.payload))
            + m.verdict.encode()
            + m.payload
            for m in inputs.link_messages
        )
    if inputs.saved:
        pairs = [(name.encode(), error.encode()[:255]) for name, error in inputs.saved]
        messages["/in/disk"] = b"".join(_SAVED.pack(len(name), len(error)) + name + error for name, error in pairs)
    if registered := registrations.encode(inputs.jobs):
        messages["/in/registration"] = registered
    return messages


def decode_inputs(messages: dict[str, bytes]) -> tuple[Inputs, tuple[int, ...]]:
    """Decode the inputs of one tick without the jobs' values, and the ids of the jobs whose results were taken."""
    raw = messages["/in/tick"]
    tick, now_ns, lidar_state, link_state, *health = TICK.unpack_from(raw)
    ids = struct.unpack(f"<{(len(raw) - TICK.size) // 4}I", raw[TICK.size :])
    inputs = Inputs(
        tick,
        now_ns,
        can_frames=read_frames(messages.get("/in/can", b"")),
        can=read_bus(messages.get("/in/bus", b"")),
        lidar_chunks=read_chunks(messages.get("/in/lidar", b"")),
        lidar_state=PortState(lidar_state),
        link_messages=read_link(messages.get("/in/link", b"")),
        link_state=PortState(link_state),
        health=Health(*health),
        timing=read_timing(messages.get("/in/time", b"")),
        saved=read_saved(messages.get("/in/disk", b"")),
        record=read_record(messages.get("/in/record", b"")),
        machine=read_machine(messages.get("/in/machine", b"")),
    )
    return inputs, ids


def _bus_bytes(bus: BusStatus) -> bytes:
    return _BUS.pack(bus.state, bus.send_failures, bus.openings, *bus.error_frames) + bus.error.encode()


def read_bus(raw: bytes) -> BusStatus:
    """Decode the message of /in/bus; a default status if there is none."""
    if not raw:
        return BusStatus()
    state, failures, openings, *errors = _BUS.unpack_from(raw)
    return BusStatus(PortState(state), raw[_BUS.size :].decode(), failures, openings, tuple(errors))


def _record_bytes(record: RecordStatus) -> bytes:
    return _RECORD.pack(record.keeps, record.trouble, record.lost_ticks) + record.error.encode()


def read_record(raw: bytes) -> RecordStatus:
    """Decode the message of /in/record; a default status if there is none."""
    if not raw:
        return RecordStatus()
    keeps, trouble, lost_ticks = _RECORD.unpack_from(raw)
    return RecordStatus(RecordedParts(keeps), RecordTrouble(trouble), raw[_RECORD.size :].decode(), lost_ticks)


def _time_bytes(timing: Timing) -> bytes:
    rows = (*timing.group_ns, *timing.job_ns)
    return _TIME.pack(timing.late_ns, len(timing.group_ns), len(timing.job_ns)) + struct.pack(f"<{len(rows)}q", *rows)


def read_timing(raw: bytes) -> Timing:
    """Decode the message of /in/time; a default timing if there is none."""
    if not raw:
        return Timing()
    late_ns, groups, jobs = _TIME.unpack_from(raw)
    rows = struct.unpack_from(f"<{groups + jobs}q", raw, _TIME.size)
    return Timing(late_ns, rows[:groups], rows[groups:])


def read_machine(raw: bytes) -> Machine | None:
    """Decode the message of /in/machine; None if there is none."""
    return Machine(*_MACHINE.unpack(raw)) if raw else None


def read_frames(raw: bytes) -> tuple[Frame, ...]:
    """Decode the frames of /in/can."""
    frames, at = [], 0
    while at < len(raw):
        stamp_ns, can_id, size = _FRAME_IN.unpack_from(raw, at)
        at += _FRAME_IN.size
        frames.append(Frame(can_id, raw[at : at + size], stamp_ns))
        at += size
    return tuple(frames)


def read_chunks(raw: bytes) -> tuple[Chunk, ...]:
    """Decode the chunks of /in/lidar."""
    chunks, at = [], 0
    while at < len(raw):
        rx_ns, size = _CHUNK.unpack_from(raw, at)
        at += _CHUNK.size
        chunks.append(Chunk(rx_ns, raw[at : at + size]))
        at += size
    return tuple(chunks)


def read_link(raw: bytes) -> tuple[LinkMessage, ...]:
    """Decode the messages of /in/link."""
    found, at = [], 0
    while at < len(raw):
        rx_ns, accepted, station, kind, verdict_size, size = _MESSAGE.unpack_from(raw, at)
        at += _MESSAGE.size
        verdict = raw[at : at + verdict_size].decode()
        at += verdict_size
        found.append(LinkMessage(rx_ns, bool(accepted), verdict, station, kind, raw[at : at + size]))
        at += size
    return tuple(found)


def read_saved(raw: bytes) -> tuple[SaveResult, ...]:
    """Decode the results of /in/disk."""
    found, at = [], 0
    while at < len(raw):
        name, error = _SAVED.unpack_from(raw, at)
        at += _SAVED.size
        found.append(
            SaveResult(raw[at : at + name].decode(), raw[at + name : at + name + error].decode(errors="replace"))
        )
        at += name + error
    return tuple(found)


def encode_outputs(outputs: Outputs, inputs: dict[str, bytes]) -> dict[str, bytes]:
    """Encode one tick's outputs: topic -> message; /out/tick contains checksums of the inputs."""
    checks = _CHECKS.pack(*(zlib.crc32(inputs.get(topic, b"")) for topic in INPUTS))
    ids = struct.pack(
        f"<{len(outputs.jobs) + len(outputs.cancelled)}I",
        *(job.job_id for job in outputs.jobs),
        *(job_id | CANCELLED for job_id in outputs.cancelled),
    )
    connect = outputs.lidar_connect | outputs.can_connect << 1 | outputs.reboot << 2
    messages = {"/out/tick": outputs.state_digest + checks + bytes([connect]) + ids}
    if outputs.can_frames:
        messages["/out/can"] = b"".join(
            FRAME_OUT.pack(can_id, len(data)) + data for can_id, data, _ in outputs.can_frames
        )
    if outputs.lidar_bytes:
        messages["/out/lidar"] = outputs.lidar_bytes
    if outputs.link_payloads:
        messages["/out/link"] = b"".join(
            PAYLOAD.pack(kind, len(payload)) + payload for kind, payload in outputs.link_payloads
        )
    if outputs.events:
        rows = [{"now_ns": e.now_ns, "severity": e.severity, "name": e.name, "text": e.text} for e in outputs.events]
        messages["/out/event"] = json.dumps(rows).encode()
    if outputs.saves:
        messages["/out/disk"] = b"".join(
            SAVE.pack(len(name.encode()), len(data)) + name.encode() + data for name, data in outputs.saves
        )
    messages["/out/pose"] = POSE.pack(*outputs.pose)
    return messages


def input_checks(out_tick: bytes) -> dict[str, int]:
    """CRC-32 of each input channel, from the message of /out/tick."""
    return dict(zip(INPUTS, _CHECKS.unpack_from(out_tick, 8)))
