"""Tyres on rocks without physics: true width and radius, the plant's limit, headings between the orientations."""

import math
from dataclasses import replace

import numpy as np
import pytest

from hil.terrain.rocks import rock_of
from onboard.config import Rover
from onboard.records import Pose
from tests.missions.mission import Errors, Kinematic
from tests.missions.world.drift import FLOWN_DRIFT, NO_DRIFT
from tests.missions.world.scanner import scanner
from tests.missions.world.small import quick, world
from tests.missions.world.touch import between, touches

ROVER = Rover()


def with_rock(x_m, y_m, height_m=0.12, width_m=0.1):
    return replace(world(), rocks=(rock_of(x_m, y_m, 0.0, width_m, height_m, np.random.default_rng(1)),))


@pytest.mark.parametrize(("height_m", "found"), [(0.12, [(0, 1)]), (0.081, [(0, 1)]), (0.079, [])])
def test_a_wheel_on_a_rock_counts_from_the_plants_limit_on(height_m, found):
    ground = with_rock(ROVER.half_wheelbase_m, ROVER.half_track_m, height_m)
    assert list(touches(ground, Pose(0.0, 0.0), ROVER)) == found


@pytest.mark.parametrize(("beside_m", "touched"), [(0.08, True), (0.105, False)])
def test_a_rock_beside_a_tyre_counts_by_the_tyres_width(beside_m, touched):
    """Half of the tyre is 0.05 m, the rock's radius at most 0.05 m."""
    ground = with_rock(ROVER.half_wheelbase_m, ROVER.half_track_m + beside_m)
    assert bool(list(touches(ground, Pose(0.0, 0.0), ROVER))) == touched


@pytest.mark.parametrize(("ahead_m", "touched"), [(0.10, True), (0.16, False)])
def test_a_rock_before_a_tyre_counts_by_the_tyres_round(ahead_m, touched):
    ground = with_rock(ROVER.half_wheelbase_m + ahead_m, ROVER.half_track_m)
    assert bool(list(touches(ground, Pose(0.0, 0.0), ROVER))) == touched


def test_a_rock_between_two_orientations_is_met_on_the_turn_between_them():
    arm_m, corner = math.hypot(ROVER.half_wheelbase_m, ROVER.half_track_m), math.atan2(0.23, 0.375)
    yaw = corner + math.radians(11.25)
    ground = with_rock(arm_m * math.cos(yaw), arm_m * math.sin(yaw), width_m=0.04)
    a, b = Pose(0.0, 0.0), Pose(0.0, 0.0, yaw_rad=math.radians(22.5))
    assert not list(touches(ground, a, ROVER)) and not list(touches(ground, b, ROVER))
    met = [
        wheel
        for x, y, yaw_rad, on_spot in between(a, b)
        for _, wheel in touches(ground, Pose(x, y, yaw_rad=yaw_rad), ROVER, on_spot)
    ]
    assert set(met) == {1}


def test_the_steps_between_two_poses_are_small_and_end_at_the_second():
    a, b = Pose(1.0, 2.0, yaw_rad=3.0), Pose(1.1, 2.0, yaw_rad=-3.0)
    steps = list(between(a, b))
    assert steps[-1][:2] == (1.1, 2.0) and math.cos(steps[-1][2] - b.yaw_rad) == pytest.approx(1.0)
    assert len(steps) >= 8 and all(not on_spot for *_, on_spot in steps)
    assert len(list(between(a, Pose(9.0, 2.0)))) == 1  # set down elsewhere: no movement


def flown(rock_at_m, drift, seed=3):
    ground = with_rock(*rock_at_m, width_m=0.15)
    mission = Kinematic(ground, scanner(quick()), Errors(), seed, drift=drift)  # its scanner sees the raster: no rock
    return mission, mission.fly()


def test_a_rock_that_the_map_lacks_is_counted_when_a_wheel_meets_it():
    _, met = flown((0.5, ROVER.half_track_m), NO_DRIFT)
    _, missed = flown((0.5, 1.5), NO_DRIFT)
    assert met.kind == missed.kind == "arrived"
    assert {wheel for _, wheel in met.on_rocks} == {1, 2}  # the left ones
    assert missed.on_rocks == set()


def test_a_drift_moves_the_true_rover_off_its_path_and_is_the_same_for_the_same_seed():
    mission, flight = flown((0.5, 4.0), FLOWN_DRIFT)
    again, _ = flown((0.5, 4.0), FLOWN_DRIFT)
    path, true = flight.stops[0].result.decision.path.stations, flight.stops[0].driven
    off_m = np.hypot(*(true - path)[:, :2].T)
    assert off_m[0] == 0.0 and 0.003 < off_m.max() < 0.3
    assert mission.true == again.true and mission.true != mission.estimate
