"""The drive guard in the flight program: the scanner held, lines judged, a hazard mapped, its loss noticed."""

import math
from dataclasses import replace

import numpy as np
import pytest

from onboard import config
from onboard.core.rover import Rover
from onboard.core.tick import tick
from onboard.drivers.platform.workers import Inline
from protocol.link.transactions import RequestState
from protocol.tables.modes import Mode, Phase
from tests.onboard.core_bench import QUICK, CoreBench, digest, first_map, quick

ON = config.DriveGuard(on=True)
pytestmark = pytest.mark.copied


@pytest.fixture(scope="module")
def known():
    return first_map()


def set_out(known):
    rover = CoreBench(settings=quick(drive_guard=ON), memory=known)
    rover.settle()
    rover.request = rover.goto(2.4, 0.5)
    rover.until_phase(Phase.DRIVING)
    return rover


@pytest.fixture(scope="module")
def setting_out(known):
    return set_out(known)


@pytest.fixture(scope="module")
def driving(known):
    rover = set_out(known)
    rover.until(lambda: rover.pose[0] > 0.6, 30.0)
    return rover


def held(rover):
    angle_rad = rover.rover.nodes.tilt_angle_rad
    return angle_rad == pytest.approx(ON.tilt_rad, abs=math.radians(0.2))


def test_the_wheels_stand_until_the_scanner_is_held_and_lines_come(setting_out):
    took_s = setting_out.until(lambda: setting_out.rover.twist != (0.0, 0.0, 0.0), 10.0)
    assert held(setting_out)
    assert setting_out.rover.executive.mission._guard._line_ns > 0
    assert took_s < 3.0  # the axis comes from the start of the next sweep


def test_ten_lines_a_second_are_judged_and_the_axis_stays(driving):
    lines = []
    for _ in range(200):
        lines += [line for job in driving.step().jobs if job.name == "guard_listen" for line in job.arguments[1]]
        assert held(driving)
    assert np.diff([line.scan.start_ns for line in lines]) == pytest.approx(100e6, abs=1e6)
    ahead = {len(line.scan.ranges_m) for line in lines}
    assert ahead == {2 * 65 * 4 + 1}


def test_a_line_takes_the_estimate_of_its_own_time(driving):
    poses = {}
    for _ in range(100):
        jobs = driving.step().jobs
        poses[driving.now_ns] = driving.rover.localisation.pose
        for line in (line for job in jobs if job.name == "guard_listen" for line in job.arguments[1]):
            middle_ns = line.scan.start_ns + len(line.scan.ranges_m) / 2 * line.scan.beam_ns
            near = [ns for ns in poses if abs(ns - middle_ns) <= 5e6]
            assert not near or line.pose in [poses[ns] for ns in near]
    assert middle_ns < driving.now_ns - 20e6


def test_a_way_that_stays_as_it_was_mapped_is_driven_without_a_stop(driving):
    assert driving.until_final(driving.request, 200.0) is RequestState.COMPLETED
    assert not driving.told("HAZARD")
    assert not driving.told("FAULT")


def test_at_the_end_of_a_leg_what_the_lines_saw_is_in_the_map(driving):
    grid, view_m = driving.rover.executive.memory.cells.grid, driving.rover.executive.memory.cells.view_m
    before_m = view_m[grid.cell(2.2, 0.45)]
    driving.until_phase(Phase.SCANNING, 60.0)
    cells = driving.rover.executive.memory.cells
    assert cells.view_m[cells.grid.cell(2.2, 0.45)] < 1.3 < before_m


def test_after_a_hazard_its_cells_are_blocked_and_the_rover_looks_from_30_cm_back(driving):
    driving.put_post(2.3, 0.4)
    driving.until_phase(Phase.BACKING_OFF, 20.0)
    driving.until(lambda: max(map(abs, driving.turning_rates)) == 0.0, 5.0)
    stood = driving.pose[:2]
    assert 2.3 - stood[0] > QUICK.rover.half_wheelbase_m + QUICK.rover.wheel_radius_m + 0.2 + 0.3  # radius, and room
    driving.until_phase(Phase.SCANNING, 30.0)
    assert math.dist(stood, driving.pose[:2]) == pytest.approx(0.3, abs=0.06)
    blocked = driving.rover.executive.memory.blocked_m
    assert blocked
    assert all(math.dist(point, (2.3, 0.4)) < 0.5 for point in blocked)
    driving.until_phase(Phase.DRIVING, 30.0)
    assert not driving.rover.executive.hazard


def test_lost_lines_stop_the_rover_within_450_ms_and_it_drives_on_when_they_come_back(driving):
    driving.run(0.5)
    last_ns = driving.rover.lidar._stream.heard_ns
    driving.lidar_plugged = False
    driving.until(lambda: driving.rover.twist == (0.0, 0.0, 0.0), 1.0)
    assert 0.4e9 < driving.now_ns - last_ns <= 0.46e9
    assert any("LIDAR_SILENT" in text for _, text in driving.told("FAULT"))
    driving.lidar_plugged = True
    driving.until(lambda: driving.rover.twist.vx_mps > 0.05, 10.0)
    assert driving.phase is Phase.DRIVING


def test_a_verdict_that_is_late_stops_the_rover_until_it_comes(driving):
    driving.job_late_ticks = 100
    took_s = driving.until(lambda: driving.rover.twist == (0.0, 0.0, 0.0), 1.0)
    assert driving.rover.jobs.overdue_ticks(driving.tick) == 1
    assert took_s <= 0.1 + QUICK.jobs.guard_ticks / 100 + 0.01  # a line, its budget, the tick after
    driving.run(0.5)
    assert driving.rover.twist == (0.0, 0.0, 0.0) and any("JOB_LATE" in text for _, text in driving.told("FAULT"))
    driving.job_late_ticks = 0
    driving.until(lambda: driving.rover.twist.vx_mps > 0.05, 2.0)
    assert driving.phase is Phase.DRIVING


def test_a_guard_that_stays_blind_ends_the_mission_with_the_reason(driving):
    driving.lidar_plugged = False
    assert driving.until_final(driving.request, 40.0) is RequestState.FAILED
    assert "blind for 30 s" in driving.text(driving.request)
    assert driving.mode is Mode.STANDBY


def test_an_axis_that_does_not_come_to_its_angle_keeps_the_wheels_still(setting_out):
    setting_out.nodes.tilt.stalled = True
    setting_out.run(5.0)
    assert not held(setting_out)
    assert max(map(abs, setting_out.turning_rates)) == 0.0
    assert setting_out.until_final(setting_out.request, 40.0) is RequestState.FAILED
    assert "not held" in setting_out.text(setting_out.request)


def test_from_its_inputs_alone_a_hazard_is_answered_again_with_the_same_bytes(known):
    settings, inputs = quick(drive_guard=ON), []
    rover = CoreBench(settings=settings, memory=known)

    def step():
        rover.step()
        inputs.append(rover.inputs)

    for _ in range(200):
        step()
    rover.goto(2.4, 0.5)
    while not rover.told("FAULT_CLEARED"):
        step()
        if rover.pose[0] > 0.6 and not rover.told("HAZARD") and len(rover._posts) == 8:
            rover.put_post(2.0, 0.3)
    again, jobs = Rover(settings, None, known), Inline()
    for number, heard in enumerate(inputs):
        outputs = tick(again, replace(heard, jobs=jobs.take(tuple(done.job_id for done in heard.jobs))))
        jobs.start(outputs.jobs, outputs.cancelled)
        assert digest(outputs) == rover.digests[number]
