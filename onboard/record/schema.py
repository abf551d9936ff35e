"""The record's channels: how one tick's inputs and outputs become bytes, and how inputs come back from them.

Each channel is one MCAP topic with one message for each tick in which it has something. Little-endian; layouts:

    /in/tick    tick u64, now_ns i64, lidar_state u8, link_state u8, health 3 x i64, then the ids (u32) of jobs taken
    /in/bus     of a CAN bus that is not as at the start: state u8, send failures u32, openings u32, error frames by
                kind 9 x u32, then the error's words
    /in/time    of a tick that was measured: late_ns i64, numbers of groups and of jobs u8 each, nanoseconds i64 of each
    /in/machine of a tick after a look at the computer: the fields of Machine, 6 x f64
    /in/can     per frame: stamp_ns i64, id u16, length u8, data
    /in/lidar   per chunk: rx_ns i64, length u32, data
    /in/disk    per result of a save: name length u8, error length u8, both
    /in/link    per message: rx_ns i64, accepted u8, station u8, kind u8, verdict length u8, payload length u16, both
    /out/tick   state digest 8 B, CRC-32 of the eight input messages (8 x u32), connect u8 (1 LIDAR, 2 CAN, 4 reboot),
                then ids (u32) of new jobs, and with the highest bit set those of cancelled ones
    /out/can    per frame: id u16, length u8, data          /out/lidar   bytes
    /out/disk   per save: name length u8, data length u32, both
    /out/link   per payload: kind u8, length u16, data      /out/event   JSON      /out/pose   6 x f64
"""

from __future__ import annotations

import json
import struct
import zlib

from onboard.ports import Saved
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
    Timing,
)

_TICK = struct.Struct("<QqBB3q")
_BUS = struct.Struct(f"<BII{len(BusTrouble)}I")
_TIME = struct.Struct("<qBB")
_MACHINE = struct.Struct(f"<{len(Machine._fields)}d")
_CHECKS = struct.Struct("<8I")
_CANCELLED = 1 << 31
_FRAME_IN = struct.Struct("<qHB")
_CHUNK = struct.Struct("<qI")
_MESSAGE = struct.Struct("<qBBBBH")
_FRAME_OUT = struct.Struct("<HB")
_PAYLOAD = struct.Struct("<BH")
_SAVED, _SAVE = struct.Struct("<BB"), struct.Struct("<BI")
_POSE = struct.Struct("<6d")

INPUTS = ("/in/tick", "/in/bus", "/in/time", "/in/can", "/in/lidar", "/in/link", "/in/disk", "/in/machine")
OUTPUTS = ("/out/tick", "/out/can", "/out/lidar", "/out/link", "/out/event", "/out/pose", "/out/disk")


def encode_inputs(inputs: Inputs) -> dict[str, bytes]:
    """Topic -> message, for the channels that have something; /in/tick always."""
    ids = b"".join(struct.pack("<I", job.job_id) for job in inputs.jobs)
    head = _TICK.pack(
        inputs.tick, inputs.now_ns, inputs.lidar_state, inputs.link_state, *inputs.health,
    )
    messages = {"/in/tick": head + ids}
    if inputs.can != BusStatus():
        messages["/in/bus"] = _bus_bytes(inputs.can)
    if inputs.timing != Timing():
        messages["/in/time"] = _time_bytes(inputs.timing)
    if inputs.machine is not None:
        messages["/in/machine"] = _MACHINE.pack(*inputs.machine)
    if inputs.can_frames:
        messages["/in/can"] = b"".join(
            _FRAME_IN.pack(stamp, can_id, len(data)) + data for can_id, data, stamp in inputs.can_frames
        )
    if inputs.lidar_chunks:
        messages["/in/lidar"] = b"".join(_CHUNK.pack(rx, len(data)) + data for rx, data in inputs.lidar_chunks)
    if inputs.link_messages:
        messages["/in/link"] = b"".join(
            _MESSAGE.pack(m.rx_ns, m.accepted, m.station, m.kind, len(m.verdict), len(m.payload))
            + m.verdict.encode() + m.payload
            for m in inputs.link_messages
        )
    if inputs.saved:
        pairs = [(name.encode(), error.encode()[:255]) for name, error in inputs.saved]
        messages["/in/disk"] = b"".join(_SAVED.pack(len(name), len(error)) + name + error for name, error in pairs)
    return messages


def decode_inputs(messages: dict[str, bytes]) -> tuple[Inputs, tuple[int, ...]]:
    """Inputs of one tick without the jobs' values, and the ids of the jobs whose results were taken."""
    raw = messages["/in/tick"]
    tick, now_ns, lidar_state, link_state, *health = _TICK.unpack_from(raw)
    ids = struct.unpack(f"<{(len(raw) - _TICK.size) // 4}I", raw[_TICK.size :])
    inputs = Inputs(
        tick, now_ns,
        can_frames=_frames(messages.get("/in/can", b"")), can=_bus(messages.get("/in/bus", b"")),
        lidar_chunks=_chunks(messages.get("/in/lidar", b"")), lidar_state=PortState(lidar_state),
        link_messages=_link(messages.get("/in/link", b"")), link_state=PortState(link_state),
        health=Health(*health), timing=_timing(messages.get("/in/time", b"")),
        saved=_saved(messages.get("/in/disk", b"")), machine=_machine(messages.get("/in/machine", b"")),
    )
    return inputs, ids


