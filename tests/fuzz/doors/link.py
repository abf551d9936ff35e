"""Doors of the station: telemetry from a holder of the downlink key, clients of the gateway and of the bridge."""

from __future__ import annotations

import json
import math
import struct
from contextlib import suppress
from functools import cache
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import common

from ground.ccsds.bridge import Bridge
from ground.cli.operations import show
from ground.link.session import Session
from protocol import WireError
from protocol.ccsds import packet_table, space_packets
from protocol.generated import eldorado_dialect as dialect
from protocol.link import bulk_wire
from protocol.link.datagrams import DOWNLINK_KEY_ID, DatagramKind, Sealer, bench_keys
from protocol.link.reports import Report, RequestState, encode_report
from protocol.tables import commands
from protocol.visible import visible
from tests.fuzz.damage import Rng, real
from tests.fuzz.door import Door, join, split
from tests.fuzz.doors.products import samples
from tests.ground.gateway_bed import Bed, Client
from tests.ground.toy_rover import TICK_NS, ToyRover

_TEXTS = ("\x1b[2J", "no way", "a\nb", "\u202e", "x" * 300, "", "[/red]", "{x}", "%s", "é" * 40)
_ASKED = ("COMMAND_LONG", "COMMAND_INT", "SET_MODE", "PARAM_SET", "PARAM_REQUEST_READ", "PARAM_REQUEST_LIST",
          "HEARTBEAT", "MISSION_COUNT", "MISSION_ITEM", "MISSION_ITEM_INT", "MISSION_REQUEST", "MISSION_REQUEST_INT",
          "MISSION_REQUEST_LIST", "MISSION_CLEAR_ALL", "MISSION_SET_CURRENT")  # fmt: skip


def frame(kinds: Any, message: Any, payload: bytes) -> bytes:
    """Return a MAVLink 2 frame of any payload with the right checksum."""
    payload = payload[: message.unpacker.size]
    head = struct.pack("<BBBBBBHB", len(payload), 0, 0, 0, 1, 1, message.id & 0xFFFF, message.id >> 16)
    crc = kinds.x25crc(head + payload)
    crc.accumulate(bytes([message.crc_extra]))
    return b"\xfd" + head + payload + struct.pack("<H", crc.crc)


def fields(message: Any, rng: Rng) -> bytes:
    """Return a payload of numbers of any size."""
    out = b""
    for code in message.unpacker.format.lstrip("<"):
        if code in "fd":
            with np.errstate(over="ignore"):
                out += struct.pack("<" + code, float(np.float32(real(rng))))
        elif code in "bBhHiIqQ":
            size = struct.calcsize(code)
            out += int(rng.choice((0, 1, 4, 255))).to_bytes(size, "little") if rng.random() < 0.5 else rng.bytes(size)
    return out + rng.bytes(max(0, message.unpacker.size - len(out)))


@cache
def _ours() -> tuple[Any, ...]:
    return tuple(dialect.mavlink_map.values())


def _payload(rng: Rng, requests: list[int]) -> tuple[DatagramKind, bytes]:
    """Return a payload that an insider sends as a rover."""
    text = str(rng.choice(_TEXTS))
    match int(rng.integers(0, 5)):
        case 0:
            message = _ours()[int(rng.integers(0, len(_ours())))]
            return DatagramKind.MAVLINK, b"".join(frame(dialect, message, fields(message, rng)) for _ in range(3))
        case 1:
            event = dialect.MAVLink_event_message(
                int(rng.integers(0, 2**62)),
                int(rng.integers(1, 99)),
                int(rng.integers(0, 256)),
                text.encode()[:16],
                text.encode()[:100],
            )
            return DatagramKind.MAVLINK, bytes(event.pack(dialect.MAVLink(None)))
        case 2:
            asked = int(rng.choice(requests)) if requests else 1
            data = tuple(real(rng) for _ in range(int(rng.integers(0, 4))))
            serial, state, code = (
                int(rng.integers(0, 256)),
                RequestState(int(rng.integers(1, 8))),
                int(rng.integers(0, 12)),
            )
            return DatagramKind.REPORT, encode_report(Report(asked, 1, serial, state, code, text, data))
        case 3:
            name = str(rng.choice([*samples(), text])).encode()[:200]
            body = (
                bulk_wire.ANNOUNCE.pack(
                    int(rng.choice((1, 100, 2**26, 2**31))),
                    int(rng.choice((1, 2, 900, 65535))),
                    bytes(32),
                    len(name),
                    4,
                )
                + name
                + b"json"
            )
            return DatagramKind.BULK_CHUNK, bulk_wire.CHUNK.pack(int(rng.integers(0, 3)), 1, 0xFFFF) + body
    head = bulk_wire.CHUNK.pack(int(rng.integers(0, 3)), int(rng.integers(0, 9)), int(rng.choice((0, 1, 65533, 65534))))
    return DatagramKind.BULK_CHUNK, head + rng.bytes(int(rng.integers(0, 40)))


