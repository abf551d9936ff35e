"""Eq. 29 to 40 as printed, against the rigid body. (The carrot's damping, Fig. 11b, is in test_follower.)"""

import math

import pytest

from docs.as_printed.motion import BodyMotion, Vehicle, eq_29, eq_34, eq_35, eq_37, eq_38_40
from onboard.config import Rover
from onboard.motion.kinematics import wheel_angles
from onboard.records import Twist

VEHICLE = Vehicle()
ROVER = Rover(half_wheelbase_m=VEHICLE.l_m, half_track_m=VEHICLE.d_m)
STRAIGHT_AHEAD, WEST, SOUTH = 0.0, math.pi, -math.pi / 2


def degrees(angles):
    return [round(math.degrees(angle), 1) for angle in angles]


def printed(v_mps, rate_radps, theta_rad=STRAIGHT_AHEAD):
    return [eq_34(wheel, BodyMotion(v_mps, theta_rad, rate_radps), VEHICLE) for wheel in range(4)]


def test_eq_29_forbids_the_sideways_motion_that_four_steered_wheels_do():
    crab = Twist(0.0, 0.11, 0.0)
    assert eq_29(crab.vx_mps, crab.vy_mps, STRAIGHT_AHEAD) == pytest.approx(-0.11)
    assert [eq_29(crab.vx_mps, crab.vy_mps, angle) for angle in wheel_angles(crab, ROVER)] == pytest.approx([0.0] * 4)


def test_eq_34_steers_minus_15_5_degrees_instead_of_plus_23_8_which_is_the_other_turn():
    assert degrees(printed(0.11, 0.1)) == [-15.5, 15.5, 23.8, -23.8]
    assert degrees(wheel_angles(Twist(0.11, 0.0, 0.1), ROVER)) == [23.8, -23.8, -15.5, 15.5]
    assert printed(0.11, 0.1) == pytest.approx(wheel_angles(Twist(0.11, 0.0, -0.1), ROVER))


def test_eq_34_loses_the_quadrant_and_drives_west_with_wheels_turned_round():
    assert degrees(printed(0.11, 0.0, WEST)) == [-180.0] * 4
    assert degrees(printed(0.11, 0.0, math.radians(120))) == [-180.0] * 4
    assert degrees(wheel_angles(Twist(0.11, 0.0, 0.0), ROVER)) == [0.0] * 4  # in body axes, whatever the heading


def test_eq_35_and_37_drive_the_inner_wheels_at_0_035_instead_of_0_118_metres_a_second():
    steer = wheel_angles(Twist(0.11, 0.0, 0.3), ROVER)[0]
    hub = math.hypot(0.11 - 0.3 * VEHICLE.d_m, 0.3 * VEHICLE.l_m)
    assert hub == pytest.approx(0.118, abs=0.0005)
    rim = eq_37(0, BodyMotion(0.11, STRAIGHT_AHEAD, 0.3), steer, VEHICLE) * VEHICLE.r_m
    assert rim == pytest.approx(0.035, abs=1e-9)
    assert eq_35(hub, steer, VEHICLE) * VEHICLE.r_m == pytest.approx(rim, abs=1e-9)  # the cosine too many


def test_eq_37_divides_by_zero_when_the_rover_heads_south():
    rate = eq_37(0, BodyMotion(0.11, SOUTH, 0.1), 0.0, VEHICLE)  # cos(-90 degrees), which a computer rounds to 6e-17
    assert abs(rate) > 1e15
    assert abs(eq_37(0, BodyMotion(0.11, STRAIGHT_AHEAD, 0.1), 0.0, VEHICLE)) < 1.0  # the same motion, heading east
    with pytest.raises(ZeroDivisionError):
        eq_37(0, BodyMotion(0.11, math.pi / 2, 0.0), -math.pi / 2, VEHICLE)


def test_eq_37s_other_form_drives_too_slowly_by_the_same_cosine_and_divides_by_zero_heading_west():
    north, steer = math.pi / 2, wheel_angles(Twist(0.11, 0.0, 0.3), ROVER)[0]
    assert eq_37(0, BodyMotion(0.11, north, 0.3), steer, VEHICLE) * VEHICLE.r_m == pytest.approx(0.035, abs=1e-9)
    with pytest.raises(ZeroDivisionError):
        eq_37(0, BodyMotion(0.11, WEST, 0.1), -WEST, VEHICLE)
    assert abs(eq_37(0, BodyMotion(0.11, WEST, 0.1), 0.0, VEHICLE)) > 1e14  # straight wheels; sin(180 degrees) is 1e-16


def test_eq_37s_two_forms_jump_at_45_degrees_with_the_angles_of_eq_34():
    def rates(steer):
        return [eq_37(0, BodyMotion(0.11, math.pi / 4 + step, 0.1), steer, VEHICLE) for step in (0.0, 1e-9)]

    right = wheel_angles(Twist(0.11, 0.0, 0.1), ROVER)[0]
    assert rates(right)[1] == pytest.approx(rates(right)[0], rel=1e-6)
    below, above = rates(eq_34(0, BodyMotion(0.11, math.pi / 4, 0.1), VEHICLE))
    assert above / below > 4.0


def test_eq_40_turns_a_rover_that_already_heads_for_the_carrot():
    straight_wheels, carrot = 0.0, math.pi / 2  # the rover heads north, the carrot is north
    assert eq_38_40(0.8, carrot, straight_wheels) == pytest.approx(0.8 * math.pi / 2)
    assert eq_38_40(0.8, carrot, math.pi / 2) == 0.0  # content once its wheels stand across


def test_a_rover_steered_by_eq_40_circles_and_never_comes_near_a_carrot_dead_ahead():
    x, y, theta, nearest = 0.0, 0.0, math.pi / 2, 2.0
    steer = 0.0
    for _ in range(2400):  # two minutes at 20 Hz, 0.11 m/s: 13 m of way to a carrot 2 m ahead
        rate = max(-0.25, min(0.25, eq_38_40(0.8, math.atan2(2.0 - y, -x), steer)))
        steer = wheel_angles(Twist(0.11, 0.0, rate), ROVER)[0]
        theta += rate * 0.05
        x, y = x + 0.11 * math.cos(theta) * 0.05, y + 0.11 * math.sin(theta) * 0.05
        nearest = min(nearest, math.hypot(x, 2.0 - y))
    assert nearest > 1.0
