"""3D scans against the truth: a room of planes and boxes, swept through emulated sensor, axis, session and clocks."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from onboard.perception.scan.scan3d import PIXEL, Mask, PoseTrack, Scan3d, gather, points
from onboard.perception.scan.tilt_lag import lag
from onboard.records import BeamStatus, Scan, TiltTrack
from tests.onboard.nodding import EXACT, HARD, ROVER, Nodding, segment

GOAL_M = 0.005
BEAM_S = 25e-3 / 1440


def rms_m(off_m):
    return float(np.sqrt((off_m**2).sum(axis=1).mean()))


def held(scan):
    """The same scan with one tilt for all beams of a turn, the one at its start."""
    pixels = scan.pixels.copy()
    pixels["tilt_rad"] = pixels["tilt_rad"][:, :1]
    return Scan3d(pixels, scan.first_angle_rad, scan.step_rad)


def moving(scan):
    """The turns in which all beams are points and the axis moves all the time."""
    tilt = scan.pixels["tilt_rad"]
    rows = scan.valid.all(axis=1) & (np.abs(tilt[:, -1] - tilt[:, 0]) > 1e-3)
    return Scan3d(scan.pixels[rows], scan.first_angle_rad, scan.step_rad)


@pytest.mark.parametrize("rate_dps", [10, 30])
@pytest.mark.parametrize("profile", [EXACT, HARD])
def test_room_comes_out_within_1_5_mm_rms_of_the_truth(profile, rate_dps):
    bench = Nodding(profile)
    bench.settle(3)
    scan = bench.sweep(-10, 60, rate_dps)
    made = points(scan, ROVER)
    hit_m, axes = bench.hits(scan, made.line, made.beam)
    assert len(made.xyz_m) > 100_000 and set(axes) == {0, 1, 2}
    assert rms_m(made.xyz_m - hit_m) < 0.0015 < GOAL_M
    beyond_m = (made.xyz_m - hit_m)[np.arange(len(axes)), axes]  # off the planes
    assert np.sqrt((beyond_m**2).mean()) < 0.001


def test_with_noisy_ranges_the_room_is_within_2_mm_rms_beyond_their_noise():
    bench = Nodding(dataclasses.replace(EXACT, noise_near_m=0.02))
    bench.settle(3)
    scan = bench.sweep(-10, 60, 30)
    made = points(scan, ROVER)
    off_m = rms_m(made.xyz_m - bench.hits(scan, made.line, made.beam)[0])
    assert math.sqrt(max(0.0, off_m**2 - 0.02**2)) < 0.002 < GOAL_M


@pytest.mark.parametrize(("rate_dps", "at_10_m"), [(10, 0.033), (30, 0.098)])  # the table of the design
def test_one_tilt_for_a_whole_turn_is_worse_by_what_the_table_predicts(rate_dps, at_10_m):
    bench = Nodding()
    bench.settle(3)
    scan = moving(bench.sweep(-10, 60, rate_dps))
    good, flat = points(scan, ROVER), points(held(scan), ROVER)
    hit_m, _ = bench.hits(scan, good.line, good.beam)
    lever_m = good.pixels["range_m"] * np.abs(np.cos(scan.azimuths_rad[good.beam]))
    predicted_m = lever_m * math.radians(rate_dps) * good.beam * BEAM_S
    assert rms_m(flat.xyz_m - hit_m) == pytest.approx(math.sqrt((predicted_m**2).mean()), rel=0.05)
    assert rms_m(good.xyz_m - hit_m) < rms_m(flat.xyz_m - hit_m) / 4
    last = good.beam == 1080
    angle = np.linalg.norm(flat.xyz_m - good.xyz_m, axis=1)[last] / lever_m[last]
    assert 10 * angle.mean() == pytest.approx(at_10_m, rel=0.03)


@pytest.mark.parametrize("late_ms", [-3.0, 0.0, 3.0])
@pytest.mark.parametrize("rate_dps", [10, 30])
def test_lag_shows_as_two_rate_dt_between_a_sweep_down_and_one_up_and_is_found(late_ms, rate_dps):
    bench = Nodding(late_ns=round(late_ms * 1e6))
    bench.settle(3)
    down, up = moving(bench.sweep(5, 60, rate_dps)), moving(bench.sweep(60, 5, rate_dps))
    pitch_rad = []
    for scan in (down, up):
        made = points(scan, ROVER)
        x, y, z = made.xyz_m.T
        floor = np.abs(bench.hits(scan, made.line, made.beam)[0][:, 2]) < 1e-9
        pitch_rad.append(np.linalg.lstsq(np.column_stack([x, y, np.ones(len(x))])[floor], z[floor])[0][0])
    shown_rad = pitch_rad[1] - pitch_rad[0]
    assert shown_rad == pytest.approx(2 * math.radians(rate_dps) * late_ms * 1e-3, abs=3e-4)
    found = lag([down, up], ROVER)
    assert found.late_s == pytest.approx(late_ms * 1e-3, abs=2e-4)  # the axis's frames are 0.1 ms on the bus at least
    assert found.points > 20_000 and found.sigma_s < 1e-4


def test_lag_needs_opposite_sweeps_and_ground():
    bench = Nodding()
    bench.settle(1)
    down, up = bench.sweep(5, 60, 30), bench.sweep(60, 5, 30)
    with pytest.raises(ValueError, match="the same way"):
        lag([down, down], ROVER)
    with pytest.raises(ValueError, match="too few"):
        lag([down, up], ROVER, floor_m=-1.0)


def driving(times_ns):
    """0.1 m/s ahead in a bend of 5 degrees/s, rolling 3 degrees."""
    t = np.asarray(times_ns) * 1e-9 - 3.0
    yaw = np.radians(5) * t
    zero = np.zeros_like(t)
    return np.stack([0.1 * t, 0.02 * t, zero, np.radians(3) * np.sin(t), 0.02 * np.cos(t), yaw], axis=1)


def test_moving_rover_is_compensated_by_the_pose_at_each_beams_time():
    bench = Nodding(pose_at=driving)
    bench.settle(3)
    scan = bench.sweep(0, 60, 30)
    first_ns, last_ns = scan.pixels["time_ns"][[0, -1], [0, -1]]
    times_ns = np.arange(first_ns // 10**7 + 5, last_ns // 10**7 - 5) * 10**7
    poses = driving(times_ns)
    poses[:, 5] = np.angle(np.exp(1j * poses[:, 5]))  # as odometry tells it
    made = points(scan, ROVER, PoseTrack(times_ns, poses))
    hit_m, _ = bench.hits(scan, made.line, made.beam)
    assert rms_m(made.xyz_m - hit_m) < 0.0015
    inside = (made.pixels["time_ns"] >= times_ns[0]) & (made.pixels["time_ns"] <= times_ns[-1])
    assert inside.all() and 0.95 < len(made.xyz_m) / scan.valid.sum() < 1.0  # never extrapolated
    middle = np.repeat(poses[len(poses) // 2][None], 2, axis=0)
    once = points(scan, ROVER, PoseTrack(times_ns[[0, -1]], middle))
    assert rms_m(once.xyz_m - bench.hits(scan, once.line, once.beam)[0]) > 0.05


def test_yaw_that_passes_180_degrees_is_interpolated_over_the_shorter_way():
    pixels = np.zeros((1, 1), PIXEL)
    pixels["range_m"], pixels["time_ns"] = 1.0, 50
    track = PoseTrack(np.array([0, 100]), np.array([[0, 0, 0, 0, 0, 3.1], [0, 0, 0, 0, 0, -3.1]]))
    made = points(Scan3d(pixels, 0.0, 0.1), ROVER, track)
    np.testing.assert_allclose(made.xyz_m, [[-1.0 - ROVER.lidar_x_m, 0.0, ROVER.lidar_z_m]], atol=1e-12)


def test_beams_about_the_turn_of_a_nod_and_before_the_first_sample_have_no_point():
    bench = Nodding()
    bench.settle(2)
    bench.nodes.park_tilt(0.0)
    bench.settle(1)
    begin_ns = bench.now_ns
    bench.nodes.sweep([segment(0, 30, 30), segment(30, 0, 30)], begin_ns + 400_000_000)
    bench.run(lambda: bench.nodes.sweep_done(bench.now_ns))
    bench.settle(0.2)
    scans = [scan for scan in bench.scans if scan.start_ns >= begin_ns]
    scan = gather(scans, bench.nodes.tilt_track(begin_ns + 100_000_000))
    mask, times_ns = scan.pixels["mask"], scan.pixels["time_ns"]
    assert (mask[times_ns < begin_ns + 95_000_000] == Mask.NO_TILT).all()
    turn_ns = begin_ns + 1_403_000_000  # the axis follows 3 ms late
    about_ms = np.abs(times_ns - turn_ns) * 1e-6
    assert (mask[about_ms < 15] == Mask.TURNING).all()
    assert (mask[(about_ms > 60) & (about_ms < 800)] == BeamStatus.OK).all()
    assert np.isfinite(scan.pixels["range_m"]).all()
    assert (np.isnan(scan.pixels["tilt_rad"]) == (mask == Mask.NO_TILT)).all()


def interrupted(bench, harm):
    """A sweep of 2 s in the middle of which something happens to the sensor."""
    bench.settle(3)
    bench.nodes.park_tilt(0.0)
    bench.settle(1)
    begin_ns = bench.now_ns
    bench.nodes.sweep([segment(0, 60, 30)], begin_ns + 400_000_000)
    bench.settle(1.2)
    harm(bench)
    bench.run(lambda: bench.nodes.sweep_done(bench.now_ns))
    bench.settle(0.5)
    taken = [scan for scan in bench.scans if scan.start_ns >= begin_ns]
    return gather(taken, bench.nodes.tilt_track(begin_ns - 100_000_000))


def test_sensor_that_reboots_in_mid_sweep_costs_scans_and_no_point_is_wrong():
    bench = Nodding()
    scan = interrupted(bench, lambda bench: bench.twin.reboot())
    made = points(scan, ROVER)
    assert bench.session.counts["clock_reboot"] == 1 and bench.session.counts["clock_jump"] == 0
    assert 50 < len(scan.pixels) < 115
    assert rms_m(made.xyz_m - bench.hits(scan, made.line, made.beam)[0]) < 0.0015


def test_counter_that_wraps_in_mid_sweep_costs_nothing():
    bench = Nodding(dataclasses.replace(HARD, start_ms=2**24 - 5200.0))
    scan = interrupted(bench, lambda bench: None)
    made = points(scan, ROVER)
    assert bench.twin.clock_ms(bench.now_ns) < 3000
    counts = bench.session.counts
    assert counts["clock_reboot"] == counts["clock_jump"] == counts["missed"] == 0
    assert rms_m(made.xyz_m - bench.hits(scan, made.line, made.beam)[0]) < 0.0015


def test_statuses_and_intensities_stay_in_the_image():
    status = np.array([BeamStatus.OK, BeamStatus.NO_RETURN, BeamStatus.TOO_NEAR, BeamStatus.ERROR], np.uint8)
    ranges_m = np.array([2.0, np.nan, np.nan, np.nan], np.float32)
    track = TiltTrack(np.arange(0, 100, 5) * 1_000_000, np.full(20, 0.5))
    turn = Scan(20_000_000, 1000.0, -0.1, 0.05, ranges_m, status, intensity=np.arange(4, dtype=np.int32))
    later = dataclasses.replace(turn, start_ns=45_000_000, intensity=None)
    scan = gather([turn, later], track)
    assert scan.pixels["mask"].tolist() == [status.tolist()] * 2
    assert scan.pixels["intensity"].tolist() == [[0, 1, 2, 3], [-1] * 4]
    assert scan.pixels["time_ns"][1].tolist() == [45_000_000, 45_001_000, 45_002_000, 45_003_000]
    assert scan.valid.sum() == 2 and len(points(scan, ROVER).xyz_m) == 2


def test_turns_of_two_geometries_or_none_are_refused():
    track = TiltTrack(np.arange(2), np.zeros(2))
    turn = Scan(0, 1.0, 0.0, 0.1, np.ones(3, np.float32), np.zeros(3, np.uint8))
    with pytest.raises(ValueError, match="2"):
        gather([turn, dataclasses.replace(turn, step_rad=0.2)], track)
    with pytest.raises(ValueError, match="0"):
        gather([], track)
