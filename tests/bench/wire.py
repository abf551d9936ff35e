"""Rows of bytes: can-codec, link-codec, scip-decode, scip-poll."""

from __future__ import annotations

import logging
from pathlib import Path
from statistics import median
from time import perf_counter

import can
import cantools
import numpy as np

from hil.devices.lidar import profile as profiles
from hil.devices.lidar import sensor
from onboard.config import Lidar as LidarConfig
from onboard.devices.lidar.session import LidarSession
from onboard.kernel_calls.scip import Blocks
from onboard.records import Chunk, PortState
from protocol import scip
from protocol.can.crc import crc8, sound
from protocol.generated.can_codec import TABLE
from protocol.link import datagrams as link
from tests.bench.goals import Measured, against, seconds

DBC = Path(__file__).resolve().parents[2] / "protocol" / "rover.dbc"
FRAMES = 12
TICK_NS = 10_000_000
POLL_LIMIT_S = 60e-6
LINK_LIMIT_HZ = 50_000


def can_codec(repeats: int) -> Measured:
    """Measure 12 frames encoded and decoded with counter and checksum."""
    messages = sorted(cantools.database.load_file(DBC).messages, key=lambda m: m.frame_id)[::3][:FRAMES]
    rows = [TABLE[message.frame_id] for message in messages]
    values = [[message.get_signal_by_name(f).minimum for f in row.fields] for message, row in zip(messages, rows)]
    named = [dict(zip(row.fields, value)) for row, value in zip(rows, values)]

    def ours() -> list[bytes]:
        made = [row.encode(*value, 7) for row, value in zip(rows, values)]
        for row, data in zip(rows, made):
            assert sound(data, row.seed) and data[6] >> 4 == 7
            row.decode(data)
        return made

    def theirs() -> list[bytes]:
        made = []
        for message, value in zip(messages, named):
            data = bytearray(message.encode({**value, "counter": 7, "crc": 0}))
            data[7] = crc8(data[:7], TABLE[message.frame_id].seed)
            frame = can.Message(arbitration_id=message.frame_id, data=data, is_extended_id=False)
            found = message.decode(frame.data, decode_choices=False)
            assert sound(frame.data, TABLE[message.frame_id].seed) and found["counter"] == 7
            made.append(bytes(frame.data))
        return made

    equal = ours() == theirs()
    made = against(ours, theirs, "cantools + python-can", repeats, 200)
    return Measured(
        made.ratio, made.ours_s, made.reference_s, made.reference, "bit-equal" if equal else "BITS DIFFER", equal
    )


def link_codec(repeats: int) -> Measured:
    """Measure authenticated datagrams of 200 bytes sealed and opened."""
    keys, count, payload = link.bench_keys(1), 2000, bytes(200 - link.OVERHEAD)
    key = keys.downlink.key(link.DOWNLINK_KEY_ID)
    assert key is not None

    def work() -> None:
        sealer, opener = link.Sealer(key, link.DOWNLINK_KEY_ID, 1), link.Opener(keys.downlink, boot_id=1)
        for _ in range(count):
            opener.open(sealer.seal(link.DatagramKind.MAVLINK, payload))

    each_s = seconds(work, repeats) / count
    return Measured(
        1 / each_s / LINK_LIMIT_HZ, each_s, 1 / LINK_LIMIT_HZ, "the limit", f"{1 / each_s:,.0f} /s, one by one"
    )


class _Wire:
    """A socket for hokuyolx that has one frame."""

    def __init__(self, frame: bytes) -> None:
        self._frame = frame

    def recv(self, size: int) -> bytes:
        """Return the next bytes."""
        data, self._frame = self._frame[:size], self._frame[size:]
        return data


def scip_decode(repeats: int) -> Measured:
    """Measure 200 MD frames of 1081 beams in a burst, all checks, to integers: splitter and decoder against hokuyolx.

    hokuyolx gets each frame by itself (it merges those that come in one read) and does not convert its stamps to UTC.
    """
    from hokuyolx import HokuyoLX  # installed by `make bench`

    asked, rng = scip.ScanRequest("MD", 0, 1080), np.random.default_rng(1)
    values = rng.integers(23, 60_000, (200, asked.values)).astype(np.int32)
    frames = [scip.scan_reply(asked, asked.line(), 25 * k, row) for k, row in enumerate(values)]
    flood = b"".join(frames)
    pieces = [flood[k : k + 65_536] for k in range(0, len(flood), 65_536)]
    splitter, decoder = scip.Splitter(), scip.ScanDecoder(asked, reader=Blocks)
    splitter.echo = asked.line()[:13]
    client = object.__new__(HokuyoLX)
    client._logger, client.buf = logging.getLogger("hokuyolx"), 512

    def ours() -> int:
        return sum(int(decoder.decode(frame).values[0]) for piece in pieces for _, frame in splitter.frames(0, piece))

    def theirs() -> int:
        total = 0
        for frame in frames:
            client._sock = _Wire(frame)
            _, status, stamp, *lines = client._recv()
            client._check_sum(status)
            client._convert2ts(stamp, False)
            total += int(client._process_scan_data(lines, False)[0])
        return total

    equal = ours() == theirs() == int(values[:, 0].sum())
    made = against(ours, theirs, "hokuyolx, frame by frame", repeats)
    note = f"{made.ours_s / 200 * 1e6:.0f} us a scan" if equal else "VALUES DIFFER"
    return Measured(made.reference_s / made.ours_s, made.ours_s, made.reference_s, made.reference, note, equal)


def scip_poll(repeats: int) -> Measured:
    """Measure the session's work in the tick that brings a scan of 1081 beams, p50."""
    session = LidarSession(LidarConfig())
    twin = sensor.Lidar(1, lambda times_ns: np.linspace(2.0, 4.0, len(times_ns)), profiles.IDEAL)
    state, up, taken = PortState.CLOSED, b"", []
    session.stream(True)
    for tick in range(1, 100 + 200 * repeats):
        now_ns = tick * TICK_NS
        if up:
            twin.receive(up, now_ns - TICK_NS)
        twin.step(now_ns)
        pieces = [Chunk(t, data) for t, data in twin.send()]
        began = perf_counter()
        scans = session.receive(pieces, state, now_ns)
        up = session.send(now_ns)
        if scans:
            taken.append((perf_counter() - began) / len(scans))
        if session.wants_connect(now_ns):
            twin.connect()
            state = PortState.OPEN
    p50_s = median(taken)
    return Measured(
        p50_s / POLL_LIMIT_S, p50_s, POLL_LIMIT_S, "the limit", f"{len(taken)} scans; bytes are at hand, no socket"
    )


ROWS = {"can-codec": can_codec, "link-codec": link_codec, "scip-decode": scip_decode, "scip-poll": scip_poll}
