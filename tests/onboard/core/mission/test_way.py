"""The way driven: the trail for the planner, and how the rover goes back along it."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onboard.core.mission.driven_trail import TRAIL_M, TRAIL_POSES, DrivenTrail
from onboard.records import Pose


def driven(poses, since_look_m=0.0):
    way = DrivenTrail(since_look_m)
    for x, y, yaw in poses:
        way.note(Pose(x, y, yaw_rad=yaw))
    return way


def ahead(length_m, yaw=0.0, step_m=0.001):
    return [(k * step_m, 0.0, yaw) for k in range(round(length_m / step_m) + 1)]


def test_it_goes_back_as_far_as_asked_and_keeps_its_heading():
    stations = driven(ahead(1.0)).back(0.3).stations
    assert stations[0] == pytest.approx((1.0, 0.0, 0.0))
    assert stations[-1] == pytest.approx((0.7, 0.0, 0.0))
    assert (np.diff(stations[:, 0]) < 0).all()


def test_it_goes_back_round_the_bend_that_it_came_by():
    radius_m = 0.5
    bend = [(radius_m * math.sin(a), radius_m * (1 - math.cos(a)), a) for a in np.arange(0.0, 1.0, 0.002)]
    stations = driven(bend).back(0.3).stations
    off = np.hypot(stations[:, 0], stations[:, 1] - radius_m) - radius_m
    assert np.abs(off).max() < 0.002  # chords of 5 cm
    assert stations[0, 2] - stations[-1, 2] == pytest.approx(0.3 / radius_m, abs=0.01)


def test_no_farther_than_the_way_since_the_last_scan():
    way = driven(ahead(1.0))
    way.begin()
    for x in np.arange(1.0, 1.2, 0.001):
        way.note(Pose(float(x), 0.0))
    assert way.back(0.3).stations[-1] == pytest.approx((1.0, 0.0, 0.0), abs=0.001)
    assert way.trail[0] == pytest.approx((0.0, 0.0, 0.0))  # the trail goes on


def test_a_turn_on_the_spot_is_turned_back_at_its_place():
    turned = [(0.2, 0.0, float(a)) for a in np.arange(0.0, 1.5, 0.01)]
    stations = driven([*ahead(0.2), *turned]).back(0.1).stations
    at = np.hypot(stations[:, 0] - 0.2, stations[:, 1]) < 1e-9
    assert stations[at][0, 2] > 1.4
    assert np.ptp(stations[at][:, 2]) > 1.3
    assert stations[-1] == pytest.approx((0.1, 0.0, 0.0), abs=1e-9)


@pytest.mark.parametrize("poses", [[(1.0, 2.0, 0.5)], [(1.0, 2.0, a / 10) for a in range(20)]])
def test_where_the_rover_only_stood_or_turned_there_is_no_way_back(poses):
    assert len(driven(poses).back(0.3).stations) == 0


@given(
    st.lists(st.tuples(st.floats(-0.2, 0.2), st.floats(-0.2, 0.2), st.floats(-0.5, 0.5)), max_size=30),
    st.floats(0.0, 2.0),
)
def test_the_way_back_is_never_longer_than_asked(steps, way_m):
    poses = np.cumsum([(0.0, 0.0, 0.0), *steps], axis=0)
    assert driven(poses.tolist()).back(way_m).length_m <= way_m + 1e-9


def test_the_trail_has_a_pose_each_10_cm_and_only_the_newest_400():
    trail = driven(ahead(60.0, step_m=0.01)).trail
    assert len(trail) == TRAIL_POSES
    assert np.diff(trail[:, 0]) == pytest.approx(TRAIL_M, abs=0.011)
    assert trail[-1, 0] > 59.8


def test_the_way_since_the_last_look_adds_up():
    assert driven(ahead(1.0)).since_look_m == pytest.approx(1.0, abs=TRAIL_M)
    assert driven(ahead(1.0), math.inf).since_look_m == math.inf


def test_a_correction_at_a_stop_bends_the_trail_since_the_last_one_to_end_there_and_no_further_back():
    way = driven(ahead(2.0))
    way.correct(Pose(2.0, 0.0))
    for pose in ahead(2.0)[1:]:
        way.note(Pose(2.0 + pose[0], 0.0, yaw_rad=0.0))
    before = way.trail
    way.correct(Pose(3.9, 0.2, yaw_rad=0.04))
    after, first = way.trail, int((before[:, 0] <= 2.0).sum())
    assert np.array_equal(after[:first], before[:first])
    assert after[-1] == pytest.approx(before[-1] + (-0.1, 0.2, 0.04), abs=1e-9)
    shares = (after - before)[first:, 1] / 0.2
    assert np.diff(shares) == pytest.approx(1 / len(shares), abs=1e-9)  # in step with the way, so nothing tears
    assert way.since_look_m == 0.0


def test_a_correction_is_no_way_that_was_driven():
    way = driven(ahead(1.0))
    way.correct(Pose(1.3, 0.0))
    way.note(Pose(1.3, 0.0))
    assert way.since_look_m < TRAIL_M
    assert len(way.back(1.0).stations) == 0
