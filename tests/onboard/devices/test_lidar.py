"""The session against the emulated sensor, over a wire that cuts, garbles, delays and unplugs."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hil.devices.lidar import profile as profiles
from onboard.config import Lidar as LidarConfig
from onboard.devices.lidar.session import LidarSession
from onboard.records import BeamStatus, Chunk, PortState
from tests.onboard.lidar_rig import TICK_NS, Rig, half_request, room, stray_stream, time_adjustment
from tests.protocol import wire


@pytest.mark.parametrize("cut", [wire.whole, wire.bytewise, wire.ragged])
def test_quiet_sensor_is_identified_then_streams_40_scans_a_second(cut):
    rig = Rig(cut=cut)
    assert rig.run(100, lambda: rig.session.ready)
    assert rig.session.info["PROD"] == "SOKUIKI Sensor TOP-URG UTM-30LX"
    rig.run(20)
    assert not rig.scans and not rig.twin.laser_on
    rig.session.stream(True)
    rig.run(106)
    assert 40 <= len(rig.scans) <= 43 and rig.session.bad == 0


def other_stream(twin):
    twin.receive(b"ME0100050003005\n", 0)


@pytest.mark.parametrize("before", [half_request, stray_stream, time_adjustment, other_stream])
@pytest.mark.parametrize("profile", [profiles.IDEAL, profiles.UTM30LX])
def test_session_connects_to_a_sensor_in_any_state_within_0_5_s(before, profile):
    rig = Rig(dataclasses.replace(profile, usb=True))
    before(rig.twin)
    rig.twin.step(30_000_000)
    rig.tick = 3
    rig.session.stream(True)
    assert rig.run(50, lambda: bool(rig.scans)), rig.session.counts
    assert rig.session.counts["timeouts"] == 0


def test_scan_holds_metres_codes_and_geometry():
    rig = Rig()
    rig.session.stream(True)
    rig.run(40)
    scan = rig.scans[-1]
    assert scan.ranges_m.dtype == np.float32 and scan.status.dtype == np.uint8
    assert scan.first_angle_rad == pytest.approx(-0.75 * math.pi)
    assert scan.first_angle_rad + 540 * scan.step_rad == pytest.approx(0.0)
    assert scan.beam_ns == pytest.approx(25e6 / 1440)
    assert scan.status[[10, 20, 30]].tolist() == [BeamStatus.NO_RETURN, BeamStatus.TOO_NEAR, BeamStatus.NO_RETURN]
    assert np.isnan(scan.ranges_m[[10, 20, 30]]).all()
    good = scan.status == BeamStatus.OK
    assert good.sum() == 1078
    assert np.abs(scan.ranges_m[good] - room(np.zeros(1081))[good]).max() < 0.12


def test_start_of_scan_is_the_time_beam_0_was_fired():
    rig = Rig()
    rig.session.stream(True)
    rig.run(60)
    starts_ns = np.array([s.start_ns for s in rig.scans])
    assert np.abs((starts_ns + 12_500_000) % 25_000_000 - 12_500_000).max() <= 1000


def test_unplugged_in_mid_sweep_reconnects_and_streams_again():
    rig = Rig()
    rig.session.stream(True)
    rig.run(40)
    rig.unplug()
    rig.refusing = True
    before = len(rig.scans)
    rig.run(50)
    assert rig.session.silent(rig.now_ns) and len(rig.scans) == before
    rig.refusing = False
    assert rig.run(250, lambda: rig.session.streaming and len(rig.scans) > before + 10)
    assert rig.session.counts["reconnects"] == 1 and rig.session.bad == 0
    assert not rig.session.silent(rig.now_ns)


def test_attempts_to_connect_back_off_from_0_1_to_2_s():
    session = LidarSession(LidarConfig())
    tries = [t for t in range(0, 1000) if session.wants_connect(t * TICK_NS)]
    assert tries[:6] == [0, 10, 30, 70, 150, 310]
    assert np.diff(tries[5:]).tolist() == [200, 200, 200]


def test_garbled_scans_are_dropped_alone_and_counted():
    rig = Rig(cut=wire.ragged)
    rig.session.stream(True)
    rig.run(30, lambda: rig.session.streaming)
    rig.twin.garble_ratio = 0.3
    rig.run(500)
    sent = rig.twin.scans - 1
    lost = sent - len(rig.scans)
    assert 0.2 * sent < lost < 0.4 * sent
    assert lost <= rig.session.bad + 1 <= 2 * lost
    times_ns = np.diff([s.start_ns for s in rig.scans])
    assert times_ns.min() > 24_900_000


def test_noise_between_frames_costs_no_scan():
    rig = Rig()
    rig.session.stream(True)
    rig.run(30, lambda: rig.session.streaming)
    rng = np.random.default_rng(3)
    rig.spoil = lambda data: rng.integers(128, 256, 30, dtype=np.uint8).tobytes() + data
    start = len(rig.scans), rig.twin.scans
    rig.run(200)
    assert len(rig.scans) - start[0] >= rig.twin.scans - start[1] - 1


def test_silence_is_told_after_150_ms_and_cured_by_a_new_start():
    rig = Rig()
    rig.session.stream(True)
    rig.run(40)
    rig.twin.stalled = True
    ticks = rig.run(100, lambda: rig.session.silent(rig.now_ns)) - 40
    assert 13 <= ticks <= 17
    rig.run(150)
    rig.twin.stalled = False
    assert rig.run(150, lambda: not rig.session.silent(rig.now_ns))


def test_quiet_again_switches_the_laser_off_and_later_on():
    rig = Rig()
    rig.session.stream(True)
    rig.run(40)
    rig.session.stream(False)
    rig.run(10)
    assert not rig.twin.laser_on and not rig.session.silent(rig.now_ns)
    count = len(rig.scans)
    rig.run(50)
    assert len(rig.scans) == count
    rig.session.stream(True)
    rig.run(30)
    assert len(rig.scans) > count + 5


def test_clock_jump_in_mid_stream_is_counted_and_the_times_recover():
    rig = Rig(dataclasses.replace(profiles.IDEAL, start_ms=1e6))
    rig.session.stream(True)
    rig.run(60)
    rig.twin.jump_clock(-5e5)
    rig.run(60)
    assert rig.session.counts["clock_jump"] == 1
    assert np.abs((rig.scans[-1].start_ns + 12_500_000) % 25_000_000 - 12_500_000) < 10_000


def test_rebooted_sensor_streams_again_by_itself():
    rig = Rig()
    rig.session.stream(True)
    rig.run(60)
    rig.twin.reboot()
    rig.scans.clear()
    assert rig.run(130, lambda: len(rig.scans) > 5)


def test_slow_sensor_keeps_its_beam_times_to_the_delay_it_hides():
    rig = Rig()
    rig.session.stream(True)
    rig.run(1000)
    rig.twin.slow_ns = 8_000_000
    rig.run(200)
    errors_ns = [(s.start_ns + 12_500_000) % 25_000_000 - 12_500_000 for s in rig.scans[-70:]]
    assert np.abs(errors_ns).max() < 1_000_000


@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.lists(st.binary(max_size=80), max_size=20), st.booleans())
def test_arbitrary_bytes_never_raise_in_session_or_sensor(pieces, framed):
    rig = Rig()
    rig.session.stream(True)
    rig.run(10)
    for piece in pieces:
        data = b"\n\nPP\n00P\n" + piece + b"\n\n" if framed else piece
        rig.session.receive([Chunk(rig.now_ns, data)], PortState.OPEN, rig.now_ns)
        rig.twin.receive((b"MD" if framed else b"") + piece, rig.now_ns)
        rig.run(1)
    assert rig.run(400, lambda: len(rig.scans) > 3)


def test_stamp_wraps_after_4_h_40_min_without_a_jump():
    rig = Rig(dataclasses.replace(profiles.IDEAL, start_ms=2**24 - 700.0))
    rig.session.stream(True)
    rig.run(150)
    gaps = np.diff([s.start_ns for s in rig.scans])
    assert rig.session.counts["clock_jump"] == 0 and gaps.max() < 25_010_000


def test_same_bytes_give_the_same_state():
    digests = []
    for _ in range(2):
        rig = Rig(profiles.UTM30LX)
        rig.session.stream(True)
        rig.run(120)
        digests.append((rig.session.digest_items(), [s.start_ns for s in rig.scans]))
    assert digests[0] == digests[1]


def test_clock_error_through_the_whole_chain_with_the_utm_30lx_profile():
    profile = dataclasses.replace(profiles.UTM30LX, rate_error=60e-6, start_ms=777.7, spike_ratio=0.02, spike_ns=5e6)
    rig = Rig(profile, latency_ns=23_700_000)
    rig.session.stream(True)
    rig.run(1500)
    turn_ns = 25e6 / (1 + 60e-6)
    errors_ns = np.array([math.remainder(s.start_ns, turn_ns) for s in rig.scans])
    assert np.percentile(np.abs(errors_ns[100:]), 99) < 300_000
    assert np.abs(errors_ns).max() < 1_500_000