# -- telemetry: payloads of who holds the downlink key -----------------------------------------------------------------

_REQUESTS = (("get", {"product": "ldem"}), ("goto", {"x_m": 1.0, "y_m": 2.0}), ("param_list", {}))
_KINDS = tuple(DatagramKind)


@cache
def _sound() -> tuple[bytes, ...]:
    """Return the payloads of a rover in a second, each behind the number of its kind."""
    rover = ToyRover(bench_keys(7))
    rover.map = samples()["ldem"][0]
    said = (one for k in range(1, 100) for one in rover.tick_payloads(k * TICK_NS))
    return tuple(bytes([_KINDS.index(kind)]) + raw for kind, raw in said)


def _made_telemetry(rng: Rng) -> bytes:
    parts = []
    for _ in range(int(rng.integers(1, 12))):
        if rng.random() < 0.4:
            parts.append(_sound()[int(rng.integers(0, len(_sound())))])
        else:
            kind, raw = _payload(rng, [1, 2, 3])
            parts.append(bytes([_KINDS.index(kind)]) + raw)
    return join(parts)


def _payload_of(part: bytes) -> tuple[DatagramKind, bytes]:
    return _KINDS[part[0] % len(_KINDS)] if part else DatagramKind.MAVLINK, part[1:1101]


def _feed_telemetry(data: bytes) -> None:
    """Feed a station that also receives a rover: the news must be printable, refusals counted, nothing else."""
    keys = bench_keys(7)
    session, rover, parts = Session(keys, 1), ToyRover(keys), split(data)
    rover.map = samples()["ldem"][0]
    for name, arguments in _REQUESTS:
        session.request(name, arguments, 0)
    for now_ns in range(TICK_NS, 40 * TICK_NS, TICK_NS):
        datagrams = rover.tick(now_ns)
        datagrams += [rover._sealer.seal(*_payload_of(part)) for part in parts[:4]]
        del parts[:4]
        for datagram in datagrams:
            for news in session.receive(datagram, now_ns)[1]:
                line = show.news_line(news)
                assert line is None or visible(line) == line
                json.loads(show.news_json(news))
        for datagram in session.send(now_ns):
            rover.receive(datagram, now_ns)
    json.dumps(show.status(session, now_ns), allow_nan=False)
    for name, item in session.items.items():
        show.item_line(name, item.value if math.isfinite(item.value) else None)
    assert visible(show.status_line(session, now_ns)).isprintable()


# -- datagrams of who holds no key, or damages those of who does -------------------------------------------------------


def _made_forged(rng: Rng) -> bytes:
    key = rng.bytes(32) if rng.random() < 0.5 else bench_keys(7).downlink.key(DOWNLINK_KEY_ID)
    sealer = Sealer(key, DOWNLINK_KEY_ID, 1)
    return join(sealer.seal(DatagramKind.MAVLINK, rng.bytes(int(rng.integers(0, 200)))) for _ in range(20))


def _feed_forged(data: bytes) -> None:
    """Feed the station; refused datagrams are counted."""
    session = Session(bench_keys(7), 1)
    for now_ns, part in enumerate(split(data)):
        verdict, _ = session.receive(part, now_ns)
        assert verdict == "ok" or session.counts[verdict]


