"""The drive guard in the kinematic world: a hole that opens after the scans, a pitted field, objects on the tracks."""

import math

import numpy as np
import pytest

from onboard.config import load
from onboard.records import Grid, Pose
from tests.missions.guard.guard_runs import GUARDED, REGISTERED
from tests.missions.guard.guarded import Guarded, in_hole, really_bad
from tests.missions.guard.open_loop import Put, outcomes
from tests.missions.world.drift import Drift
from tests.missions.world.fields import pits
from tests.missions.world.scanner import scanner
from tests.missions.world.world import World

pytestmark = pytest.mark.campaign

CONFIG = load(None, GUARDED)
GRID = Grid(-2.975, -2.975, 0.05, 120, 200)
FLAT = World(GRID, np.zeros((120, 200), np.float32), Pose(0.0, 0.0), (4.0, 0.0), 1, "flat", np.empty((0, 4)))
HOLE = np.array([[2.6, 0.23, 0.4, 0.2]])


class Opening(Guarded):
    """Even ground in which a hole opens once the rover starts to drive."""

    def _drive(self, decision):
        if not len(self.world.holes):
            self.world = self.world.sunk(HOLE)
        return super()._drive(decision)


def test_hole_that_opens_after_the_scans_stops_the_rover_and_is_gone_round():
    mission = Opening(FLAT, scanner(CONFIG), REGISTERED, 3)
    flight = mission.fly()
    assert flight.kind == "arrived"
    assert (flight.hard, flight.in_hole, flight.unseen) == (0, 0, 0)
    assert len(flight.guard_stops) >= 1
    first = flight.guard_stops[0]
    assert first.real
    assert first.pose.x_m + 0.475 < 2.4 - 0.2  # the front wheels' rims, well before the hole's
    assert all(math.dist(point, (2.6, 0.23)) < 0.5 for point in flight.memory.blocked_m)


def test_unguarded_the_same_rover_drives_into_it():
    blind = load(None, {})
    flight = Opening(FLAT, scanner(blind), REGISTERED, 3).fly()
    assert flight.in_hole > 0


@pytest.mark.parametrize("seed", [7, 13])  # on 13 a hole lies diagonal to a wheel's cell
def test_on_a_pitted_field_no_wheel_enters_a_hole_or_rolls_over_what_nobody_saw(seed):
    flight = Guarded(pits(seed), scanner(CONFIG), REGISTERED, seed).fly()
    assert flight.kind in ("arrived", "unreachable")
    assert (flight.hard, flight.in_hole, flight.unseen) == (0, 0, 0)


def test_objects_put_on_the_tracks_after_the_scan_are_seen_in_time():
    found = outcomes(1)
    assert sum(one.met for one in found) >= 4
    assert not any(one.missed for one in found)


def test_wheel_is_in_a_hole_where_its_whole_patch_is_and_a_hole_is_really_bad():
    world = FLAT.sunk(HOLE)
    rover = CONFIG.rover
    assert in_hole(world, Pose(2.6 - 0.375, 0.0), rover)
    assert not in_hole(world, Pose(2.6 - 0.375, 0.2), rover)
    assert really_bad(world, 2.6, 0.5) and not really_bad(world, 2.6, 1.2)
    assert Put(2.6, 0.23, 0.4, -0.2).met(Pose(2.6 - 0.375, 0.0), rover)


def test_drift_grows_with_the_way_and_has_the_spread_that_is_asked_for():
    way = np.linspace(0.0, 4.0, 200)
    drawn = np.array([Drift().draw(way, 0.11, np.random.default_rng(seed)) for seed in range(400)])
    assert (drawn[:, 0, :3] == 0.0).all()
    assert np.allclose(np.hypot(drawn[:, -1, 0], drawn[:, -1, 1]).std() / 0.06, 0.46, atol=0.08)
    assert np.allclose(np.degrees(drawn[:, -1, 5].std()), 0.7, atol=0.08)
