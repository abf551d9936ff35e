"""Doors of the link and of the gateway: who holds the downlink key sends anything, and so do clients of the gateway."""

from __future__ import annotations

import json
import math
import struct
from functools import cache
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import common

from ground.operation import show
from ground.session.session import Session
from protocol import bulk_wire
from protocol import eldorado_dialect as dialect
from protocol.link import DOWNLINK_KEY_ID, Kind, Sealer, bench_keys
from protocol.reports import Report, State, encode_report
from protocol.visible import visible
from tests.doors.damage import Rng, damaged, real
from tests.doors.products import samples
from tests.ground.gateway_bed import Bed, Client
from tests.ground.toy_rover import TICK_NS, ToyRover

_TEXTS = ("\x1b[2J", "no way", "a\nb", "\u202e", "x" * 300, "", "[/red]", "{x}", "%s", "é" * 40)
_ASKED = ("COMMAND_LONG", "COMMAND_INT", "SET_MODE", "PARAM_SET", "PARAM_REQUEST_READ", "PARAM_REQUEST_LIST",
          "HEARTBEAT", "MISSION_COUNT", "MISSION_ITEM", "MISSION_ITEM_INT", "MISSION_REQUEST", "MISSION_REQUEST_INT",
          "MISSION_REQUEST_LIST", "MISSION_CLEAR_ALL", "MISSION_SET_CURRENT")  # fmt: skip


def frame(kinds: Any, message: Any, payload: bytes) -> bytes:
    """A MAVLink 2 frame of any payload, its checksum right."""
    payload = payload[: message.unpacker.size]
    head = struct.pack("<BBBBBBHB", len(payload), 0, 0, 0, 1, 1, message.id & 0xFFFF, message.id >> 16)
    crc = kinds.x25crc(head + payload)
    crc.accumulate(bytes([message.crc_extra]))
    return b"\xfd" + head + payload + struct.pack("<H", crc.crc)


def fields(message: Any, rng: Rng) -> bytes:
    """A payload of numbers of any size."""
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


def _payload(rng: Rng, requests: list[int]) -> tuple[Kind, bytes]:
    """What an insider makes up as a rover."""
    text = str(rng.choice(_TEXTS))
    match int(rng.integers(0, 5)):
        case 0:
            message = _ours()[int(rng.integers(0, len(_ours())))]
            return Kind.MAVLINK, b"".join(frame(dialect, message, fields(message, rng)) for _ in range(3))
        case 1:
            event = dialect.MAVLink_event_message(int(rng.integers(0, 2**62)), int(rng.integers(1, 99)),
                                                  int(rng.integers(0, 256)), text.encode()[:16], text.encode()[:100])
            return Kind.MAVLINK, bytes(event.pack(dialect.MAVLink(None)))
        case 2:
            asked = int(rng.choice(requests)) if requests else 1
            data = tuple(real(rng) for _ in range(int(rng.integers(0, 4))))
            serial, state, code = int(rng.integers(0, 256)), State(int(rng.integers(1, 8))), int(rng.integers(0, 12))
            return Kind.REPORT, encode_report(Report(asked, 1, serial, state, code, text, data))
        case 3:
            name = str(rng.choice([*samples(), text])).encode()[:200]
            body = bulk_wire.ANNOUNCE.pack(int(rng.choice((1, 100, 2**26, 2**31))), int(rng.choice((1, 2, 900, 65535))),
                                           bytes(32), len(name), 4) + name + b"json"
            return Kind.BULK_CHUNK, bulk_wire.CHUNK.pack(int(rng.integers(0, 3)), 1, 0xFFFF) + body
    head = bulk_wire.CHUNK.pack(int(rng.integers(0, 3)), int(rng.integers(0, 9)), int(rng.choice((0, 1, 65533, 65534))))
    return Kind.BULK_CHUNK, head + rng.bytes(int(rng.integers(0, 40)))


class Insider(ToyRover):
    """A toy rover of which some payloads are damaged or made up, each sealed with the right key."""

    def __init__(self, keys: Any, rng: Rng) -> None:
        super().__init__(keys)
        self.rng, self.requests = rng, list[int]()
        self.map = samples()["ldem"][0]

    def tick(self, now_ns: int) -> list[bytes]:
        payloads = [(kind, damaged(raw, self.rng) if self.rng.random() < 0.3 else raw)
                    for kind, raw in self.tick_payloads(now_ns)]
        if self.rng.random() < 0.3:
            payloads.append(_payload(self.rng, self.requests))
        sealed = [self._sealer.seal(kind, raw[:1100]) for kind, raw in payloads]
        return [damaged(one, self.rng) if self.rng.random() < 0.05 else one for one in sealed]


def datagrams(rng: Rng) -> None:
    """A station hears an insider for a second: news that can be shown, counts of what was refused, nothing else."""
    keys = bench_keys(7)
    session, rover = Session(keys, 1), Insider(keys, rng)
    for now_ns in range(TICK_NS, 100 * TICK_NS, TICK_NS):
        if now_ns == 20 * TICK_NS:
            rover.requests = [session.request(name, arguments, now_ns) for name, arguments in
                              (("get", {"product": "ldem"}), ("goto", {"x_m": 1.0, "y_m": 2.0}), ("param_list", {}))]
        for datagram in rover.tick(now_ns):
            for news in session.receive(datagram, now_ns)[1]:
                line = show.news_line(news)
                assert line is None or visible(line) == line
                json.loads(show.news_json(news))
        json.dumps(show.status(session, now_ns), allow_nan=False)
        for name, item in session.items.items():
            show.item_line(name, item.value if math.isfinite(item.value) else None)
        assert visible(show.status_line(session, now_ns)).isprintable()
        for datagram in session.send(now_ns):
            rover.receive(datagram, now_ns)


def forged(rng: Rng) -> None:
    """Datagrams of who holds no key change nothing and are counted."""
    keys = bench_keys(7)
    session = Session(keys, 1)
    sealer = Sealer(rng.bytes(32) if rng.random() < 0.5 else keys.downlink.key(DOWNLINK_KEY_ID), DOWNLINK_KEY_ID, 1)
    for now_ns in range(20):
        sound = sealer.seal(Kind.MAVLINK, rng.bytes(int(rng.integers(0, 200))))
        verdict, _ = session.receive(damaged(sound, rng), now_ns)
        assert verdict == "ok" or session.counts[verdict]


def gateway(rng: Rng) -> None:
    """Clients of the gateway say anything for a second, while the rover's telemetry is an insider's."""
    bed = Bed(drive_s=0.3)
    client = Client(bed)
    sound = bed.rover.tick
    insider = Insider(bench_keys(7), rng)
    insider._sealer = bed.rover._sealer

    def tick(now_ns: int) -> list[bytes]:
        if rng.random() < 0.8:
            return sound(now_ns)
        return [*sound(now_ns), insider._sealer.seal(*_payload(rng, list(bed.session.requester.requests)))]

    bed.rover.tick = tick
    bed.step(0.5)
    client.command(common.MAV_CMD_COMPONENT_ARM_DISARM, float(rng.integers(0, 2)))
    by_name = {one.msgname: one for one in common.mavlink_map.values()}
    for _ in range(30):
        if rng.random() < 0.8:
            message = by_name[str(rng.choice(_ASKED))]
        else:
            message = list(by_name.values())[int(rng.integers(0, len(by_name)))]
        datagram = frame(common, message, fields(message, rng))
        bed.receive(damaged(datagram, rng) if rng.random() < 0.3 else datagram)
        bed.step(0.03)
    for one in client.heard("STATUSTEXT"):
        assert one.text.isprintable()
