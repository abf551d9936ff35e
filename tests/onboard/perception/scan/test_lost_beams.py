"""What a sweep lost, by direction and distance, and what can be told of the cause."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.perception.scan.loss_cause import Cause, SweepLoss, cause
from onboard.perception.scan.lost_beams import BANDS_M, SECTORS, SURE_M, lost_beams, plane_range_m
from onboard.records import Pose, TiltTrack
from tests.onboard.loss_rig import (
    CONFIG,
    TRACK,
    at_random,
    beams_from,
    clumps,
    counted,
    dark,
    nothing,
    sun,
    sweep,
    window,
)

NEAR = slice(0, 2)  # bands within SURE_M


def view(lost, *pose):
    at = Pose(pose[0], pose[1], yaw_rad=math.radians(pose[2]))
    return SweepLoss(counted(lost(at) if lost is not nothing else nothing, at), at)


def told(*views):
    return cause(views, CONFIG.lost_beams.slow_ratio)


# -- counts ------------------------------------------------------------------------------------------------------


def test_level_ground_without_loss_has_none_in_any_direction_and_the_sky_counts_for_nothing():
    seen = counted(nothing)
    assert seen.ratio == 0.0 and not seen.lost.any() and not seen.open.any()
    assert (seen.due > 100).all()
    below = np.isfinite(beams_from().range_m) & (beams_from().range_m <= BANDS_M[-1])
    assert seen.due.sum() == below.sum() < 0.6 * below.size


@settings(max_examples=6, deadline=None)
@given(st.sampled_from([0.01, 0.03, 0.08, 0.3]), st.sampled_from([at_random, clumps]), st.integers(0, 100))
def test_the_share_lost_at_random_is_found_everywhere(ratio, kind, seed):
    seen = counted(kind(ratio, seed))
    true_ratio = kind(ratio, seed)(beams_from())[beams_from().range_m <= SURE_M].mean()
    assert seen.ratio == pytest.approx(true_ratio, rel=0.02)
    assert seen.sectors == pytest.approx(np.full(SECTORS, true_ratio), abs=0.1)


def test_a_beam_that_the_ground_beyond_8_m_swallows_is_not_lost():
    grazing = counted(lambda beams: beams.range_m > 8.0)
    assert not grazing.lost.any() and not grazing.open.any()


def test_ground_that_ends_is_open_not_lost_and_counts_towards_it_only():
    edge = counted(lambda beams: beams.x_m > 2.5)
    assert edge.ratio == 0.0 and edge.open[:, NEAR].sum() > 1000
    assert edge.towards(0.0, 8.0) > 0.2
    assert edge.towards(math.radians(60), 1.0) < 0.05


def test_a_dark_disc_is_lost_at_its_distance_in_its_direction_and_nowhere_else():
    seen = counted(dark(3.0, 0.0, 0.5))
    lost = np.argwhere(np.nan_to_num(seen.cells) > 0.2)
    assert {(6, 1)} <= set(map(tuple, lost.tolist())) <= {(5, 1), (6, 1), (7, 1)}
    assert seen.towards(0.0, 4.0) > 3 * seen.ratio
    assert seen.towards(math.radians(50), 4.0) == 0.0


def test_a_sector_where_no_beam_at_all_returns_is_lost_not_open():
    seen = counted(window(20, 45))
    assert seen.sectors[seen.sector(math.radians(32))] == 1.0
    assert not seen.open.any()


def test_what_the_rover_s_own_deck_returns_does_not_make_dirt_an_open_end():
    beams = beams_from()
    deck = (beams.tilt_rad > math.radians(50)) & (np.abs(beams.azimuth_rad) < math.radians(20))
    scans = [
        dataclasses.replace(
            scan,
            ranges_m=np.where(row, 0.2, scan.ranges_m).astype(np.float32),
            status=np.where(row, 0, scan.status).astype(np.uint8),
        )
        for scan, row in zip(sweep(beams, window(-15, 15)(beams)), deck)
    ]
    seen = lost_beams(scans, TRACK, CONFIG.rover, CONFIG.scanning)
    assert not seen.open.any() and seen.sectors[6] > 0.3


def test_directions_are_counted_from_the_right_and_outside_the_sector_there_is_none():
    seen = counted(nothing)
    assert (seen.sector(math.radians(-64)), seen.sector(0.0), seen.sector(math.radians(64))) == (0, 6, 12)
    assert seen.sector(math.radians(66)) is None and math.isnan(seen.towards(math.pi, 4.0))
    assert seen.azimuth_rad(6) == pytest.approx(0.0, abs=1e-9)


def test_without_scans_or_without_the_axis_nothing_is_due():
    scans = sweep(beams_from(), nothing(beams_from()))
    for seen in (
        lost_beams((), TRACK, CONFIG.rover, CONFIG.scanning),
        lost_beams(scans, TiltTrack(np.zeros(0, np.int64), np.zeros(0)), CONFIG.rover, CONFIG.scanning),
    ):
        assert not seen.due.any() and seen.ratio == 0.0 and math.isnan(seen.towards(0.0, 4.0))


def test_scans_of_another_geometry_are_left_out():
    scans = sweep(beams_from(), nothing(beams_from()))
    odd = dataclasses.replace(scans[3], ranges_m=scans[3].ranges_m[:50], status=np.ones(50, np.uint8))
    assert lost_beams((*scans[:3], odd, *scans[4:]), TRACK, CONFIG.rover, CONFIG.scanning).ratio == 0.0


def test_the_way_to_the_plane_knows_how_the_tilt_unit_is_bolted_on():
    level, pitched = CONFIG.rover, dataclasses.replace(CONFIG.rover, lidar_pitch_rad=0.1)
    ahead = np.zeros(1)
    assert plane_range_m(ahead, 0.2, pitched) == pytest.approx(plane_range_m(ahead, 0.3, level))
    assert plane_range_m(ahead, math.asin(0.7 / SURE_M), level)[0] == pytest.approx(SURE_M)
    assert np.isinf(plane_range_m(ahead, -0.05, level)[0])


# -- causes ------------------------------------------------------------------------------------------------------


def fixed(lost):
    """The same loss from every pose."""
    return lambda _pose: lost


def test_nothing_is_lost_where_one_beam_in_a_hundred_is():
    assert told(view(fixed(clumps(0.01)), 0, 0, 0)) is Cause.CLEAR
    assert told() is Cause.CLEAR


def test_one_sweep_cannot_tell_dirt_from_sunlight():
    assert told(view(fixed(window(20, 45)), 0, 0, 0)) is Cause.UNKNOWN


@pytest.mark.parametrize("turned_deg", [30, 45, 180])
def test_what_stays_in_the_scanner_s_frame_when_the_rover_turns_is_dirt_on_the_window(turned_deg):
    views = [view(fixed(window(20, 45)), 0, 0, yaw) for yaw in (0, turned_deg)]
    assert told(*views) is Cause.WINDOW


@pytest.mark.parametrize("turned_deg", [30, 45, -40])
def test_what_stays_in_the_map_s_directions_when_the_rover_turns_is_sunlight(turned_deg):
    views = [view(lambda pose: sun(pose, 5.0), 0, 0, yaw) for yaw in (0, turned_deg)]
    assert told(*views) is Cause.SUN


def test_what_stays_at_its_place_seen_from_elsewhere_is_dark_ground():
    views = [view(fixed(dark(3.2, 0.3, 0.8)), *pose) for pose in ((0, 0, 0), (1.0, -0.8, 30))]
    assert told(*views) is Cause.GROUND
    assert told(views[0]) is Cause.UNKNOWN


def test_dark_ground_close_before_the_rover_is_no_blind_scanner_where_it_was_seen_from_afar():
    views = [view(fixed(dark(3.9, 0.0, 1.6)), x, 0, 0) for x in (0.0, 1.6)]
    assert told(*views) is Cause.GROUND


def test_ground_that_ends_is_told_as_that():
    assert told(view(fixed(lambda beams: beams.x_m > 1.5), 0, 0, 0)) is Cause.END


def test_a_scanner_that_loses_in_all_directions_or_more_with_each_sweep_goes_blind():
    assert told(view(fixed(at_random(0.5)), 0, 0, 0)) is Cause.BLIND
    grows = [
        view(fixed(lambda beams, r=r: at_random(r)(beams) & (np.abs(beams.azimuth_rad) < 0.55)), 0, 0, 0)
        for r in (0.25, 0.42, 0.6)
    ]
    assert told(*grows) is Cause.BLIND
    assert told(*grows[::-1]) is not Cause.BLIND
