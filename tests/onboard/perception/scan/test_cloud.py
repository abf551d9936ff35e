"""Beams to points, against a slow plain twin and a hand-worked beam."""

from __future__ import annotations

import math

import numpy as np
import pytest

from onboard.config import Rover, Scanning
from onboard.perception.scan.cloud import cloud, hull_boxes
from onboard.records import BeamStatus, Pose, Scan, TiltTrack

BEAM_NS = 25e6 / 1440
ROVER, SCANNING, HERE = Rover(), Scanning(), np.eye(4)


def scan(ranges_m, status=None, start_ns=0):
    ranges_m = np.asarray(ranges_m, np.float32)
    status = np.zeros(len(ranges_m), np.uint8) if status is None else np.asarray(status, np.uint8)
    ranges_m = np.where(status == 0, ranges_m, np.float32(np.nan))
    return Scan(start_ns, BEAM_NS, -0.75 * math.pi, math.pi / 720, ranges_m, status)


def held(angle_deg, until_ns=10**9):
    return TiltTrack(np.array([0, until_ns], np.int64), np.radians([angle_deg, angle_deg]))


def made(scans, tilt, pose=HERE):
    return cloud(scans, tilt, pose, ROVER, SCANNING, 0.02)


def lit(*beams):
    """Status of a line in which these beams alone measure."""
    status = np.full(1081, BeamStatus.ERROR)
    status[list(beams)] = BeamStatus.OK
    return status


def test_a_beam_at_45_degrees_down_meets_flat_ground_0_70_m_ahead_of_the_scanner():
    got = made([scan(np.full(1081, 0.70 * math.sqrt(2)), lit(540, 541))], held(45))
    assert got.hit.tolist() == [True, True]
    assert got.ends_m[0] == pytest.approx([ROVER.lidar_x_m + 0.70, 0.0, 0.0], abs=1e-6)
    assert got.origin_m == pytest.approx([0.30, 0.0, 0.70])


def test_beams_turn_counter_clockwise_so_a_late_beam_looks_left():
    got = made([scan(np.full(1081, 2.0), lit(540 + 240, 540 + 241))], held(0))
    assert got.ends_m[0] == pytest.approx([0.30 + 1.0, 2.0 * math.sin(math.radians(60)), 0.70], abs=1e-6)


def has_witness(scans, line, beam, low, high):
    """A neighbour in range, or the middle of two opposite ones; beams from `low` to `high` are in the sector."""

    def at(dj, di):
        k, i = line + dj, beam + di
        inside = 0 <= k < len(scans) and low <= i <= high
        return float(scans[k].ranges_m[i]) if inside and scans[k].status[i] == 0 else math.nan

    own, tolerance_m = at(0, 0), 3 * math.sqrt(2) * 0.02
    ways = [(0, 1), (1, -1), (1, 0), (1, 1)]
    near = [at(s * dj, s * di) for dj, di in ways for s in (1, -1)]
    near += [(at(dj, di) + at(-dj, -di)) / 2 for dj, di in ways]
    return any(abs(own - other) <= tolerance_m for other in near)


def plain(scans, tilt, T):
    """One beam at a time, with matrices."""
    range_m, sector_rad = 8.0, math.radians(65)
    ends, hits, boxes = [], [], hull_boxes(ROVER)
    for line, s in enumerate(scans):
        phis = [s.first_angle_rad + k * s.step_rad for k in range(len(s.ranges_m))]
        sector = [k for k, phi in enumerate(phis) if abs(phi) <= sector_rad]
        for k in sector:
            t, phi = s.start_ns + k * s.beam_ns, phis[k]
            if s.status[k] != 0 or not tilt.times_ns[0] <= t <= tilt.times_ns[-1]:
                continue
            if not has_witness(scans, line, k, sector[0], sector[-1]):
                continue
            j = max(1, int(np.searchsorted(tilt.times_ns, t)))
            t0, t1 = tilt.times_ns[j - 1], tilt.times_ns[j]
            a = tilt.angles_rad[j - 1] + (tilt.angles_rad[j] - tilt.angles_rad[j - 1]) * (t - t0) / (t1 - t0)
            R = np.array([[math.cos(a), 0, math.sin(a)], [0, 1, 0], [-math.sin(a), 0, math.cos(a)]])
            hit = s.ranges_m[k] <= range_m
            length = float(s.ranges_m[k]) if hit else range_m
            base = R @ (length * np.array([math.cos(phi), math.sin(phi), 0])) + [0.30, 0, 0.70]
            if hit and any((b[0] <= base).all() and (base <= b[1]).all() for b in boxes):
                continue
            ends.append((T @ [*base, 1.0])[:3])
            hits.append(hit)
    return np.array(ends), np.array(hits)


