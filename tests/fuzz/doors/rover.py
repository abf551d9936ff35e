"""Doors of the flight program: scanner, CAN bus, socketcand server, datagrams, orders.

Bus and orders are fed to the whole core. After any input it ticks on, its outputs can be recorded, and the next order
to stop is executed.
"""

from __future__ import annotations

import logging
import math
import socket
import struct
from collections import deque
from contextlib import closing, suppress
from functools import cache
from typing import Any

import can
import numpy as np
from can.interfaces.socketcand.socketcand import SocketCanDaemonBus

from hil.devices.can.nodes import build_nodes
from hil.records import PlantState, WheelTruth
from onboard.config import load
from onboard.core.rover import Rover
from onboard.core.tick import tick
from onboard.drivers.can.socketcand import DaemonBus
from onboard.record.schema import encode_inputs, encode_outputs
from onboard.records import Chunk, Frame, Inputs, LinkMessage, Outputs, PortState, Twist
from protocol import WireError, barrier
from protocol.can.crc import crc8, seed
from protocol.conventions import TICK_NS
from protocol.generated.can_codec import TABLE
from protocol.link.datagrams import DatagramKind, Opener, Sealer, bench_keys
from protocol.link.reports import Report, decode_report
from protocol.scip import FRAME_LIMIT
from protocol.tables import commands
from protocol.tables.arguments import Argument
from protocol.tables.arguments import ArgumentKind as Written
from tests.fuzz.damage import Rng, real
from tests.fuzz.door import Door, join, split
from tests.onboard.lidar_rig import Rig

STATION, STREAM_TICKS, STOP_TICKS = 3, 30, 30
_STOP_ID, _OTHER = 0x7FFFFFF0, 5
_WORDS = ("motion.cruise_mps", "a", "after 5 or continue goto 3 1", "0.09", "é\x1b[2J\n", "")
_BITS_CRC, _BITS_WAIT = 0x8000, 0x4000  # of a frame's first two bytes: the checksum is corrected; a tick passes
_STANDING = (WheelTruth(0.0, 0.0, 0.0, 0.0),) * 4
_BARRIER = (
    barrier.Hello("onboard"), barrier.Welcome(TICK_NS, 1), barrier.Stop("over"),
    barrier.Tick(3, 3 * TICK_NS, (barrier.Channel("can", 2, stamps_us=(1, 2)),), (0.5,) * 6),
    barrier.Done(3, 4, {"can": 7}, ("lidar",)),
)  # fmt: skip


# -- the core ------------------------------------------------------------------------------------------------------


class Standing:
    """The flight program's core on level ground with emulated nodes. stops: requests to stop that were executed."""

    def __init__(self) -> None:
        self.rover, self.nodes, self.number = Rover(load(), None), build_nodes(1), 0
        self.stops, self.reports = 0, list[Report]()

    def tick(self, frames: tuple[Frame, ...] = (), messages: tuple[tuple[int, int, bytes], ...] = ()) -> Outputs:
        """Run one tick: frames in addition to those of the nodes, messages as (station, kind, payload)."""
        self.number += 1
        now_ns, zero = self.number * TICK_NS, np.zeros(3)
        truth = PlantState(now_ns, zero, np.array([0, 0, 0, 1.0]), zero, zero, np.array([0.0, 0.0, 1.62]), _STANDING)
        self.nodes.step(now_ns, truth)
        heard = tuple(LinkMessage(now_ns, True, "ok", *message) for message in messages)
        inputs = Inputs(self.number, now_ns, can_frames=(*self.nodes.send(), *frames), link_messages=heard)
        outputs = tick(self.rover, inputs)
        for frame in outputs.can_frames:
            self.nodes.receive(frame, now_ns)
        for kind, payload in outputs.link_payloads:
            if kind == DatagramKind.REPORT:
                report = decode_report(payload)
                self.reports.append(report)
                self.stops += report.request_id == _STOP_ID and report.state.name == "COMPLETED"
        encode_outputs(outputs, encode_inputs(inputs))
        return outputs

    def must_stop(self) -> None:
        """Assert that an order to stop of another station is executed, and that nothing is to move after it."""
        order = commands.encode(commands.Telecommand(_STOP_ID, self.number * TICK_NS, 0, "stop", {}))
        for _ in range(STOP_TICKS):
            outputs = self.tick(messages=((_OTHER, DatagramKind.TELECOMMAND, order),))
            if self.stops:
                break
        assert self.stops, "no report that the stop was executed"
        assert self.rover.twist == Twist() and len(outputs.pose) == 6 and all(map(math.isfinite, outputs.pose))


