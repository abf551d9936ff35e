"""The way back to the start, along the way that was driven."""

import math
from dataclasses import replace

import numpy as np
import pytest

from onboard import config
from onboard.core.mission.driven_trail import STEP_M
from onboard.core.mission.return_track import Track
from onboard.records import Pose
from protocol.link.transactions import RequestState
from protocol.tables.modes import Mode
from tests.onboard.core_bench import CoreBench, first_map, quick


def noted(poses):
    track = Track()
    for x, y, yaw in poses:
        track.note(Pose(x, y, yaw_rad=yaw))
    return track


def straight(start_m, end_m, step_m=0.001):
    return [(x, 0.0, 0.0) for x in np.arange(start_m, end_m, step_m)]


# -- the track -------------------------------------------------------------------------------------------------


def test_the_way_back_has_a_pose_each_5_cm_the_newest_first():
    way = noted(straight(0.0, 1.0005)).back()
    assert way[0, 0] == pytest.approx(1.0, abs=STEP_M) and way[-1].tolist() == [0.0, 0.0, 0.0]
    assert np.all(-np.diff(way[:, 0]) <= STEP_M + 0.0011) and len(way) <= 21


def test_a_turn_on_the_spot_is_on_the_way_and_at_one_place():
    turn = [(0.5, 0.0, yaw) for yaw in np.arange(0.0, math.pi / 2, 0.01)]
    way = noted(straight(0.0, 0.5) + turn).back()
    spun = way[way[:, 2] > 0.0]
    assert len(spun) >= 14 and len({tuple(place) for place in spun[:, :2].tolist()}) == 1


def test_a_way_that_comes_back_to_a_place_and_heading_forgets_what_was_between():
    there_and_back = straight(0.0, 2.0) + straight(0.0, 2.0)[::-1]
    assert len(noted(there_and_back)) <= 10
    turned = [(x, y, math.pi) for x, y, _ in straight(0.0, 2.0)[::-1]]
    assert len(noted(straight(0.0, 2.0) + turned)) > 70  # another heading: it cannot stand there so without turning


def test_a_correction_bends_what_was_driven_since_the_last_one():
    track = noted(straight(0.0, 1.0005))
    track.correct(Pose(1.0, 0.0))
    for x, y, yaw in straight(1.001, 2.0005):
        track.note(Pose(x, y, yaw_rad=yaw))
    track.correct(Pose(2.0, 0.2))
    way = track.back()[::-1]
    assert np.all(way[way[:, 0] <= 1.0, 1] == 0.0)
    assert way[-1, 1] == pytest.approx(0.2) and np.all(np.diff(way[way[:, 0] > 1.0, 1]) > 0.0)


# -- flown -----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def known():
    return first_map()


def away(known, **sections):
    """A rover 1.2 m from its start round a corner, driven there by the operator."""
    rover = CoreBench(settings=quick(**sections), memory=known)
    rover.settle()
    for vx, yaw, metres, seconds in ((0.1, 0.0, 0.7, 30.0), (0.0, 0.2, 5.0, 4.0), (0.1, 0.0, 0.5, 30.0)):
        request = rover.order("drive", vx_mps=vx, vy_mps=0.0, yaw_radps=yaw, duration_s=seconds, distance_m=metres)
        rover.until_final(request)
        rover.run(1.0)  # the wheels brake
    return rover


def test_return_drives_back_to_the_start_on_the_way_that_was_driven(known):
    rover = away(known)
    driven = rover.rover.executive.tasks.track.back()[:, :2]
    assert math.hypot(*rover.pose[:2]) > 0.9
    request, worst_m = rover.order("return"), 0.0
    while not (rover.states(request) and RequestState(rover.states(request)[-1]).final):
        rover.step()
        worst_m = max(worst_m, np.hypot(*(driven - rover.pose[:2]).T).min())
    assert rover.states(request)[-1] is RequestState.COMPLETED and rover.told("RETURNED") and rover.mode is Mode.STANDBY
    assert math.hypot(*rover.pose[:2]) < 0.1 and abs(rover.pose[2]) < math.radians(6)
    assert worst_m < 0.08


def test_a_keep_out_across_the_way_back_is_named_and_nothing_is_driven(known):
    rover = away(known)
    stood = list(rover.pose)
    rover.order("fence_add", fence="pit", kind="keep_out", corners_m=(-0.6, -0.1, -0.4, -0.1, -0.5, 0.1))
    request = rover.order("return")
    assert rover.until_final(request) is RequestState.FAILED
    assert "keep-out `pit` lies across the way back" in rover.text(request)
    assert rover.pose == pytest.approx(stood, abs=1e-3)


def test_without_contact_the_rover_goes_back_where_the_setting_says_so(known):
    safety = config.Safety(command_lost_ns=40_000_000_000, command_lost="return")
    rover = CoreBench(settings=quick(safety=safety, mission=replace(config.Mission(), leg_m=0.5)), memory=known)
    rover.settle()
    request = rover.goto(3.0, 0.0)
    rover.until_final(request, 120.0)
    assert rover.states(request)[-1] is RequestState.FAILED
    assert rover.text(request) == "no authenticated contact: leg finished, returning"
    gone_m = math.hypot(*rover.pose[:2])
    rover.until(lambda: rover.mode is Mode.STANDBY, 200.0)
    assert gone_m > 0.3 and rover.told("RETURNED") and math.hypot(*rover.pose[:2]) < 0.15