# -- clients: another ground program at the gateway, another system at the bridge --------------------------------------

_BY_NAME = {one.msgname: one for one in common.mavlink_map.values()}


def _made_clients(rng: Rng) -> bytes:
    parts = []
    for _ in range(int(rng.integers(1, 16))):
        if rng.random() < 0.2:
            kind, raw = _payload(rng, [1, 2, 3])
            parts.append(b"\1" + bytes([_KINDS.index(kind)]) + raw)
            continue
        message = _BY_NAME[str(rng.choice(_ASKED if rng.random() < 0.8 else list(_BY_NAME)))]
        parts.append(b"\0" + frame(common, message, fields(message, rng)))
    return join(parts)


def _feed_clients(data: bytes) -> None:
    """Feed from clients of the gateway, or through the rover's telemetry (first byte odd)."""
    bed = Bed(drive_s=0.3)
    client, sound, said = Client(bed), bed.rover.tick, list[bytes]()

    def tick(now_ns: int) -> list[bytes]:
        out, said[:] = [*sound(now_ns), *said], []
        return out

    bed.rover.tick = tick
    bed.step(0.3)
    client.command(common.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
    for part in split(data):
        if part[:1] and part[0] % 2:
            said.append(bed.rover._sealer.seal(*_payload_of(part[1:])))
        else:
            bed.receive(_checked(part[1:]))
        bed.step(0.03)
    bed.step(0.1)
    for one in client.heard("STATUSTEXT"):
        assert one.text.isprintable()


def _checked(datagram: bytes) -> bytes:
    """Return a MAVLink 2 frame of a known message with the right checksum: damage then reaches the code behind it."""
    known = common.mavlink_map.get(int.from_bytes(datagram[7:10], "little")) if datagram[:1] == b"\xfd" else None
    if known is None or len(datagram) < 12 or len(datagram) != 12 + datagram[1] or datagram[2]:
        return datagram
    crc = common.x25crc(datagram[1:-2])
    crc.accumulate(bytes([known.crc_extra]))
    return datagram[:-2] + struct.pack("<H", crc.crc)


def _made_packets(rng: Rng) -> bytes:
    packets = []
    for _ in range(int(rng.integers(1, 8))):
        row = commands.TABLE[int(rng.integers(0, len(commands.TABLE)))]
        values = [_packed(field, rng) for field in packet_table.fields_of(row)[2:]]
        layout = ">" + "".join(field.layout for field in packet_table.fields_of(row))
        data = struct.pack(layout, row.id, float(rng.choice((0.0, 5.0, real(rng)))), *values)
        packets.append(
            space_packets.encode(
                space_packets.Packet(
                    space_packets.TELECOMMAND,
                    packet_table.COMMAND_APID,
                    int(rng.integers(0, 2**14)),
                    data,
                    secondary=False,
                )
            )
        )
    return b"".join(packets)


def _packed(field: packet_table.Field, rng: Rng) -> float | int | bytes:
    if field.form == "text":
        return str(rng.choice((*_TEXTS, "1 2 3 4 5 6", "a", "motion.cruise_mps", "nan 1"))).encode()[: field.size]
    return real(rng) if field.form == "f64" else int(rng.integers(0, 256))


def _feed_packets(data: bytes) -> None:
    """Feed a stream of packets at the bridge; each whole one becomes a request or a report."""
    bed = Bed(drive_s=0.3)
    bed.step(0.3)
    bridge, splitter, reports = Bridge(bed.session), space_packets.Splitter(), 0
    with suppress(WireError):
        for packet in splitter.receive(data):
            bridge.receive(packet, bed.now_ns)
            for sent in bridge.send():
                space_packets.decode(sent)
                reports += 1
    assert reports == bridge.counts["refused"]


TELEMETRY = Door(_made_telemetry, _feed_telemetry)
FORGED = Door(_made_forged, _feed_forged)
GATEWAY = Door(_made_clients, _feed_clients)
BRIDGE = Door(_made_packets, _feed_packets)