# -- CAN: ids and data of frames -----------------------------------------------------------------------------------


def _made_frames(rng: Rng) -> bytes:
    ids = list(TABLE)
    parts = []
    for _ in range(int(rng.integers(1, 20))):
        can_id = ids[int(rng.integers(0, len(ids)))] if rng.random() < 0.9 else int(rng.integers(0, 0x800))
        bits = _BITS_CRC * (rng.random() < 0.8) | _BITS_WAIT * (rng.random() < 0.3)
        data = rng.bytes(8 if rng.random() < 0.9 else int(rng.integers(0, 9)))
        parts.append(struct.pack(">H", can_id | bits) + data)
    return join(parts)


def _feed_frames(data: bytes) -> None:
    core, waiting = Standing(), list[Frame]()
    for _ in range(3):
        core.tick()
    for part in split(data):
        (bits,) = struct.unpack(">H", part[:2].ljust(2, b"\0"))
        can_id, body = bits & 0x7FF, part[2:10]
        if bits & _BITS_CRC and len(body) == 8:
            body = body[:7] + bytes([crc8(body[:7], seed(can_id))])
        waiting.append(Frame(can_id, body, core.number * TICK_NS))
        if bits & _BITS_WAIT:
            core.tick(tuple(waiting))
            waiting.clear()
    core.tick(tuple(waiting))
    core.must_stop()


# -- a socketcand server that says anything ------------------------------------------------------------------------


class _Stream:
    """A UNIX socket that accepts TCP's options."""

    def __init__(self, stream: socket.socket) -> None:
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def setsockopt(self, *_option: int) -> None:
        """Nothing to do."""


def _made_text(rng: Rng) -> bytes:
    words = []
    for _ in range(int(rng.integers(1, 12))):
        can_id, data = int(rng.integers(0, 0x800)), rng.bytes(int(rng.integers(0, 9)))
        match int(rng.integers(0, 5)):
            case 0:
                words.append(f"< frame {can_id:X} {rng.random() * 1e9:.6f} {data.hex(' ').upper()} >")
            case 1:
                words.append(f"< error {can_id:X} {rng.random() * 1e9:.6f} >")
            case 2:
                words.append("< echo >")
            case 3:
                words.append("< ok >< hi >")
            case _:
                words.append(f"< frame {can_id:X} {rng.random():.6f} {data.hex()} >")
    return "".join(words).encode()


def _feed_text(data: bytes) -> None:
    near, far = socket.socketpair()
    logging.getLogger("can").setLevel(logging.CRITICAL)
    with near, far, closing(DaemonBus(_client(near))) as bus:
        far.setblocking(False)
        frames, sent, now_ns = 0, 0, 0
        while sent < len(data):
            sent += far.send(data[sent : sent + 4096])
            now_ns += TICK_NS
            frames += len(bus.read(now_ns))
        for _ in range(20):
            now_ns += TICK_NS
            frames += len(bus.read(now_ns))
        assert frames <= len(data) and "\n" not in bus.error
        bus.write([Frame(0x101, bytes(8))])


def _client(stream: socket.socket) -> Any:
    """Return python-can's client in its state after the handshake."""
    bus: Any = object.__new__(SocketCanDaemonBus)
    can.BusABC.__init__(bus, channel="vcan0")
    for name, value in (
        ("socket", _Stream(stream)),
        ("message_buffer", deque()),
        ("receive_buffer", ""),
        ("tcp_tune", False),
    ):
        setattr(bus, f"_SocketCanDaemonBus__{name}", value)
    bus.channel = "vcan0"
    return bus


# -- the scanner's stream ------------------------------------------------------------------------------------------


@cache
def _replies() -> tuple[bytes, ...]:
    """Return the bytes of a sound scanner, tick by tick, from its first byte until it streams."""
    rig, heard = Rig(), list[bytes]()
    rig.cut = lambda data: (heard.append(data), [data])[1]
    rig.session.stream(True)
    rig.run(60)
    return tuple(heard)


def _made_stream(rng: Rng) -> bytes:
    said = _replies()
    first = int(rng.integers(0, len(said)))
    pieces = [
        said[int(rng.integers(0, len(said)))] if rng.random() < 0.2 else piece
        for piece in said[first : first + int(rng.integers(1, 12))]
    ]
    cut = 1 << int(rng.integers(3, 14))
    return join(piece[at : at + cut] for piece in pieces for at in range(0, len(piece), cut))


