"""Sensor bytes to points: a whole sweep over flat ground through emulator, session, clock, tilt track and cloud."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from hil.devices.lidar import profile as profiles
from hil.devices.lidar import sensor
from onboard.config import Lidar, Rover, Scanning
from onboard.devices.lidar.session import LidarSession
from onboard.perception.scan.cloud import cloud
from onboard.perception.scan.sweep import segments
from onboard.records import Chunk, PortState, Pose, TiltTrack

TICK_NS, LEAD_NS = 10_000_000, 1_000_000_000
SWEEP = segments(Scanning(), Rover().lidar_z_m)
ENDS_NS = LEAD_NS + np.cumsum([0] + [s.duration_ns for s in SWEEP])
ANGLES_RAD = np.array([SWEEP[0].start_rad] + [s.end_rad for s in SWEEP])
PHI = np.radians(np.arange(1081) * 0.25 - 135.0)


def flat_ground(times_ns):
    """Ranges from 0.70 m above flat ground, each beam at its own time and tilt."""
    down = np.cos(PHI) * np.sin(np.interp(times_ns, ENDS_NS, ANGLES_RAD))
    with np.errstate(divide="ignore"):
        return np.where(down > 1e-9, 0.70 / down, np.inf)


def fly(profile, latency_ns):
    session, twin = LidarSession(Lidar(latency_ns=latency_ns)), sensor.Lidar(5, flat_ground, profile)
    twin.connect()
    session.stream(True)
    scans, up = [], b""
    for tick in range(1, int(ENDS_NS[-1] / TICK_NS) + 20):
        now_ns = tick * TICK_NS
        twin.receive(up, now_ns - TICK_NS)
        twin.step(now_ns)
        scans += session.receive([Chunk(*piece) for piece in twin.send()], PortState.OPEN, now_ns)
        up = session.send(now_ns)
    times_ns = np.arange(LEAD_NS, ENDS_NS[-1], 5_000_000)
    track = TiltTrack(times_ns, np.interp(times_ns, ENDS_NS, ANGLES_RAD))
    return cloud(scans, track, Pose(2.0, 1.0, 0.5, yaw_rad=0.7).matrix(), Rover(), Scanning(), 0.02)


HARD = dataclasses.replace(profiles.UTM30LX, rate_error=80e-6, start_ms=321.5, spike_ratio=0.02, spike_ns=5e6)


@pytest.mark.parametrize(("profile", "latency_ns"), [(profiles.IDEAL, 19_750_000), (HARD, 23_700_000)])
def test_flat_ground_comes_out_flat_to_half_a_millimetre_and_as_noisy_as_the_ranges(profile, latency_ns):
    got = fly(profile, latency_ns)
    hits_m = got.ends_m[got.hit].astype(np.float64) - [2.0, 1.0, 0.5]
    reach_m = np.linalg.norm(got.ends_m[got.hit] - got.origin_m, axis=1)
    sine = 0.70 / reach_m
    assert len(hits_m) > 80_000
    for low_m, high_m in ((0.7, 1.5), (1.5, 3.0), (3.0, 5.0), (5.0, 7.5)):
        ring = (reach_m >= low_m) & (reach_m < high_m)
        assert abs(hits_m[ring, 2].mean()) < 0.0005, (low_m, hits_m[ring, 2].mean())
        assert hits_m[ring, 2].std() == pytest.approx(0.02 * sine[ring].mean(), rel=0.15)
