"""Odometry: the inverse of the kinematics, against numpy's least squares and against exact motion."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.config import Motion, Rover
from onboard.motion.kinematics import wheel_commands, wheel_places
from onboard.motion.odometry import Odometry, body_twist
from onboard.motion.wheel_health import DriveHealth, WheelHealth
from onboard.records import Twist, WheelCommand, WheelMode, WheelState

ROVER, MOTION = Rover(), Motion()
PLACES = wheel_places(ROVER)
TICK = 10_000_000


def least_squares(hubs, wheels):
    rows, right = [], []
    for k in wheels:
        a, b = PLACES[k]
        rows += [[1, 0, -b], [0, 1, a]]
        right += list(hubs[k])
    found, *_ = np.linalg.lstsq(np.array(rows), np.array(right), rcond=None)
    rest = np.array(rows) @ found - right
    return found, math.sqrt(float(rest @ rest) / len(wheels))


hub = st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3))


@settings(max_examples=150, deadline=None, derandomize=True)
@given(st.tuples(hub, hub, hub, hub), st.sets(st.integers(0, 3), min_size=2))
def test_twist_and_residual_are_those_of_numpy_least_squares_for_any_two_or_more_wheels(hubs, wheels):
    twist, residual = body_twist([hubs[k] if k in wheels else None for k in range(4)], PLACES)
    expected, rest = least_squares(hubs, sorted(wheels))
    assert list(twist) == pytest.approx(list(expected), abs=1e-9)
    assert residual == pytest.approx(rest, abs=1e-9)


def test_one_wheel_alone_says_nothing():
    assert body_twist([(0.1, 0.0), None, None, None], PLACES) is None


@settings(max_examples=150, deadline=None, derandomize=True)
@given(st.builds(Twist, st.floats(-0.15, 0.15), st.floats(-0.15, 0.15), st.floats(-0.3, 0.3)))
def test_twist_to_wheels_and_back_is_the_twist(twist):
    zero = (WheelCommand(WheelMode.RUN, 0.0, 0.0),) * 4
    orders, held = wheel_commands(twist, [None] * 4, zero, ROVER, MOTION, False)
    states = [WheelState(o.steer_rad, 0.0, o.rate_radps, 2, 0) for o in orders]
    orders, _ = wheel_commands(twist, states, orders, ROVER, MOTION, held)
    hubs = [(o.rate_radps * 0.1 * math.cos(o.steer_rad), o.rate_radps * 0.1 * math.sin(o.steer_rad)) for o in orders]
    found, residual = body_twist(hubs, PLACES)
    assert list(found) == pytest.approx(list(twist), abs=4e-3 if min(map(math.hypot, *zip(*hubs))) < 1.1e-3 else 1e-9)
    assert residual < 2e-3


def states(twist, seconds, positions=(0, 0, 0, 0), age=0):
    found = []
    for (a, b), start in zip(PLACES, positions):
        u, w = twist.vx_mps - twist.yaw_radps * b, twist.vy_mps + twist.yaw_radps * a
        found.append(WheelState(math.atan2(w, u), start + math.hypot(u, w) * seconds / 0.1, 0.0, 2, age))
    return found


def drive(odometry, twist, ticks, change=lambda k, wheels: wheels):
    x = y = yaw = 0.0
    for k in range(ticks + 1):
        step = odometry.update(change(k, states(twist, k * 0.01)), k * TICK)
        mid = yaw + step.dyaw_rad / 2
        x += step.dx_m * math.cos(mid) - step.dy_m * math.sin(mid)
        y += step.dx_m * math.sin(mid) + step.dy_m * math.cos(mid)
        yaw += step.dyaw_rad
    return x, y, yaw, step


def test_exact_wheels_give_the_exact_arc():
    x, y, yaw, step = drive(Odometry(ROVER), Twist(0.11, 0.0, 0.1), 1000)
    assert (x, y, yaw) == pytest.approx((1.1 * math.sin(1.0), 1.1 * (1 - math.cos(1.0)), 1.0), abs=1e-6)
    assert list(step.twist) == pytest.approx([0.11, 0.0, 0.1], abs=1e-9)
    assert step.residual_mps < 1e-9
    assert step.wheels == 4 and not step.standing


def test_frames_a_tick_late_change_nothing_in_the_sum():
    def late(k, wheels):
        return wheels if k % 3 else states(Twist(0.05, 0.02, 0.0), max(k - 1, 0) * 0.01)

    x, y, yaw, _ = drive(Odometry(ROVER), Twist(0.05, 0.02, 0.0), 301, late)
    assert (x, y, yaw) == pytest.approx((0.1505, 0.0602, 0.0), abs=1e-9)


@pytest.mark.parametrize("lost", [0, 1, 2, 3])
def test_any_one_wheel_may_be_left_out_and_come_back_elsewhere(lost):
    def without(k, wheels):
        if 100 <= k < 200:
            wheels[lost] = None
        elif k >= 200:
            wheels[lost] = wheels[lost]._replace(position_rad=wheels[lost].position_rad + 3.0)
        return wheels

    x, y, yaw, step = drive(Odometry(ROVER), Twist(0.11, 0.0, 0.05), 300, without)
    assert yaw == pytest.approx(0.15, abs=1e-9)
    assert math.hypot(x, y) == pytest.approx(2 * 0.11 / 0.05 * math.sin(0.075), abs=1e-6)
    assert step.wheels == 4


def test_a_stale_wheel_is_left_out():
    def stale(k, wheels):
        wheels[2] = wheels[2]._replace(position_rad=0.0, age_ns=31_000_000)
        return wheels

    x, _, _, step = drive(Odometry(ROVER), Twist(0.11, 0.0, 0.0), 100, stale)
    assert x == pytest.approx(0.11)
    assert step.wheels == 3


def test_a_wheel_that_slips_by_a_fifth_shows_in_the_residual():
    def slip(k, wheels):
        wheels[0] = wheels[0]._replace(position_rad=wheels[0].position_rad * 1.2)
        return wheels

    *_, step = drive(Odometry(ROVER), Twist(0.1, 0.0, 0.0), 100, slip)
    hubs = [(0.12, 0.0), (0.1, 0.0), (0.1, 0.0), (0.1, 0.0)]
    assert step.residual_mps == pytest.approx(least_squares(hubs, range(4))[1], rel=1e-6)
    assert step.residual_mps > 0.005


def test_wheels_that_stand_are_standing_with_nothing_moved():
    *moved, step = drive(Odometry(ROVER), Twist(), 50)
    assert moved == [0.0, 0.0, 0.0]
    assert step.standing


def test_wheels_that_steer_on_the_spot_are_not_standing():
    def steer(k, wheels):
        return [wheel._replace(steer_rad=0.001 * k) for wheel in wheels]

    *moved, step = drive(Odometry(ROVER), Twist(), 50, steer)
    assert moved == [0.0, 0.0, 0.0]
    assert not step.standing


TURN = math.hypot(0.375, 0.23)


@pytest.mark.parametrize(("hubs", "twist"), [
    ([(0.1, 0.0)] * 4, (0.1, 0.0, 0.0)),
    ([(0.0, 0.1)] * 4, (0.0, 0.1, 0.0)),
    ([(-0.2 * b, 0.2 * a) for a, b in PLACES], (0.0, 0.0, 0.2)),
    ([(0.11 - 0.1 * b, 0.1 * a) for a, b in PLACES], (0.11, 0.0, 0.1)),
    ([(0.1, 0.0), (0.1, 0.0), (0.14, 0.0), (0.14, 0.0)], (0.12, 0.0, 0.04 * 0.23 / (2 * TURN**2))),
])  # fmt: skip
def test_closed_forms_of_straight_crab_point_turn_arc_and_of_two_sides_that_disagree(hubs, twist):
    # The last: m = 4 d * 0.02, Q = 4 (l^2 + d^2), so omega = 0.02 d / (l^2 + d^2).
    assert list(body_twist(hubs, PLACES)[0]) == pytest.approx(list(twist), abs=1e-12)


@pytest.mark.parametrize("used", [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3), (0, 1, 2), (0, 1, 2, 3)])
def test_any_two_wheels_have_the_rank_for_three_unknowns_and_one_has_not(used):
    rows = np.array([row for k in used for row in ([1, 0, -PLACES[k][1]], [0, 1, PLACES[k][0]])])
    assert np.linalg.matrix_rank(rows) == 3
    assert np.linalg.matrix_rank(rows[:2]) == 2


UNFIT = {
    "its encoder lies": (WheelHealth(encoder=False), lambda w: w._replace(position_rad=7.7 * w.position_rad)),
    "its drive is stuck": (WheelHealth(drive=DriveHealth.STUCK), lambda w: w._replace(position_rad=0.0)),
    "its steering is fixed": (WheelHealth(steer_fixed_rad=1.0), lambda w: w._replace(steer_rad=1.0)),
}


@pytest.mark.parametrize("what", UNFIT)
@pytest.mark.parametrize("unfit", [0, 1, 2, 3])
def test_an_unfit_wheel_is_left_out_and_the_others_tell_the_exact_arc(what, unfit):
    health, spoil = UNFIT[what]
    wheels = tuple(health if k == unfit else WheelHealth() for k in range(4))
    odometry, yaw, x = Odometry(ROVER), 0.0, 0.0
    for k in range(201):
        told = [spoil(w) if n == unfit else w for n, w in enumerate(states(Twist(0.11, 0.0, 0.1), k * 0.01))]
        step = odometry.update(told, k * TICK, wheels)
        x += step.dx_m * math.cos(yaw + step.dyaw_rad / 2) - step.dy_m * math.sin(yaw + step.dyaw_rad / 2)
        yaw += step.dyaw_rad
    assert (x, yaw) == pytest.approx((1.1 * math.sin(0.2), 0.2), abs=1e-6)
    assert step.residual_mps < 1e-9 and step.wheels == 3


def test_with_three_unfit_wheels_odometry_says_that_it_knows_nothing():
    wheels = (WheelHealth(), *(WheelHealth(encoder=False),) * 3)
    odometry = Odometry(ROVER)
    steps = [odometry.update(states(Twist(0.11, 0.0, 0.0), k * 0.01), k * TICK, wheels) for k in range(50)]
    assert {(s.dx_m, s.dy_m, s.dyaw_rad, s.wheels) for s in steps[1:]} == {(0.0, 0.0, 0.0, 1)}