def _feed_stream(data: bytes) -> None:
    rig = Rig()
    rig.session.stream(True)
    rig.run(STREAM_TICKS)
    for part in split(data):
        scans = rig.session.receive([Chunk(rig.now_ns, part)], PortState.OPEN, rig.now_ns)
        assert all(np.isfinite(scan.start_ns) for scan in scans)
        rig.run(1)
    assert len(rig.session._splitter._buffer) == 2 * FRAME_LIMIT


# -- datagrams and orders --------------------------------------------------------------------------------------------


def _argument(argument: Argument, rng: Rng) -> Any:
    match argument.kind:
        case Written.CHOICE:
            return str(rng.choice(argument.choices))
        case Written.TEXT:
            return str(rng.choice((*argument.known, *_WORDS)))[: argument.most]
        case Written.POINTS:
            return tuple(float(v) for v in rng.uniform(-20, 20, 2 * int(rng.integers(1, argument.most + 1))))
    return float(rng.choice((argument.low, argument.high, float(rng.uniform(argument.low, argument.high)), real(rng))))


def _order(rng: Rng, now_ns: int = TICK_NS) -> bytes:
    """Return the bytes of a command with arguments that mostly fit it."""
    while True:
        row = commands.TABLE[int(rng.integers(0, len(commands.TABLE)))]
        given = {one.name: _argument(one, rng) for one in row.arguments if one.required or rng.random() < 0.5}
        times_ns = now_ns, int(rng.choice((0, now_ns, 2**62))), int(rng.choice((0, now_ns, 10**9, 2**62)))
        with suppress(ValueError):
            return commands.encode(
                commands.Telecommand(
                    int(rng.integers(1, 2**32)), times_ns[0], times_ns[1], row.name, given, times_ns[2]
                )
            )


def _made_orders(rng: Rng) -> bytes:
    kinds = [DatagramKind.TELECOMMAND] * 6 + [DatagramKind.BULK_BITMAP, DatagramKind.REPORT]
    parts = []
    for _ in range(int(rng.integers(1, 10))):
        kind = kinds[int(rng.integers(0, len(kinds)))]
        payload = _order(rng) if kind is DatagramKind.TELECOMMAND else rng.bytes(int(rng.integers(0, 60)))
        parts.append(bytes([kind, int(rng.integers(1, 5))]) + payload)
    return join(parts)


def _feed_orders(data: bytes) -> None:
    """Feed messages of a holder of a command key: a byte for the kind, one for the station, the payload."""
    core = Standing()
    core.tick()
    for part in split(data):
        kind, station = part[:2] if len(part) >= 2 else (0, 0)
        core.tick(messages=((station % 32 + 8, kind, part[2:]),))
    core.must_stop()


def _made_datagrams(rng: Rng) -> bytes:
    keys = bench_keys(7)
    sealer = Sealer(keys.command.key(STATION), STATION, 1, counter=int(rng.integers(0, 99)))
    return join(
        sealer.seal_halt(commands.encode(commands.Telecommand(1, 0, 0, "stop", {})))
        if rng.random() < 0.2
        else sealer.seal(DatagramKind.TELECOMMAND, _order(rng))
        for _ in range(int(rng.integers(1, 9)))
    )


def _feed_datagrams(data: bytes) -> None:
    """Feed datagrams of any sender: one that fails its check changes nothing."""
    opener = Opener(bench_keys(7).command, boot_id=1)
    for part in split(data):
        before = opener.highest(STATION), dict(opener.marks), opener.boot_id, opener.epoch
        try:
            opened = opener.open(part)
        except WireError:
            assert before == (opener.highest(STATION), opener.marks, opener.boot_id, opener.epoch)
        else:
            assert opened.payload in part


# -- the bench's barrier ---------------------------------------------------------------------------------------------


def _made_barrier(rng: Rng) -> bytes:
    said = [barrier.encode(one) for one in _BARRIER]
    return b"".join(said[int(rng.integers(0, len(said)))] for _ in range(int(rng.integers(1, 6))))


def _feed_barrier(data: bytes) -> None:
    receiver = barrier.Receiver()
    with suppress(WireError):
        for message in receiver.receive(data):
            assert isinstance(barrier.encode(message), bytes)


CAN = Door(_made_frames, _feed_frames)
SOCKETCAND = Door(_made_text, _feed_text)
SCANNER = Door(_made_stream, _feed_stream)
ORDERS = Door(_made_orders, _feed_orders)
DATAGRAMS = Door(_made_datagrams, _feed_datagrams)
BARRIER = Door(_made_barrier, _feed_barrier)
