"""A steering that is fixed, a drive that is free or stuck: the twists that are left, and the force that they take."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.config import Motion, Rover
from onboard.motion.degraded import constraint, fixed_wheel, load_ratio, rolling, speed_ratio
from onboard.motion.kinematics import wheel_angles, wheel_commands, wheel_places
from onboard.motion.wheel_health import SOUND, DriveHealth, WheelHealth
from onboard.records import Twist, WheelCommand, WheelMode, WheelState

ROVER, MOTION = Rover(), Motion()
PLACES = wheel_places(ROVER)
DEG = math.pi / 180
STANDING = (WheelCommand(WheelMode.HOLD, 0.0, 0.0),) * 4
twists = st.builds(Twist, st.floats(-0.2, 0.2), st.floats(-0.2, 0.2), st.floats(-0.4, 0.4))
angles = st.floats(-105 * DEG, 105 * DEG)
numbers = st.integers(0, 3)


def with_fixed(*fixed):
    wheels = list(SOUND)
    for k, angle in fixed:
        wheels[k] = WheelHealth(steer_fixed_rad=angle)
    return tuple(wheels)


def side_slip(twist, k, angle):
    """Oracle: speed of hub k across its rim."""
    a, b = PLACES[k]
    u, w = twist.vx_mps - twist.yaw_radps * b, twist.vy_mps + twist.yaw_radps * a
    return -u * math.sin(angle) + w * math.cos(angle)


def hub_changes(first, second):
    """Oracle: sum of squares of the hubs' changes of velocity."""
    vx, vy, yaw = (p - q for p, q in zip(first, second))
    return sum((vx - yaw * b) ** 2 + (vy + yaw * a) ** 2 for a, b in PLACES)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(twists)
def test_sound_wheels_roll_with_every_twist(twist):
    assert rolling(twist, SOUND, ROVER) is twist


@settings(max_examples=200, deadline=None, derandomize=True)
@given(twists, numbers, angles)
def test_rolling_twist_has_no_side_slip_at_the_fixed_wheel_and_stays_itself(twist, k, angle):
    wheels = with_fixed((k, angle))
    rolled = rolling(twist, wheels, ROVER)
    assert side_slip(rolled, k, angle) == pytest.approx(0.0, abs=1e-12)
    assert list(rolling(rolled, wheels, ROVER)) == pytest.approx(list(rolled), abs=1e-12)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(twists, numbers, angles, twists)
def test_no_other_rolling_twist_is_closer(twist, k, angle, other):
    wheels = with_fixed((k, angle))
    best, other = rolling(twist, wheels, ROVER), rolling(other, wheels, ROVER)
    assert hub_changes(twist, best) <= hub_changes(twist, other) + 1e-12


@settings(max_examples=200, deadline=None, derandomize=True)
@given(twists, numbers, angles)
def test_turning_centre_lies_on_the_line_of_the_fixed_wheels_axle(twist, k, angle):
    vx, vy, yaw = rolling(twist, with_fixed((k, angle)), ROVER)
    if abs(yaw) < 1e-3:
        return
    a, b = PLACES[k]
    x, y = -vy / yaw - a, vx / yaw - b  # the centre from the hub
    assert x * math.cos(angle) + y * math.sin(angle) == pytest.approx(0.0, abs=1e-9 / abs(yaw))


@settings(max_examples=100, deadline=None, derandomize=True)
@given(twists, numbers, numbers, angles, angles)
def test_two_fixed_wheels_leave_the_turning_centre_where_their_axles_meet(twist, j, k, first, second):
    if j == k:
        return
    rolled = rolling(twist, with_fixed((j, first), (k, second)), ROVER)
    for wheel, angle in ((j, first), (k, second)):
        assert side_slip(rolled, wheel, angle) == pytest.approx(0.0, abs=1e-7)


def test_three_axles_that_do_not_meet_leave_standing_and_three_in_one_turn_leave_that_turn():
    wheels = with_fixed((0, 0.3), (1, 0.3), (2, -0.6))
    assert list(rolling(Twist(0.1, 0.05, 0.2), wheels, ROVER)) == pytest.approx([0.0] * 3, abs=1e-12)
    arc = Twist(0.1, 0.02, 0.15)
    wheels = with_fixed(*itertools.islice(enumerate(wheel_angles(arc, ROVER)), 3))
    assert list(rolling(arc, wheels, ROVER)) == pytest.approx(list(arc), abs=1e-12)


def test_straight_wheel_1_turns_about_its_own_axle_line():
    # n = (0, 1, 0.375): a point turn of 0.2 rad/s becomes the closest twist with v_y = -0.375 omega.
    vx, vy, yaw = rolling(Twist(0.0, 0.0, 0.2), with_fixed((0, 0.0)), ROVER)
    assert constraint(*PLACES[0], 0.0) == (-0.0, 1.0, 0.375)
    share = 0.2 * 0.375 / (1 + 0.375**2 / (0.375**2 + 0.23**2))
    assert (vx, vy) == pytest.approx((0.0, -share))
    assert yaw == pytest.approx(share / 0.375)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(twists, numbers, st.floats(-80 * DEG, 80 * DEG))
