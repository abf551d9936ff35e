"""The ground without physics: how the rover stands on it and what touches it, by hand."""

import math

import numpy as np
import pytest

from onboard.config import Rover
from tests.missions.world.small import world
from tests.missions.world.world import CLEAR, HARD, SOFT

ROVER = Rover()


@pytest.mark.parametrize("yaw_deg", [0, 37, 180, -110])
def test_on_a_tilted_plane_the_rover_has_the_planes_attitude(yaw_deg):
    yaw, slope_x, slope_y = math.radians(yaw_deg), 0.12, -0.07
    tilted = world(height_m=lambda x, y: slope_x * x + slope_y * y)
    pose = tilted.stand(0.3, -0.4, yaw, ROVER)
    along = slope_x * math.cos(yaw) + slope_y * math.sin(yaw)
    left = slope_y * math.cos(yaw) - slope_x * math.sin(yaw)
    assert pose.z_m == pytest.approx(0.3 * slope_x - 0.4 * slope_y, abs=1e-6)
    assert math.tan(-pose.pitch_rad) == pytest.approx(along, abs=1e-5)  # nose up is negative
    assert math.tan(pose.roll_rad) == pytest.approx(left, abs=1e-5)
    assert tilted.contact(pose, ROVER) == CLEAR


@pytest.mark.parametrize(("high_m", "expected"), [(0.11, CLEAR), (0.13, SOFT), (0.16, HARD)])
def test_a_stone_under_the_belly_touches_by_its_height_over_the_wheel_plane(high_m, expected):
    stone = world(height_m=lambda x, y: np.where(np.hypot(x, y) < 0.1, high_m, 0.0))
    assert stone.contact(stone.stand(0.0, 0.0, 0.0, ROVER), ROVER) == expected


@pytest.mark.parametrize(("high_m", "expected"), [(0.09, CLEAR), (0.11, SOFT), (0.14, HARD)])
def test_a_step_under_the_front_wheels_counts_by_its_height(high_m, expected):
    """The front wheels stand half on a board along y: the body's pitch takes the wheel's share of the slope out."""
    edge = ROVER.half_wheelbase_m
    board = world(height_m=lambda x, y: np.where((x > edge) & (x < edge + 0.2), high_m, 0.0))
    assert board.contact(board.stand(0.0, 0.0, 0.0, ROVER), ROVER) == expected


@pytest.mark.parametrize(("tilt_deg", "expected"), [(26.5, CLEAR), (28, SOFT), (31, HARD)])
def test_tilt_alone_is_a_contact(tilt_deg, expected):
    slope = math.tan(math.radians(tilt_deg))
    for height in (lambda x, y: slope * x, lambda x, y: slope * y):
        steep = world(height_m=height)
        assert steep.contact(steep.stand(0.0, 0.0, 0.0, ROVER), ROVER) == expected


def test_a_hole_under_a_wheel_is_hard_and_beside_it_nothing():
    pitted = world().sunk(np.array([(ROVER.half_wheelbase_m + 0.08, ROVER.half_track_m, 0.12, 0.2)]))
    assert pitted.contact(pitted.stand(0.0, 0.0, 0.0, ROVER), ROVER) == HARD
    assert pitted.contact(pitted.stand(-0.5, 0.0, 0.0, ROVER), ROVER) == CLEAR


@pytest.mark.parametrize(("up_m", "expected"), [(0.14, HARD), (-0.14, CLEAR)])
def test_under_a_wheels_rim_a_rise_is_met_and_a_fall_is_not(up_m, expected):
    edge = ROVER.half_wheelbase_m + 0.075
    ahead = world(height_m=lambda x, y: np.where((x > edge) & (x < edge + 0.3), up_m, 0.0))
    assert ahead.contact(ahead.stand(0.0, 0.0, 0.0, ROVER), ROVER) == expected