def _bus_bytes(bus: BusStatus) -> bytes:
    return _BUS.pack(bus.state, bus.send_failures, bus.openings, *bus.error_frames) + bus.error.encode()


def _bus(raw: bytes) -> BusStatus:
    if not raw:
        return BusStatus()
    state, failures, openings, *errors = _BUS.unpack_from(raw)
    return BusStatus(PortState(state), raw[_BUS.size :].decode(), failures, openings, tuple(errors))


def _time_bytes(timing: Timing) -> bytes:
    rows = (*timing.group_ns, *timing.job_ns)
    return _TIME.pack(timing.late_ns, len(timing.group_ns), len(timing.job_ns)) + struct.pack(f"<{len(rows)}q", *rows)


def _timing(raw: bytes) -> Timing:
    if not raw:
        return Timing()
    late_ns, groups, jobs = _TIME.unpack_from(raw)
    rows = struct.unpack_from(f"<{groups + jobs}q", raw, _TIME.size)
    return Timing(late_ns, rows[:groups], rows[groups:])


def _machine(raw: bytes) -> Machine | None:
    return Machine(*_MACHINE.unpack(raw)) if raw else None


def _frames(raw: bytes) -> tuple[Frame, ...]:
    frames, at = [], 0
    while at < len(raw):
        stamp_ns, can_id, size = _FRAME_IN.unpack_from(raw, at)
        at += _FRAME_IN.size
        frames.append(Frame(can_id, raw[at : at + size], stamp_ns))
        at += size
    return tuple(frames)


def _chunks(raw: bytes) -> tuple[Chunk, ...]:
    chunks, at = [], 0
    while at < len(raw):
        rx_ns, size = _CHUNK.unpack_from(raw, at)
        at += _CHUNK.size
        chunks.append(Chunk(rx_ns, raw[at : at + size]))
        at += size
    return tuple(chunks)


def _link(raw: bytes) -> tuple[LinkMessage, ...]:
    found, at = [], 0
    while at < len(raw):
        rx_ns, accepted, station, kind, verdict_size, size = _MESSAGE.unpack_from(raw, at)
        at += _MESSAGE.size
        verdict = raw[at : at + verdict_size].decode()
        at += verdict_size
        found.append(LinkMessage(rx_ns, bool(accepted), verdict, station, kind, raw[at : at + size]))
        at += size
    return tuple(found)


def _saved(raw: bytes) -> tuple[Saved, ...]:
    found, at = [], 0
    while at < len(raw):
        name, error = _SAVED.unpack_from(raw, at)
        at += _SAVED.size
        found.append(Saved(raw[at : at + name].decode(), raw[at + name : at + name + error].decode(errors="replace")))
        at += name + error
    return tuple(found)


def encode_outputs(outputs: Outputs, inputs: dict[str, bytes]) -> dict[str, bytes]:
    """Topic -> message of one tick's outputs; /out/tick guards the inputs it was computed from."""
    checks = _CHECKS.pack(*(zlib.crc32(inputs.get(topic, b"")) for topic in INPUTS))
    ids = struct.pack(
        f"<{len(outputs.jobs) + len(outputs.cancelled)}I", *(job.job_id for job in outputs.jobs),
        *(job_id | _CANCELLED for job_id in outputs.cancelled),
    )  # fmt: skip
    connect = outputs.lidar_connect | outputs.can_connect << 1 | outputs.reboot << 2
    messages = {"/out/tick": outputs.state_digest + checks + bytes([connect]) + ids}
    if outputs.can_frames:
        messages["/out/can"] = b"".join(
            _FRAME_OUT.pack(can_id, len(data)) + data for can_id, data, _ in outputs.can_frames
        )
    if outputs.lidar_bytes:
        messages["/out/lidar"] = outputs.lidar_bytes
    if outputs.link_payloads:
        messages["/out/link"] = b"".join(
            _PAYLOAD.pack(kind, len(payload)) + payload for kind, payload in outputs.link_payloads
        )
    if outputs.events:
        rows = [{"now_ns": e.now_ns, "severity": e.severity, "name": e.name, "text": e.text} for e in outputs.events]
        messages["/out/event"] = json.dumps(rows).encode()
    if outputs.saves:
        messages["/out/disk"] = b"".join(
            _SAVE.pack(len(name.encode()), len(data)) + name.encode() + data for name, data in outputs.saves
        )
    messages["/out/pose"] = _POSE.pack(*outputs.pose)
    return messages


def input_checks(out_tick: bytes) -> dict[str, int]:
    """CRC-32 of each input channel as the tick's output remembers it."""
    return dict(zip(INPUTS, _CHECKS.unpack_from(out_tick, 8)))
