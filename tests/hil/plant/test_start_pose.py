"""The rover is told where it truly stands: put down on twisted ground it settles without a turn, and then is asked."""

import math
from dataclasses import replace

import numpy as np
import pytest

from hil.plant.plant import Plant
from hil.plant.stance import stance, wheel_centres
from hil.run.in_process import CAMPAIGN_STEP_NS, InMemory
from hil.scenarios.model import Scenario, flight_settings, ground_of, set_words
from hil.terrain.mesh import soil_height
from hil.world.truth import Truth
from hil.world.world import World
from onboard.config import Rover
from onboard.records import Pose
from tests.hil.small_fields import field_of, plane, rough

FEW, FIFTY = (2, 5, 36, 87, 101, 119), range(101, 151)
TOLD_DEG, TOLD_M = 0.05, 0.005
WAIT_S = 2.0  # until the first order of a demo
TWISTS = [(0.12, 0.0), (-0.2, 0.4), (0.25, 2.0)]  # 1/m: height is this times x y; yaw of the start


def twisted(per_m, yaw_rad=0.0):
    """Ground whose slope along x changes with y: the two rockers lie differently on it."""
    across = (np.arange(160) - 79.5) * 0.05
    return replace(field_of(per_m * across[None, :] * across[:, None]), start=Pose(0.0, 0.0, yaw_rad=yaw_rad))


def off(pose, other):
    """Distance in m and turn in degrees between two poses."""
    turn_rad = math.remainder(pose.yaw_rad - other.yaw_rad, math.tau)
    return math.dist((pose.x_m, pose.y_m), (other.x_m, other.y_m)), abs(math.degrees(turn_rad))


def told_and_true(seed):
    """What the flight program is told on a field of the demo, and where the rover stands when it waits for orders."""
    bench = InMemory(Scenario(terrain="fbm", seed=seed), (), step_ns=CAMPAIGN_STEP_NS)
    told = bench.rover.config.localisation
    for _ in range(round(WAIT_S * 100)):
        bench.advance((bench.tick + 2) * 10_000_000)
        bench.tick += 1
    true, wished = bench.state.pose, bench.field.start
    bench.free()
    return Pose(told.start_x_m, told.start_y_m, yaw_rad=told.start_yaw_rad), true, wished


@pytest.mark.parametrize("field", [plane(), plane(12.0), plane(9.0, "y"), rough(3, ratio=0.0), twisted(0.25, 0.4)])
def test_all_four_wheels_of_the_stance_touch_the_soil(field):
    pose, rover = Pose(0.3, -0.2, yaw_rad=0.7), Rover()
    centres_m = wheel_centres(rover, pose, stance(field, rover, pose))
    ground_m = soil_height(field.grid, field.soil_z, centres_m[:, 0].copy(), centres_m[:, 1].copy())
    np.testing.assert_allclose(centres_m[:, 2] - ground_m, rover.wheel_radius_m, atol=1e-5)


@pytest.mark.parametrize(("per_m", "yaw_rad"), TWISTS)
def test_on_twisted_ground_the_rover_settles_where_it_was_put_down(per_m, yaw_rad):
    field = twisted(per_m, yaw_rad)
    plant = Plant(field)
    state = plant.reset(field.start)
    plant.close()
    assert abs(state.rockers_rad[0]) > 0.02  # or there was nothing to settle
    moved_m, turned_deg = off(state.pose, field.start)
    assert moved_m < TOLD_M and turned_deg < TOLD_DEG
    found = stance(field, Rover(), field.start)
    assert state.rockers_rad == pytest.approx((found.rocker_rad, -found.rocker_rad), abs=2e-3)


@pytest.mark.parametrize("seed", FEW)
def test_the_told_start_is_the_true_one(seed):
    told, true, _ = told_and_true(seed)
    off_m, off_deg = off(told, true)
    assert off_m < TOLD_M and off_deg < TOLD_DEG


@pytest.mark.campaign
def test_the_told_start_is_the_true_one_on_fifty_fields():
    offs = [off(told, true) for told, true, _ in map(told_and_true, FIFTY)]
    assert [seed for seed, (off_m, off_deg) in zip(FIFTY, offs) if off_m >= TOLD_M or off_deg >= TOLD_DEG] == []


def test_over_sockets_and_in_one_process_the_same_start_is_told():
    """To the bit, on the field where the rockers turn most."""
    scenario = Scenario(terrain="fbm", seed=119)
    world = World(ground_of(scenario).field, scenario.seed, Rover(), Truth())
    bench = InMemory(scenario, ())
    told = flight_settings(scenario, world.start)
    words = dict(word.split("=") for word in set_words(told) if "=" in word)
    for name in ("start_x_m", "start_y_m", "start_yaw_rad"):
        assert float(words[f"localisation.{name}"]) == getattr(bench.rover.config.localisation, name) != 0.0
    world.free()
    bench.free()


def test_a_scenario_may_tell_another_start():
    bench = InMemory(Scenario(terrain="flat", set={"localisation.start_x_m": 0.25}), ())
    told = bench.rover.config.localisation
    bench.free()
    assert told.start_x_m == 0.25 and told.start_yaw_rad == bench.start.yaw_rad
