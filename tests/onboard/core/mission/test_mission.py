"""The order of a mission: what the rover does at the first stop, at later ones, and on a map that it has already."""

import math
import re
from itertools import pairwise

import pytest

from onboard import config
from onboard.core.mission.mission import BACK_OFF_M
from protocol.conventions import wrap_rad
from protocol.link.transactions import RequestState
from protocol.tables.modes import Mode, Phase
from tests.onboard.core_bench import QUICK, CoreBench, first_map, quick

LETTERS = {
    Phase.SCANNING: "S",
    Phase.MAPPING: "M",
    Phase.PLANNING: "P",
    Phase.DRIVING: "D",
    Phase.TURNING: "T",
    Phase.ARRIVED: "A",
    Phase.FAILED: "F",
    Phase.NONE: "-",
    Phase.BACKING_OFF: "B",
}
pytestmark = pytest.mark.copied


def fly(goal, memory=None, **sections):
    rover = CoreBench(settings=quick(**sections), memory=memory)
    rover.settle()
    assert rover.until_final(rover.goto(*goal), 400.0) is RequestState.COMPLETED
    return rover


def word(rover):
    return "".join(LETTERS[phase] for _, phase in rover.phases)


@pytest.fixture(scope="module")
def known():
    return first_map()


@pytest.fixture(scope="module")
def flown():
    return fly((3.0, 0.5), mission=config.Mission(leg_m=1.5))


def test_phases_follow_each_other_as_the_chapter_says(flown):
    assert re.fullmatch(r"SMTSMP(DT?SMP)+D?A", word(flown)), word(flown)
    assert flown.mode is Mode.STANDBY


def test_the_first_stop_scans_ahead_and_behind_and_later_ones_once(flown):
    scans = [text for _, text in flown.told("PHASE") if text.startswith("SCANNING")]
    stops = [int(text.split()[-1]) for text in scans]
    assert stops == [0, 0, *range(1, len(stops) - 1)]
    first, second = flown.rover.executive.mission.result.state.stops[:2]
    assert abs(wrap_rad(second.heading_rad - first.heading_rad)) == pytest.approx(math.pi, abs=0.01)


def test_the_turn_between_the_first_two_scans_is_half_a_turn_on_the_spot():
    rover = CoreBench()
    rover.settle()
    rover.goto(3.0, 0.5)
    rover.until_phase(Phase.TURNING)
    rover.until_phase(Phase.SCANNING)
    assert abs(wrap_rad(rover.pose[2])) == pytest.approx(math.pi, abs=QUICK.motion.arrive_yaw_rad + 0.02)
    assert math.hypot(*rover.pose[:2]) < 0.02


def test_every_later_scan_is_registered_to_what_was_seen_before(flown):
    later = len(flown.rover.executive.mission.result.state.stops) - 2
    assert len(flown.told("REGISTERED")) >= later > 0


def test_the_end_is_where_the_rover_believes_to_be(flown):
    pose = flown.rover.localisation.pose
    assert math.dist((pose.x_m, pose.y_m), (3.0, 0.5)) <= QUICK.mission.goal_tolerance_m
    assert math.dist((pose.x_m, pose.y_m), flown.pose[:2]) <= QUICK.mission.goal_tolerance_m


@pytest.fixture(scope="module")
def near(known):
    return fly((1.2, 0.2), known)


def test_a_goto_on_a_kept_map_scans_once_and_its_first_stop_counts_one_scan(near):
    assert word(near).startswith("SMPD")
    state = near.rover.executive.mission.result.state
    assert len(state.stops) == state.number - 1


def test_the_map_of_a_stopped_mission_is_kept_for_the_next():
    rover = CoreBench()
    rover.settle()
    rover.goto(3.0, 0.5)
    rover.until_driving()
    rover.order("stop")
    rover.run(1.0)
    before = len(rover.phases)
    rover.goto(2.0, 0.5)
    rover.until_driving()
    assert [LETTERS[phase] for _, phase in rover.phases[before:]] == list("SMPD")


def test_a_goal_within_2_m_of_the_last_registration_needs_no_further_scan(near):
    assert word(near) == "SMPDA"
    assert near.told("REGISTERED")