def test_cloud_agrees_with_the_slow_twin_within_float32():
    rng = np.random.default_rng(4)
    scans = [
        scan(
            np.abs(np.cumsum(rng.normal(0, 0.07, 1081)) + 3 + 3 * k + rng.choice([0, 0.6], 1081, p=(0.9, 0.1))),
            rng.choice(4, 1081, p=(0.85, 0.07, 0.04, 0.04)),
            k * 25_000_000 - 10_000_000,
        )
        for k in range(4)
    ]
    times_ns = np.arange(0, 60_000_000, 5_000_000)
    tilt = TiltTrack(times_ns, np.radians(60 - 20e-9 * times_ns) + rng.normal(0, 5e-4, len(times_ns)))
    T = Pose(3.0, -2.0, 0.4, 0.1, -0.15, 2.0).matrix()
    got, (ends_m, hits) = made(scans, tilt, T), plain(scans, tilt, T)
    assert got.ends_m.dtype == np.float32 and got.hit.dtype == np.bool_
    assert np.array_equal(got.hit, hits) and 0 < hits.sum() < len(hits)
    assert np.abs(got.ends_m - ends_m).max() < 2e-6


def test_beams_outside_the_tilt_track_are_dropped_not_extrapolated():
    s = scan(np.full(1081, 3.0))
    first_ns, last_ns = round(500.5 * BEAM_NS), round(600.5 * BEAM_NS)
    track = TiltTrack(np.array([first_ns, last_ns]), np.array([0.100, 0.101]))
    assert len(made([s], track).hit) == 100
    assert len(made([s], TiltTrack(np.empty(0, np.int64), np.empty(0))).hit) == 0
    assert made([], track).ends_m.shape == (0, 3)


def test_a_beam_that_hit_beyond_the_mapping_range_passed_up_to_it():
    got = made([scan(np.full(1081, 9.0), lit(540, 541))], held(0))
    assert got.hit.tolist() == [False, False]
    assert np.linalg.norm(got.ends_m - got.origin_m, axis=1) == pytest.approx([8.0, 8.0], abs=1e-5)


def test_a_beam_without_return_is_not_in_the_cloud_for_nobody_knows_how_far_it_went():
    status = np.full(1081, BeamStatus.NO_RETURN)
    assert len(made([scan(np.full(1081, 3.0), status)], held(30)).hit) == 0
    status[540:542] = BeamStatus.OK
    assert made([scan(np.full(1081, 3.0), status)], held(30)).hit.tolist() == [True, True]


def test_where_it_is_asked_for_beams_without_return_or_witness_end_at_the_mapping_range():
    ranges_m, status = np.full(1081, 3.0), lit(540, 541, 542)
    ranges_m[542], status[543] = 5.0, BeamStatus.NO_RETURN
    got = cloud([scan(ranges_m, status)], held(0), HERE, ROVER, SCANNING, 0.02, lost=True)
    assert got.hit.tolist() == [True, True, False, False]
    assert np.linalg.norm(got.ends_m - got.origin_m, axis=1) == pytest.approx([3.0, 3.0, 8.0, 8.0], abs=1e-5)


def test_a_return_without_a_witness_is_not_in_the_cloud_and_two_side_by_side_are():
    ranges_m = np.full(1081, 4.0)
    ranges_m[500], ranges_m[600:602] = 3.0, 3.0  # a speck of dust; a rock of two beams
    line = made([scan(ranges_m)], held(0))
    near = np.linalg.norm(line.ends_m - line.origin_m, axis=1) < 3.5
    assert near.sum() == 2 and len(line.hit) == 521 - 1


def test_returns_from_deck_and_wheels_are_masked_and_ground_beside_them_is_not():
    boxes = hull_boxes(ROVER)
    assert boxes[0] == pytest.approx(np.array([[-0.405, -0.26, 0.12], [0.405, 0.26, 0.53]]))
    down = lit(540, 541)
    for length_m, kept in ((0.19, 1), (0.25, 0), (0.79, 1)):  # above the deck, in it, on the ground ahead
        got = made([scan(np.full(1081, length_m), down)], held(60 if kept else 80))
        assert len(got.hit) == 2 * kept, length_m
