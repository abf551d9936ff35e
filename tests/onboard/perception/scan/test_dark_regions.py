"""Regions of lost beams that chance does not make: found where a dark thing stands, and nowhere else."""

import math
from dataclasses import replace

import numpy as np
import pytest

from onboard.perception.scan.dark_regions import DEPTH_M, dark_regions
from onboard.records import BeamStatus, Pose, TiltTrack
from tests.missions.world.scan_errors import lost
from tests.onboard.loss_rig import CONFIG, FAR_M, TRACK, at_random, beams_from, dark, nothing, sun, sweep, track, window

BEAMS = beams_from()
SIDE_M = 0.2


def found(gone, beams=BEAMS, tilt=TRACK, config=CONFIG):
    """(k, 2) points of the sweep over level ground in which these beams (lines, beams) return nothing."""
    return dark_regions(sweep(beams, gone), tilt, config.rover, config.scanning)[:, :2]


def box(x_m, y_m, side_m=SIDE_M, high_m=SIDE_M, beams=BEAMS):
    """Beams (lines, beams) that meet an upright box of this height and side with its middle there."""
    rover = CONFIG.rover
    way = np.where(np.isfinite(beams.range_m), beams.range_m, FAR_M)
    out = np.stack([beams.x_m - rover.lidar_x_m, beams.y_m, -way * rover.lidar_z_m / beams.range_m], -1)
    low = np.array([x_m - side_m / 2 - rover.lidar_x_m, y_m - side_m / 2, -rover.lidar_z_m])
    high = low + np.array([side_m, side_m, high_m])
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = low / out, high / out
    return np.fmin(a, b).max(axis=-1) <= np.minimum(np.fmax(a, b).min(axis=-1), 1.0)


@pytest.mark.parametrize(("ratio", "clump"), [
    (0.01, (1, 1)), (0.03, (1, 1)), (0.08, (1, 1)), (0.01, (3, 30)), (0.03, (3, 30)), (0.08, (3, 30)),
])  # fmt: skip
def test_beams_lost_at_random_are_no_region(ratio, clump):
    for seed in range(6):
        gone = lost(BEAMS.range_m.shape, ratio, clump, np.random.default_rng(seed))
        assert gone.mean() == pytest.approx(ratio, rel=0.1)
        assert len(found(gone)) == 0


@pytest.mark.parametrize("bearing_deg", [0.0, 35.0, -60.0])
@pytest.mark.parametrize("away_m", [2.0, 4.0, 6.0, 8.0])
def test_a_dark_box_is_found_and_its_points_lie_on_it(away_m, bearing_deg):
    bearing = math.radians(bearing_deg)
    x, y = CONFIG.rover.lidar_x_m + (away_m - 0.3) * math.cos(bearing), (away_m - 0.3) * math.sin(bearing)
    for seed in range(3):
        random = lost(BEAMS.range_m.shape, 0.03, (3, 30), np.random.default_rng(seed))
        points = found(box(x, y) | random)
        assert len(points) > 20
        away = np.hypot(*(points - (x, y)).T)  # on it, or behind it by the depth; some beams pass its side first
        assert (away < DEPTH_M + 0.1).mean() > 0.9 and away.max() < 0.65
        for at in ((x, y), (x - 0.05, y), (x + 0.05, y), (x, y - 0.05), (x, y + 0.05)):
            assert np.hypot(*(points - at).T).min() < 0.05


def test_a_box_that_returns_is_no_region_and_no_loss_is_none():
    assert len(found(nothing(BEAMS))) == 0
    seen = box(3.0, 0.0)
    scans = [
        replace(
            scan,
            ranges_m=np.where(row, 2.6, scan.ranges_m).astype(np.float32),
            status=np.where(row, BeamStatus.OK, scan.status).astype(np.uint8),
        )
        for scan, row in zip(sweep(BEAMS, seen), seen)
    ]
    assert len(dark_regions(scans, TRACK, CONFIG.rover, CONFIG.scanning)) == 0


def test_dark_ground_is_unseen_from_where_it_begins():
    points = found(dark(3.0, 0.0, 0.5)(BEAMS))
    assert len(points) > 100
    assert np.hypot(points[:, 0] - 3.0, points[:, 1]).max() < 0.6
    assert points[:, 0].min() == pytest.approx(2.5, abs=0.06)


@pytest.mark.parametrize("gone", [
    lambda beams: beams.range_m > 8.0, lambda beams: beams.x_m > 2.5, window(20, 45), sun(Pose(0.0, 0.0), 30.0),
    lambda beams: np.ones(beams.range_m.shape, bool), dark(12.0, 0.0, 1.5), at_random(0.3),
])  # fmt: skip
def test_ground_that_ends_dirt_sunlight_and_what_lies_beyond_the_mapping_range_are_no_region(gone):
    assert len(found(gone(BEAMS))) == 0


def test_a_box_under_the_steepest_lines_has_no_ground_below_it_and_is_found():
    x = 0.85  # the first line meets the ground 0.7 m ahead
    points = found(box(x, 0.0))
    assert len(points) and np.hypot(*(points - (x, 0.0)).T).min() < 0.05


def test_a_speck_of_dust_before_the_box_does_not_hide_it():
    x, y = 4.0, 0.0
    gone = box(x, y)
    line, beam = np.argwhere(gone)[gone.sum() // 2]
    scans = list(sweep(BEAMS, gone))
    ranges_m, status = scans[line].ranges_m.copy(), scans[line].status.copy()
    ranges_m[beam], status[beam] = 0.8, BeamStatus.OK
    scans[line] = replace(scans[line], ranges_m=ranges_m, status=status)
    points = dark_regions(scans, TRACK, CONFIG.rover, CONFIG.scanning)
    assert np.hypot(*(points[:, :2] - (x, y)).T).max() < DEPTH_M + 0.1


def test_a_sweep_from_the_top_down_finds_the_same():
    down = replace(
        CONFIG, scanning=replace(CONFIG.scanning, start_rad=CONFIG.scanning.end_rad, end_rad=CONFIG.scanning.start_rad)
    )
    tilt = track(down)
    beams = beams_from(config=down, tilt=tilt)
    points, usual = found(box(4.0, 0.5, beams=beams), beams, tilt, down), found(box(4.0, 0.5))
    assert np.abs(points.mean(axis=0) - usual.mean(axis=0)).max() < 0.05


def test_without_scans_or_without_the_axis_nothing_is_dark():
    gone = box(3.0, 0.0)
    for scans, tilt in (((), TRACK), (sweep(BEAMS, gone), TiltTrack(np.zeros(0, np.int64), np.zeros(0)))):
        assert dark_regions(scans, tilt, CONFIG.rover, CONFIG.scanning).shape == (0, 3)