def test_a_goal_farther_than_2_m_from_the_last_registration_is_looked_at_before_arrival_is_said(known):
    seen_whole = config.Mapping_(near_m=30.0)  # no look on the way
    rover = fly((3.0, 0.5), known, mission=config.Mission(leg_m=4.0), mapping=seen_whole)
    assert word(rover).endswith("DSMPA")
    assert max(rover.told("REGISTERED"))[0] > rover.told("ARRIVED")[0][0] - 1.0


def test_without_any_registration_on_a_kept_map_a_near_goal_is_looked_at_too(known):
    tight = config.Localisation(gate_m=0.01, gate_rad=0.01, start_x_m=0.2)  # stands elsewhere than it believes
    rover = fly((1.2, 0.2), known, localisation=tight)
    assert rover.told("REGISTRATION_REFUSED")
    assert word(rover).startswith("SMPDSMP")


@pytest.fixture(scope="module")
def on_the_way(known):
    rover = CoreBench(settings=quick(), memory=known)
    rover.settle()
    rover.request = rover.goto(2.5, 0.5)
    rover.until_driving()
    rover.until(lambda: rover.pose[0] > 0.6, 30.0)
    return rover


def test_a_reason_to_back_off_ends_the_way_30_cm_back_with_a_scan_and_a_new_plan(on_the_way):
    rover, mission = on_the_way, on_the_way.rover.executive.mission
    assert mission.back_off("NOT_MOVING") == 1
    rover.until(lambda: max(map(abs, rover.turning_rates)) == 0.0, 5.0)
    before = rover.pose[:]
    rover.until_phase(Phase.SCANNING, 30.0)
    back = [a - b for a, b in zip(rover.pose, before)]
    ahead_m = back[0] * math.cos(before[2]) + back[1] * math.sin(before[2])
    assert ahead_m == pytest.approx(-BACK_OFF_M, abs=0.05)
    assert rover.until_final(rover.request, 400.0) is RequestState.COMPLETED
    assert word(rover).startswith("SMPDSMPD")


def test_the_ground_is_told_that_the_rover_backs_off(on_the_way):
    on_the_way.rover.executive.mission.back_off("NOT_MOVING")
    on_the_way.step()
    assert on_the_way.told("PHASE")[-1][1].startswith("BACKING_OFF")


def test_the_rule_counts_nothing_as_tried_at_the_end_of_a_way_that_was_given_up(on_the_way):
    mission = on_the_way.rover.executive.mission
    mission.back_off("NOT_MOVING")
    assert (mission._rule.targets, mission._rule.tried) == (mission._rule_before.targets, mission._rule_before.tried)
    assert mission._rule.stops == mission.result.state.stops


def test_each_reason_to_back_off_is_counted_by_itself_and_a_second_one_ends_the_retreat(on_the_way):
    rover, mission = on_the_way, on_the_way.rover.executive.mission
    assert mission.back_off("NOT_MOVING") == 1
    rover.run(2.0)
    assert rover.rover.twist.vx_mps < 0.0
    assert mission.back_off("SLIP_HIGH") == 1
    rover.until_phase(Phase.SCANNING, 2.0)
    rover.until_driving()
    assert mission.back_off("NOT_MOVING") == 2


def test_where_the_wheels_slip_the_ground_is_dear_to_every_later_plan(on_the_way):
    rover, mission = on_the_way, on_the_way.rover.executive.mission
    rover.rover.watch.slip.high, rover.rover.watch.slip._calm = True, 0
    rover.step()
    place = (rover.rover.localisation.pose.x_m, rover.rover.localisation.pose.y_m)
    rover.until_phase(Phase.SCANNING, 60.0)
    assert mission.memory.slippery_m[0] == place
    assert all(math.dist(a, b) > 0.2 for a, b in pairwise(mission.memory.slippery_m))
    rover.until_phase(Phase.PLANNING, 60.0)  # its map is another by now
    assert mission.memory.slippery_m[0] == place


def test_while_no_way_is_driven_there_is_nothing_to_back_off_from(known):
    rover = CoreBench(settings=quick(), memory=known)
    rover.settle()
    rover.goto(1.2, 0.2)
    rover.until_phase(Phase.SCANNING)
    assert rover.rover.executive.mission.back_off("NOT_MOVING") == 0
    rover.step()
    assert rover.phase is Phase.SCANNING
