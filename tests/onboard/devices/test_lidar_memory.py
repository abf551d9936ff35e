"""Memory of the session: leased places, no growth, little garbage."""

from __future__ import annotations

import tracemalloc

import numpy as np

from onboard.config import Lidar as LidarConfig
from onboard.devices.lidar.model import UTM_30LX
from onboard.devices.lidar.scan_ring import ScanRing
from onboard.devices.lidar.session import LidarSession
from onboard.devices.lidar.stream import ScanStream
from onboard.records import Chunk, PortState
from protocol import scip
from tests.onboard.lidar_rig import II
from tests.protocol.scip.test_scip import PP, VV

ASKED = scip.ScanRequest("MD", 0, 1080)
TURN_NS = 25_000_000


def stream_of(values):
    """Frames with the stamps of turn k, all with these values."""
    blocks = scip.encode_blocks(values, 3)
    return lambda k: b"MD0000108001000\n99b\n" + scip.stamp_line(25 * k) + blocks + b"\n"


def streaming():
    session = LidarSession(LidarConfig())
    answers = {
        b"QT\n": b"QT\n00P\n\n",
        b"VV\n": VV,
        b"PP\n": PP,
        b"II\n": II,
        b"MD0000108001000\n": b"MD0000108001000\n00P\n\n",
    }
    session.stream(True)
    down = b""
    for tick in range(12):
        session.receive([Chunk(tick, down)], PortState.OPEN, tick)
        down = answers.get(session.send(tick).lstrip(b"\n"), b"")
    assert session.streaming
    return session


def test_a_place_is_used_again_when_nobody_holds_it():
    ring = ScanRing(4, 10)
    first = ring.take().ranges_m
    address = first.ctypes.data
    del first
    addresses = [ring.take().ranges_m.ctypes.data for _ in range(7)]
    assert addresses[3] == address and ring.overflows == 0


def test_a_leased_place_is_left_to_its_holder_and_the_newest_scan_wins():
    ring = ScanRing(2, 10)
    held = ring.take().ranges_m[2:5]  # a view is a lease as well
    held[:] = 7.0
    for _ in range(6):
        place = ring.take()
        place.ranges_m[:] = 0.0
        del place
    assert (held == 7.0).all() and ring.overflows == 1


def test_scans_that_are_kept_keep_their_values():
    session, frame = streaming(), stream_of(np.full(1081, 2000, np.int32))
    kept = []
    for k in range(100):
        kept += session.receive([Chunk(k * TURN_NS, frame(k))], PortState.OPEN, k * TURN_NS)
    ends = [scan.ranges_m.ctypes.data for scan in kept]
    assert len(kept) == 100 and len(set(ends)) == 100 and session.ring_overflows == 100 - 16


def test_ten_thousand_scans_leave_nothing_behind():
    session, frame = streaming(), stream_of(np.arange(1081, dtype=np.int32) * 50)
    sizes = []
    tracemalloc.start()
    try:
        for k in range(10_000):
            session.receive([Chunk(k * TURN_NS, frame(k))], PortState.OPEN, k * TURN_NS)
            if k % 2000 == 1999:
                sizes.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    assert session.counts["scans"] == 10_000 and session.ring_overflows == 0
    assert max(sizes[1:]) - sizes[0] < 2000


def test_a_scan_costs_at_most_2_kb_of_short_lived_objects():
    """From the bytes to the Scan: splitter, checks, values, clock (whose line is fitted every 16 scans), ring."""
    stream = ScanStream(LidarConfig(), dict.fromkeys(LidarSession(LidarConfig()).counts, 0))
    stream.learn(UTM_30LX, usb=True)
    splitter = scip.Splitter()
    splitter.echo = ASKED.line()[:13]
    values = np.arange(1081, dtype=np.int32) * 50
    values[::3] = 1  # open sky
    frames, peaks = [stream_of(values)(k) for k in range(1000)], []
    tracemalloc.start()
    try:
        for k, data in enumerate(frames):
            tracemalloc.reset_peak()
            before = tracemalloc.get_traced_memory()[0]
            for rx_ns, frame in splitter.frames(k * TURN_NS, data):
                stream.take(frame, rx_ns)
            peaks.append(tracemalloc.get_traced_memory()[1] - before)
    finally:
        tracemalloc.stop()
    assert stream.counts["scans"] == 1000 and max(peaks[5:]) <= 2000
