"""The scanner's clock through the port layer: the wall clock's ports, a real socket, the emulated sensor."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from hil.devices.lidar import profile as profiles
from hil.devices.lidar.server import LidarServer
from onboard.app import WallPorts
from onboard.config import Lidar
from onboard.devices.lidar.session import LidarSession
from onboard.drivers.lidar.port import open_port
from onboard.drivers.platform.load import Probe
from onboard.records import Frame, Outputs, PortState
from onboard.records.status import BusStatus
from tests.onboard.hand_clock import REAL_LIMIT_S, HandClock


def fly(profile, latency_ns, seconds):
    """Scans of a stream over a TCP port, with the wall clock's ports between sensor and session."""
    server = LidarServer()
    lidar, clock = open_port(server.address), HandClock(server, profile)
    silent = SimpleNamespace(state=PortState.OPEN, status=BusStatus(), read=lambda _: (), write=lambda _: 0)
    ports = WallPorts(silent, lidar, silent, clock, Probe(()))
    session, scans = LidarSession(Lidar(latency_ns=latency_ns)), []
    clock.idle = ports.ear.listen
    lidar.connect()
    session.stream(True)
    for _ in range(int(seconds * 100)):
        inputs = ports.read(clock.wait())
        scans += session.receive(inputs.lidar_chunks, inputs.lidar_state, inputs.now_ns)
        ports.write(Outputs(lidar_bytes=session.send(inputs.now_ns)))
    lidar.close()
    server.close()
    assert session.bad == 0 and clock.slipped_ticks == 0
    return scans


@pytest.mark.parametrize("turn_ns", [25.05e6, 25.0e6])
def test_clock_error_is_0_05_ms_rms_and_under_0_25_ms_at_99_percent_with_the_ports_stamps(turn_ns):
    profile = profiles.Profile(
        rate_error=80e-6,
        start_ms=321.5,
        turn_ns=turn_ns,
        latency_ns=3_200_000,
        jitter_ns=0.4e6,
        spike_ratio=0.02,
        spike_ns=20e6,
    )
    scans = fly(profile, round(turn_ns * 0.75 + 3_200_000), seconds=120)
    assert len(scans) > 0.98 * 120e9 / turn_ns
    true_turn_ns = turn_ns / (1 + 80e-6)
    errors_ms = np.array([math.remainder(s.start_ns, true_turn_ns) for s in scans]) * 1e-6
    settled_ms = errors_ms[400:]
    assert np.sqrt((settled_ms**2).mean()) <= 0.05 and np.percentile(np.abs(settled_ms), 99) <= 0.25
    assert np.percentile(np.abs(errors_ms), 99) <= 0.25  # from the first frame on


def test_bytes_between_two_ticks_are_stamped_when_they_come_and_taken_in_order_at_the_tick():
    server, lidar = LidarServer(), None
    try:
        lidar = open_port(server.address)
        clock = SimpleNamespace(now_ns=iter((3_000_000, 7_000_000, 9_000_000, 9_100_000)).__next__, slipped_ticks=0)
        silent = SimpleNamespace(state=PortState.OPEN, status=BusStatus(), read=lambda _: ())
        ports = WallPorts(silent, lidar, silent, clock, Probe(()))
        lidar.connect()
        assert server.wait_client(REAL_LIMIT_S) and lidar.wait_open(REAL_LIMIT_S) is PortState.OPEN
        for data in (b"MD", b"00"):
            server.write(data)
            ports.ear.listen(REAL_LIMIT_S)
        inputs = ports.read(SimpleNamespace(number=1, now_ns=10_000_000))
        assert inputs.lidar_chunks == ((3_000_000, b"MD"), (7_000_000, b"00"))
    finally:
        server.close()
        if lidar is not None:
            lidar.close()


def test_frames_that_came_while_the_program_opened_are_not_the_first_ticks():
    old, new = Frame(1, b"", stamp_ns=1), Frame(2, b"", stamp_ns=9_000_000)
    queue = [[old] * 2000, [new]]
    can = SimpleNamespace(
        state=PortState.OPEN, status=BusStatus(), read=lambda _: queue.pop(0), forget=lambda: queue.pop(0)
    )
    quiet = SimpleNamespace(state=PortState.OPEN, status=BusStatus(), read=lambda _: (), fileno=lambda: -1)
    clock = SimpleNamespace(now_ns=lambda: 10_000_000, slipped_ticks=0)
    ports = WallPorts(can, quiet, quiet, clock, Probe(()))
    ports.forget()
    assert ports.read(SimpleNamespace(number=1, now_ns=10_000_000)).can_frames == (new,)
