"""Missions on small ground: they end, and how they end for every kind of goal."""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from onboard.config import Config, load
from onboard.records import BeamStatus
from tests.missions.campaign import POSE_ERROR
from tests.missions.mission import Errors, Kinematic
from tests.missions.world.fields import from_orbit, main_field, ring
from tests.missions.world.scanner import Scanner, scanner
from tests.missions.world.small import quick, world
from tests.missions.world.truth import truth

pytestmark = pytest.mark.campaign

CONFIG = quick()
SCANNER = scanner(CONFIG)
RING = [(1.7, -1.3, 4.3, -1.0), (1.7, 1.0, 4.3, 1.3), (1.7, -1.3, 2.0, 1.3), (4.0, -1.3, 4.3, 1.3)]
TRAP = [(1.2, -1.8, 1.5, 1.8), (-0.3, 1.5, 1.5, 1.8), (-0.3, -1.8, 1.5, -1.5)]
EXACT = Errors()


def fly(ground, made=SCANNER, errors=EXACT, gdem=None):
    return Kinematic(ground, made, errors, 1, gdem).fly()


def test_the_same_seed_flies_the_same_mission():
    first, again = (fly(world(), errors=Errors(0.05, 0.02)) for _ in range(2))
    assert [stop.pose for stop in first.stops] == [stop.pose for stop in again.stops]
    assert [s.result.decision.reason for s in first.stops] == [s.result.decision.reason for s in again.stops]
    assert (first.way_m, first.miss_m) == (again.way_m, again.miss_m)


def test_a_goal_behind_a_u_is_reached_without_a_touch():
    flight = fly(world(TRAP))
    assert (flight.kind, flight.hard) == ("arrived", 0), flight.reason
    assert flight.miss_m < 0.1


def test_a_ringed_goal_is_reported_unreachable_as_the_truth_says():
    ringed = world(RING)
    assert not truth(ringed, CONFIG).reachable
    flight = fly(ringed)
    assert flight.kind == "unreachable", flight.reason
    assert flight.stops[-1].result.decision.rule == "R9"
    assert 1.0 < flight.stops[-1].result.decision.data["distance_m"] < 2.5


def test_a_wall_that_nobody_saw_beside_the_way_is_not_brushed():
    """Seed 11: at a turn on the spot beside the ring the wheel's rim met the wall's unseen side."""
    flight = fly(ring(11), scanner(Config()))
    assert (flight.kind, flight.hard, flight.unseen) == ("unreachable", 0, 0), flight.reason


def test_a_rover_that_an_error_shifts_to_the_rim_of_the_known_rolls_over_nothing_unseen():
    """Seed 2: its own pose read as not free, and every unknown pose around was let go."""
    far = load(None, {"mission.leg_m": 100.0})
    flight = Kinematic(main_field(2), scanner(far), POSE_ERROR, 2).fly()
    assert (flight.kind, flight.hard, flight.unseen) == ("arrived", 0, 0), flight.reason


def test_a_goal_inside_a_rock_is_unreachable():
    flight = fly(world([(2.5, -0.5, 3.5, 0.5)]))
    assert flight.kind == "unreachable", flight.reason
    assert flight.hard == 0


def test_a_goal_on_the_rover_is_arrived_at_where_it_stands():
    flight = fly(world(goal_m=(-2.0, 0.0)))
    assert (flight.kind, len(flight.stops)) == ("arrived", 1)
    assert flight.way_m < 0.1


@dataclass(frozen=True)
class Blind(Scanner):
    """Its beams meet nothing."""

    def sweep(self, world, pose, rng):
        return tuple(
            replace(
                scan,
                ranges_m=np.full_like(scan.ranges_m, np.nan),
                status=np.full_like(scan.status, BeamStatus.NO_RETURN),
            )
            for scan in super().sweep(world, pose, rng)
        )


def test_scans_without_any_return_end_the_mission_within_the_assumed_disc():
    made = Blind(*(getattr(SCANNER, name) for name in SCANNER.__dataclass_fields__))
    flight = fly(world(), made)
    assert flight.kind == "unreachable", flight.reason
    assert all(math.dist((stop.pose.x_m, stop.pose.y_m), (-2.0, 0.0)) < 0.9 for stop in flight.stops)


def test_with_the_orbiters_map_the_goal_is_reached_too_and_the_map_learns():
    ground = world(TRAP)
    before = from_orbit(ground, 2.0)
    blank = replace(before, heights_m=np.zeros_like(before.heights_m))
    flight = fly(ground, gdem=blank)
    assert flight.kind == "arrived", flight.reason
    learned = flight.stops[-1].result.gdem.heights_m
    assert np.abs(learned - before.heights_m)[np.isfinite(learned) & (learned != 0)].max() < 0.2
    assert (learned != 0).sum() >= 6


boxes = st.lists(
    st.builds(
        lambda x, y, w, h: (x, y, x + w, y + h),
        st.floats(-1.0, 3.5), st.floats(-4.0, 3.5), st.floats(0.2, 2.0), st.floats(0.2, 2.0),
    ), max_size=6,
)  # fmt: skip


@settings(max_examples=3, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(walls=boxes, walled_in=st.booleans())
def test_every_mission_ends_within_its_bound(walls, walled_in):
    """Each stop is new, spends a try, or lowers the record: on 10 m x 10 m that is over before the limit."""
    ground = world([*walls, *(RING if walled_in else [])])
    flight = fly(ground)
    assert flight.kind in ("arrived", "unreachable"), flight.reason
    assert len(flight.stops) <= CONFIG.mission.stop_limit
    assert flight.hard == 0
    if walled_in:
        assert flight.kind == "unreachable"


def test_unguarded_the_strategy_goes_on_until_the_limit_and_counts_as_endless():
    loose = quick(mission__strategy="visibility", mission__guard=False, mission__stop_limit=2)
    flight = fly(world(RING), scanner(loose))
    assert flight.kind == "endless"
    assert len(flight.stops) == 3