def test_orders_of_a_rolling_twist_move_every_hub_as_the_rigid_body_does(twist, k, fixed):
    wheels = with_fixed((k, fixed))
    vx, vy, yaw = twist = rolling(twist, wheels, ROVER)
    orders = STANDING
    for _ in range(2):  # the second with the steering arrived
        measured = [WheelState(order.steer_rad, 0.0, 0.0, 2, 0) for order in orders]
        orders, _held = wheel_commands(twist, measured, orders, ROVER, MOTION, False, wheels)
    assert orders[k].steer_rad == fixed
    for (a, b), order in zip(PLACES, orders):
        u, w = vx - yaw * b, vy + yaw * a
        if math.hypot(u, w) > 0.001:
            speed, angle = order.rate_radps * ROVER.wheel_radius_m, order.steer_rad
            assert (speed * math.cos(angle), speed * math.sin(angle)) == pytest.approx((u, w), abs=1e-9)


def test_a_fixed_wheel_is_not_waited_for_and_turns_with_its_hub():
    wheels = with_fixed((2, 60 * DEG))
    measured = [WheelState(a, 0.0, 0.0, 2, 0) for a in (0.0, 0.0, 61 * DEG, 0.0)]
    orders, held = wheel_commands(Twist(0.1, 0.0, 0.0), measured, STANDING, ROVER, MOTION, False, wheels)
    assert not held
    assert [o.rate_radps for o in orders] == pytest.approx([1.0, 1.0, 0.5, 1.0])
    assert orders[2].steer_rad == 60 * DEG


def test_a_stuck_drive_is_ordered_to_stand_and_a_free_one_rolls_along():
    wheels = (WheelHealth(drive=DriveHealth.STUCK), WheelHealth(drive=DriveHealth.FREE), *SOUND[2:])
    measured = [WheelState(0.0, 0.0, 0.0, 2, 0)] * 4
    orders, _ = wheel_commands(Twist(0.1, 0.0, 0.0), measured, STANDING, ROVER, MOTION, False, wheels)
    assert [o.rate_radps for o in orders] == pytest.approx([0.0, 1.0, 1.0, 1.0])


AHEAD = Twist(0.1, 0.0, 0.0)
STUCK = (WheelHealth(drive=DriveHealth.STUCK), *SOUND[1:])
FREE = (WheelHealth(drive=DriveHealth.FREE), *SOUND[1:])


@pytest.mark.parametrize(("wheels", "slope_deg", "ratio"), [
    (SOUND, 0, 0.0), (FREE, 0, 0.0), (STUCK, 0, 1 / 3),
    (SOUND, 10, math.tan(10 * DEG) / 0.7), (STUCK, 10, (1 + 4 * math.tan(10 * DEG) / 0.7) / 3),
    (with_fixed((0, 90 * DEG)), 0, 1 / 3), (with_fixed((0, 30 * DEG)), 0, 0.5 / (3 + math.sqrt(0.75))),
    ((STUCK[0],) * 3 + SOUND[3:], 0, 3.0), ((STUCK[0],) * 4, 0, math.inf),
])  # fmt: skip
def test_load_ratio_is_the_resistance_of_what_is_dragged_over_the_push_of_the_rest(wheels, slope_deg, ratio):
    assert load_ratio(AHEAD, wheels, ROVER, slope_deg * DEG) == pytest.approx(ratio)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(twists, numbers, angles)
def test_what_rolls_needs_no_force_on_the_level(twist, k, angle):
    wheels = with_fixed((k, angle))
    rolled = rolling(twist, wheels, ROVER)
    if min(math.hypot(rolled[0] - rolled[2] * b, rolled[1] + rolled[2] * a) for a, b in PLACES) > 1e-3:
        assert load_ratio(rolled, wheels, ROVER, 0.0) == pytest.approx(0.0, abs=1e-9)


def test_only_a_stuck_drive_slows_the_rover_and_only_one_fixed_wheel_can_be_rolled():
    assert [speed_ratio(w) for w in (SOUND, FREE, STUCK, with_fixed((1, 0.2)))] == [1.0, 1.0, 0.7, 1.0]
    assert fixed_wheel(SOUND, ROVER) is None
    assert fixed_wheel(with_fixed((1, 0.2)), ROVER) == (*PLACES[1], 0.2)
    assert fixed_wheel(with_fixed((1, 0.2), (2, 0.2)), ROVER) is None


def test_a_wheel_tells_its_way_only_while_it_rolls_where_it_looks():
    assert WheelHealth().tells_way and WheelHealth(drive=DriveHealth.FREE).tells_way
    for bad in ({"encoder": False}, {"drive": DriveHealth.STUCK}, {"steer_fixed_rad": 0.1}):
        assert not replace(WheelHealth(), **bad).tells_way


@settings(max_examples=100, deadline=None, derandomize=True)
@given(twists, numbers, angles)
def test_rolling_commutes_with_mirroring_left_and_right(twist, k, angle):
    mirrored = Twist(twist.vx_mps, -twist.vy_mps, -twist.yaw_radps)
    here = rolling(twist, with_fixed((k, angle)), ROVER)
    there = rolling(mirrored, with_fixed(((3, 2, 1, 0)[k], -angle)), ROVER)
    assert np.array(there) == pytest.approx(np.array([here[0], -here[1], -here[2]]), abs=1e-12)
