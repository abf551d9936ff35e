"""Four-wheel steering: the geometry of section 6, by hand-worked numbers and by rigid-body motion."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.config import Motion, Rover
from onboard.motion.kinematics import nearest_steering, stopped, wheel_angles, wheel_commands
from onboard.records import Twist, WheelCommand, WheelMode, WheelState

ROVER, MOTION = Rover(), Motion()
ZERO = (WheelCommand(WheelMode.HOLD, 0.0, 0.0),) * 4
PLACES = ((0.375, 0.23), (-0.375, 0.23), (-0.375, -0.23), (0.375, -0.23))
DEG = math.pi / 180


def at(*angles):
    return [WheelState(angle, 0.0, 0.0, 2, 0) for angle in angles]


def settled(twist, rover=ROVER, start=(0.0, 0.0, 0.0, 0.0)):
    """Orders once the steering has arrived."""
    orders, held = wheel_commands(twist, at(*start), ZERO, rover, MOTION, False)
    return wheel_commands(twist, at(*(o.steer_rad for o in orders)), orders, rover, MOTION, held)[0]


def test_front_left_steers_plus_23_8_degrees_where_eq_34_as_printed_says_minus_15_5():
    # section 8: v 0.11, omega 0.1, l 0.375, d 0.25: atan2(0.0375, 0.085); the chapter's sign is the other turn's.
    rover = Rover(half_wheelbase_m=0.375, half_track_m=0.25)
    orders = settled(Twist(0.11, 0.0, 0.1), rover)
    assert math.degrees(orders[0].steer_rad) == pytest.approx(23.8, abs=0.05)
    printed = math.degrees(math.atan2(-0.1 * 0.375, 0.11 + 0.1 * 0.25))
    assert printed == pytest.approx(-15.5, abs=0.05)


def test_point_turn_steers_58_5_degrees_and_all_hubs_run_alike():
    orders = settled(Twist(0.0, 0.0, 0.2))
    assert [round(math.degrees(o.steer_rad), 1) for o in orders] == [-58.5, 58.5, -58.5, 58.5]
    speed = 0.2 * math.hypot(0.375, 0.23) / 0.1
    assert [o.rate_radps for o in orders] == pytest.approx([-speed, -speed, speed, speed])


def test_crab_at_90_degrees_is_within_the_range():
    orders = settled(Twist(0.0, 0.1, 0.0))
    assert [abs(o.steer_rad) for o in orders] == pytest.approx([math.pi / 2] * 4)
    assert all(o.rate_radps * math.sin(o.steer_rad) == pytest.approx(1.0) for o in orders)


def test_reverse_keeps_the_wheels_straight_and_turns_the_rates():
    orders = settled(Twist(-0.11, 0.0, 0.0))
    assert [o.steer_rad for o in orders] == [0.0] * 4
    assert [o.rate_radps for o in orders] == pytest.approx([-1.1] * 4)


twists = st.builds(Twist, st.floats(-0.2, 0.2), st.floats(-0.2, 0.2), st.floats(-0.4, 0.4))
angles = st.floats(-1.8, 1.8)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(twists, st.tuples(angles, angles, angles, angles))
def test_every_hub_moves_as_the_rigid_body_does_and_stays_in_range(twist, start):
    orders = settled(twist, start=start)
    rigid = [(twist.vx_mps - twist.yaw_radps * b, twist.vy_mps + twist.yaw_radps * a) for a, b in PLACES]
    share = min(1.0, 0.4 / max(0.1, *(math.hypot(*hub) for hub in rigid)))  # too fast a twist is slowed
    for (u, w), order in zip(rigid, orders):
        if math.hypot(u, w) < 0.001:
            continue
        assert abs(order.steer_rad) <= ROVER.steer_limit_rad
        speed = order.rate_radps * 0.1
        assert speed * math.cos(order.steer_rad) == pytest.approx(u * share, abs=1e-9)
        assert speed * math.sin(order.steer_rad) == pytest.approx(w * share, abs=1e-9)


def hubs(orders):
    """Velocities of the hubs as the orders have them, (x, y) each."""
    return [(0.1 * o.rate_radps * math.cos(o.steer_rad), 0.1 * o.rate_radps * math.sin(o.steer_rad)) for o in orders]


moving = twists.filter(lambda t: min(math.hypot(t[0] - t[2] * b, t[1] + t[2] * a) for a, b in PLACES) > 0.002)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(moving, st.tuples(angles, angles, angles, angles))
def test_axles_of_all_wheels_meet_in_the_one_turning_centre(twist, start):
    vx, vy, yaw = twist
    for (a, b), order in zip(PLACES, settled(twist, start=start)):
        along = math.cos(order.steer_rad), math.sin(order.steer_rad)
        # (centre - hub) . along = 0, times omega: the centre of a straight way lies at infinity
        across = (-vy - yaw * a) * along[0] + (vx - yaw * b) * along[1]
        assert across == pytest.approx(0.0, abs=1e-12)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(moving)
def test_a_mirrored_twist_mirrors_the_wheels_and_a_rover_turned_round_swaps_its_ends(twist):
    vx, vy, yaw = twist
    here = hubs(settled(twist))
    mirrored, turned = hubs(settled(Twist(vx, -vy, -yaw))), hubs(settled(Twist(-vx, -vy, yaw)))
    for k, (u, w) in enumerate(here):
        assert mirrored[(3, 2, 1, 0)[k]] == pytest.approx((u, -w), abs=1e-12)
        assert turned[(2, 3, 0, 1)[k]] == pytest.approx((-u, -w), abs=1e-12)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(moving, st.floats(-math.pi, math.pi))
def test_wheels_know_no_heading_the_same_motion_turned_in_the_map_turns_each_hub_with_it(twist, heading):
    # Rotation invariance: hub velocities in the map from the body's, and by the rigid body's law in the map itself.
    c, s = math.cos(heading), math.sin(heading)
    vx, vy = c * twist.vx_mps - s * twist.vy_mps, s * twist.vx_mps + c * twist.vy_mps
    for (a, b), (u, w) in zip(PLACES, hubs(settled(twist))):
        x, y = c * a - s * b, s * a + c * b
        assert (c * u - s * w, s * u + c * w) == pytest.approx((vx - twist.yaw_radps * y, vy + twist.yaw_radps * x))


@settings(max_examples=150, deadline=None, derandomize=True)
@given(moving, st.floats(1.0, 100.0))
def test_however_fast_a_twist_is_wanted_its_turning_centre_stays_and_no_wheel_passes_its_limit(twist, factor):
    wanted = Twist(*(factor * part for part in twist))
    orders, slow = settled(wanted), settled(twist)
    assert [o.steer_rad for o in orders] == pytest.approx([o.steer_rad for o in slow])
    fastest = max(abs(o.rate_radps) for o in orders)
    assert fastest == pytest.approx(min(ROVER.wheel_rate_limit_radps, factor * max(abs(o.rate_radps) for o in slow)))
    share = fastest / max(abs(o.rate_radps) for o in slow)
    assert [o.rate_radps for o in orders] == pytest.approx([share * o.rate_radps for o in slow])


@settings(max_examples=150, deadline=None, derandomize=True)
@given(st.floats(-math.pi, math.pi), angles)
def test_the_nearest_of_the_two_angles_in_range_is_taken(direction, measured):
    angle, sign = nearest_steering(direction, measured, ROVER.steer_limit_rad)
    assert math.cos(direction) == pytest.approx(sign * math.cos(angle), abs=1e-9)
    assert math.sin(direction) == pytest.approx(sign * math.sin(angle), abs=1e-9)
    for k in (-2, -1, 0, 1, 2):
        other = direction + k * math.pi
        if abs(other) < ROVER.steer_limit_rad:
            assert abs(angle - measured) <= abs(other - measured) + 1e-12


def test_a_short_steering_range_cuts_the_angle_instead_of_leaving_it():
    angle, sign = nearest_steering(1.5, 0.0, 1.0)
    assert (angle, sign) == (1.0, 1)
    angle, sign = nearest_steering(1.7, 0.0, 1.0)
    assert (angle, sign) == (-1.0, -1)


def test_too_fast_a_twist_is_slowed_by_one_factor_so_the_turning_centre_stays():
    orders = settled(Twist(0.6, 0.0, 0.5))
    assert max(abs(o.rate_radps) for o in orders) == pytest.approx(4.0)
    slow = settled(Twist(0.06, 0.0, 0.05))
    ratios = [f.rate_radps / s.rate_radps for f, s in zip(orders, slow)]
    assert ratios == pytest.approx([ratios[0]] * 4)
    assert [f.steer_rad for f in orders] == pytest.approx([s.steer_rad for s in slow])


def test_a_wheel_below_1_mm_per_s_keeps_its_last_angle():
    previous = tuple(WheelCommand(WheelMode.RUN, 0.3, 0.0) for _ in range(4))
    orders, _ = wheel_commands(Twist(0.0, 0.0009, 0.0), at(0.3, 0.3, 0.3, 0.3), previous, ROVER, MOTION, False)
    assert [o.steer_rad for o in orders] == [0.3] * 4
    assert wheel_angles(Twist(0.0, 0.0009, 0.0), ROVER) == (None,) * 4
    orders, _ = wheel_commands(Twist(), at(0.3, 0.3, 0.3, 0.3), previous, ROVER, MOTION, False)
    assert [o.rate_radps for o in orders] == [0.0] * 4


@pytest.mark.parametrize(
    ("error_deg", "held_before", "held_after"),
    [
        (14.9, False, False),
        (15.1, False, True),
        (14.9, True, True),
        (5.1, True, True),
        (4.9, True, False),
        (4.9, False, False),
    ],
)
def test_drive_is_held_above_15_degrees_and_released_below_5(error_deg, held_before, held_after):
    measured = at(0.0, 0.0, error_deg * DEG, 0.0)
    orders, held = wheel_commands(Twist(0.11, 0.0, 0.0), measured, ZERO, ROVER, MOTION, held_before)
    assert held is held_after
    expected = 0.0 if held else 1.1 * math.cos(error_deg * DEG)
    assert [o.rate_radps for o in orders] == pytest.approx([expected] * 4)
    assert [o.steer_rad for o in orders] == [0.0] * 4


def test_an_unknown_wheel_is_taken_to_stand_where_it_was_ordered():
    previous = tuple(WheelCommand(WheelMode.RUN, 1.5, 0.0) for _ in range(4))
    orders, held = wheel_commands(Twist(0.0, 0.1, 0.0), [None] * 4, previous, ROVER, MOTION, False)
    assert not held
    assert [o.steer_rad for o in orders] == pytest.approx([math.pi / 2] * 4)


def test_a_wheel_at_1_mm_per_s_steers():
    orders, _ = wheel_commands(Twist(0.0, 0.001, 0.0), at(1.5, 1.5, 1.5, 1.5), ZERO, ROVER, MOTION, False)
    assert [o.steer_rad for o in orders] == [math.pi / 2] * 4
    assert wheel_angles(Twist(0.0, 0.001, 0.0), ROVER) == (math.pi / 2,) * 4


def test_a_wheel_below_1_mm_per_s_turns_as_its_hub_moves_along_it():
    previous = tuple(WheelCommand(WheelMode.RUN, 0.3, 0.0) for _ in range(4))
    orders, _ = wheel_commands(Twist(0.0, 0.0009, 0.0), at(0.3, 0.3, 0.3, 0.3), previous, ROVER, MOTION, False)
    assert [o.rate_radps for o in orders] == pytest.approx([0.0009 * math.sin(0.3) / ROVER.wheel_radius_m] * 4)


@pytest.mark.parametrize("held_before", [False, True])
def test_at_the_limit_itself_the_drive_is_not_held(held_before):
    limit_rad = MOTION.steer_release_rad if held_before else MOTION.steer_hold_rad
    assert not wheel_commands(Twist(0.11, 0.0, 0.0), at(limit_rad, 0, 0, 0), ZERO, ROVER, MOTION, held_before)[1]


def test_an_angle_at_the_end_of_the_range_is_in_it():
    assert nearest_steering(2.0, 2.0, 2.0) == (2.0, 1)
    assert nearest_steering(2.0 - math.pi, 2.0, 2.0) == (2.0, -1)


@pytest.mark.parametrize("limit_rad", [1.0, 2.0])
def test_of_two_angles_that_are_as_near_the_one_that_rolls_forwards_is_taken(limit_rad):
    assert nearest_steering(math.pi / 2, 0.0, limit_rad) == (min(math.pi / 2, limit_rad), 1)
    assert nearest_steering(-math.pi / 2, 0.0, limit_rad) == (-min(math.pi / 2, limit_rad), 1)


def test_with_a_full_range_a_wheel_that_stands_backwards_rolls_backwards():
    assert nearest_steering(0.0, 3.0, math.pi) == (math.pi, -1)


def test_stopped_holds_with_the_angles_kept():
    orders = stopped(settled(Twist(0.0, 0.0, 0.2)))
    assert {(o.mode, o.rate_radps) for o in orders} == {(WheelMode.HOLD, 0.0)}
    assert [round(math.degrees(o.steer_rad), 1) for o in orders] == [-58.5, 58.5, -58.5, 58.5]
