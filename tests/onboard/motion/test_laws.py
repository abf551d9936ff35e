"""Laws of following on their own: the plane of a slope, pure pursuit's arc, the rolling wheel; and the speed limit."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.config import Motion, Rover
from onboard.motion.degraded import constraint
from onboard.motion.kinematics import wheel_places
from onboard.motion.laws import Sight, in_plane, pure_pursuit, roll
from onboard.motion.route import Leg, route
from onboard.motion.speed import Conditions, speed_limit
from onboard.records import Path, Pose
from tests.onboard.motion.test_follower import path

MOTION = Motion()
PLACES = wheel_places(Rover())
DEG = math.pi / 180


def leg_of(track):
    return next(stage for stage in route(track, (0.1, 0.1, 0.1)) if isinstance(stage, Leg))


tilts = st.floats(-25 * DEG, 25 * DEG)
steps = st.floats(-2.0, 2.0)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(tilts, tilts, st.floats(-math.pi, math.pi), steps, steps)
def test_a_step_in_the_map_and_the_step_in_the_rovers_plane_lie_above_each_other(roll_rad, pitch_rad, yaw_rad, dx, dy):
    pose = Pose(3.0, -2.0, 0.5, roll_rad, pitch_rad, yaw_rad)
    there = pose.matrix() @ np.array([*in_plane(pose, dx, dy), 0.0, 1.0])
    assert there[:2] == pytest.approx([3.0 + dx, -2.0 + dy], abs=1e-9)


def test_a_metre_up_a_slope_of_20_degrees_is_longer_than_its_metre_in_the_map():
    assert in_plane(Pose(0.0, 0.0, pitch_rad=-20 * DEG), 1.0, 0.0) == pytest.approx((1 / math.cos(20 * DEG), 0.0))
    assert in_plane(Pose(0.0, 0.0, roll_rad=20 * DEG), 0.0, 1.0) == pytest.approx((0.0, 1 / math.cos(20 * DEG)))


@settings(max_examples=150, deadline=None, derandomize=True)
@given(st.floats(-0.25, 0.25), st.floats(-0.7, 0.7), st.sampled_from([0.0, math.pi]))
def test_pure_pursuit_drives_the_circle_through_the_carrot_ahead_or_backwards(left_m, off_rad, lead):
    track = path((0, 0, math.degrees(lead)), (3, 0, math.degrees(lead)))
    pose = Pose(1.0, left_m, yaw_rad=math.remainder(off_rad + lead, math.tau))
    sight = Sight(leg_of(track), 1.0, 1.4, left_m, pose, 0.11)
    (vx, vy, yaw), error = pure_pursuit(sight, MOTION)
    assert vy == 0.0 and abs(error) < math.pi / 2 and vx * math.cos(lead) > 0.0
    assert abs(vx) <= 0.11 and abs(yaw) <= MOTION.yaw_rate_limit_radps + 1e-12
    carrot = np.array([1.4, 0.0]) - (pose.x_m, pose.y_m)
    if abs(yaw) < 1e-9:
        return
    centre = vx / yaw * np.array([-math.sin(pose.yaw_rad), math.cos(pose.yaw_rad)])  # from the rover
    assert np.hypot(*(carrot - centre)) == pytest.approx(abs(vx / yaw), rel=1e-6)


def rolled(track, wheel, pose, seconds):
    """Exact motion under the rolling law from a pose on; (distance from the leg, side slip, error of heading) rows."""
    leg, place, rows = leg_of(track), 0, []
    x, y, yaw = pose
    for _ in range(round(seconds * 20)):
        place, along, left = leg.nearest(x, y, place)
        (vx, vy, rate), error = roll(Sight(leg, along, 0.0, left, Pose(x, y, yaw_rad=yaw), 0.1), wheel)
        slip = float(np.dot(constraint(*wheel), (vx, vy, rate)))
        rows.append((left, slip, error))
        middle = yaw + 0.025 * rate
        x, y = (
            x + 0.05 * (vx * math.cos(middle) - vy * math.sin(middle)),
            y + 0.05 * (vx * math.sin(middle) + vy * math.cos(middle)),
        )
        yaw += 0.05 * rate
    return np.array(rows)


@pytest.mark.parametrize(("k", "angle_deg"), list(itertools.product(range(4), (0.0, 10.0, -25.0, 60.0, 100.0))))
def test_rolled_wheel_never_slips_and_brings_base_link_to_a_straight_way_with_the_wheel_along_it(k, angle_deg):
    (a, b), angle = PLACES[k], angle_deg * DEG
    trails = a * math.cos(angle) + b * math.sin(angle) <= 0.0
    aside = math.remainder((0.0 if trails else math.pi) - angle, math.tau)  # of the body, the wheel along the way
    rows = rolled(path((0, 0, 0), (6, 0, 0)), (a, b, angle), (0.0, 0.05, aside + 0.1), 50)
    assert np.abs(rows[:, 1]).max() < 1e-12
    assert np.abs(rows[:, 0]).max() < 0.09
    assert np.abs(rows[-20:, 0]).max() < 1e-3 and np.abs(rows[-20:, 2]).max() < 0.01


@pytest.mark.parametrize("radius_m", [1.0, 1.5])
@pytest.mark.parametrize("k", [1, 2])
def test_rolled_wheel_behind_keeps_an_arc(k, radius_m):
    turn = [(radius_m * math.sin(t * DEG), radius_m * (1 - math.cos(t * DEG)), t) for t in range(0, 121, 2)]
    rows = rolled(path(*turn, spacing=10), (*PLACES[k], 0.2), (0.0, 0.0, -0.2), 15)
    assert np.abs(rows[:, 0]).max() < 0.06
    assert np.abs(rows[-40:, 0]).max() < 0.01


def test_cruise_speed_where_the_way_is_level_open_and_straight():
    assert speed_limit(Conditions(), MOTION) == MOTION.cruise_mps


@pytest.mark.parametrize(("conditions", "ratio"), [
    (Conditions(slope_rad=10 * DEG), 1.0), (Conditions(slope_rad=15 * DEG), 0.8),
    (Conditions(slope_rad=-20 * DEG), 0.6), (Conditions(slope_rad=40 * DEG), 0.6),
    (Conditions(clearance_m=0.2), 1.0), (Conditions(clearance_m=0.1), 0.8),
    (Conditions(clearance_m=0.0), 0.6), (Conditions(curvature_pm=2.0), 1.0), (Conditions(curvature_pm=-4.0), 0.5),
    (Conditions(20 * DEG, 0.0, 2.0), 0.36),
])  # fmt: skip
def test_speed_limit_by_slope_clearance_and_curvature(conditions, ratio):
    assert speed_limit(conditions, MOTION) / MOTION.cruise_mps == pytest.approx(ratio)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(st.floats(-0.6, 0.6), st.floats(0.0, 1.0), st.floats(-20.0, 20.0))
def test_no_curve_at_its_speed_limit_needs_more_than_the_largest_yaw_rate(slope, clearance, curvature):
    speed = speed_limit(Conditions(slope, clearance, curvature), MOTION)
    assert 0.0 < speed <= MOTION.cruise_mps
    assert speed * abs(curvature) <= MOTION.yaw_rate_limit_radps + 1e-12


def test_clearance_of_stations_is_read_between_them_and_unknown_is_open():
    track = path((0, 0, 0), (1, 0, 0), spacing=0.5)
    assert leg_of(track).near_m(0.3) == math.inf
    leg = leg_of(Path(track.stations, np.array([0.5, 0.1, 0.3])))
    assert [leg.near_m(s) for s in (-1.0, 0.25, 0.5, 0.75, 2.0)] == pytest.approx([0.5, 0.3, 0.1, 0.2, 0.3])
