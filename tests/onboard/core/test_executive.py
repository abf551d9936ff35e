"""Orders, faults and modes of the flight core, seen from outside: frames on the bus, reports and events on the link."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from hil.devices.can.nodes import Encoder
from onboard import config
from onboard.motion.wheel_health import DriveHealth
from onboard.perception.pose.registration import RegistrationResult
from onboard.planning.prediction import predict
from onboard.records import Gdem, Grid, LinkMessage
from protocol.generated.can_codec import StopReason
from protocol.link import bulk
from protocol.link.datagrams import DatagramKind, payload_limit
from protocol.link.transactions import RequestState
from protocol.products import decode_ldem, poses_of
from protocol.tables.faults import BY_NAME, FAULTS
from protocol.tables.modes import Mode, Phase
from tests.onboard.core_bench import QUICK, STATION, CoreBench, first_map, quick

# Where each row of the fault table is tested: functions of tests/onboard or of tests/hil/run/test_missions.py.
TESTED_BY = {
    "LIDAR_SILENT": "test_a_lidar_silent_in_mid_sweep_discards_the_sweep_and_scans_again",
    "WHEEL_STALE": "test_stale_wheel_feedback_stops_the_wheels_within_40_ms_and_they_go_on_by_themselves",
    "WHEEL_SILENT": "test_a_silent_wheel_leads_to_safe_within_210_ms_with_the_reason",
    "CAN_BUS_OFF": "test_a_closed_bus_stops_the_wheels_within_50_ms_and_alone_is_named",
    "NODE_LOST": "test_a_node_without_heartbeat_leads_to_safe_within_1600_ms",
    "IMU_DEAD": "test_a_dead_imu_stops_the_wheels_within_40_ms_and_they_go_on_by_themselves",
    "TILT_ANGLE": "test_roll_over_the_limit_leads_to_safe_in_the_tick_that_sees_it",
    "KEEP_OUT": "test_a_keep_out_drawn_across_the_way_backs_the_rover_off_and_it_goes_round",
    "POSE_UNSURE": "test_a_pose_that_grows_unsure_ends_the_way_with_a_look_that_mends_it",
    "COMMAND_LOST": "test_without_contact_the_leg_is_finished_then_the_rover_stands_by_and_says_so",
    "JOB_LATE": "test_a_late_job_is_reported_while_it_is_late",
    "CAN_BABBLE": "test_a_babbling_id_is_named_within_200_ms_and_ignored_until_it_stops",
    "CAN_CORRUPT": "test_corrupt_frames_are_named_within_200_ms_with_their_counts_and_dropped",
    "NODE_FOREIGN": "test_a_node_that_speaks_another_dbc_is_named_at_its_first_heartbeat_and_there_is_no_drive",
    "NODE_TWICE": "test_a_second_node_under_one_id_is_named_within_a_second_and_there_is_no_drive",
    "HAZARD_AHEAD": "test_a_thing_put_on_the_way_ends_it_within_200_ms_of_the_second_line_that_meets_it",
    "ESTOP_PRESSED": "test_an_emergency_stop_frame_of_a_node_latches_estop_within_20_ms",
    "ENCODER_BAD": "test_a_bad_encoder_is_named_within_a_second_and_left_out_of_the_odometry",
    "WHEEL_STUCK": "test_a_failed_drive_is_named_of_its_wheel_within_a_second_and_goes_into_the_health",
    "WHEEL_FREE": "test_a_failed_drive_is_named_of_its_wheel_within_a_second_and_goes_into_the_health",
    "WHEEL_WEAK": "test_a_failed_drive_is_named_of_its_wheel_within_a_second_and_goes_into_the_health",
    "STEER_STUCK": "test_a_stuck_steering_is_named_half_a_second_after_it_is_three_degrees_away_with_its_angle",
    "STEER_OFFSET": "test_a_pot_that_jumps_is_no_stuck_steering_and_within_five_metres_the_reading_is_said_to_be_wrong",
    "SLIP_HIGH": "test_a_rover_that_lacks_half_its_speed_slips_within_a_metre_and_is_calm_three_seconds_after",
    "POWER_LOW": "test_an_empty_battery_leads_to_safe_within_half_a_second_and_only_a_mask_lets_the_operator_drive_on",
    "BROWN_OUT": "test_in_a_brown_out_the_wheels_rest_within_half_a_second_and_drive_on_when_the_voltage_is_back",
    "TICK_LATE": "test_a_computer_that_leaves_out_ticks_says_so_within_a_second_and_sheds_what_can_wait",
    "CONTROL_LATE": "test_orders_over_50_ms_late_stop_the_wheels_in_their_tick_and_after_a_second_the_rover_drives_on",
    "NO_PATH": "test_a_goal_without_a_way_is_told_as_no_path_until_the_next_goto",
    "LOOP": "test_a_strategy_that_comes_no_nearer_for_two_stops_is_told_as_a_loop_while_it_runs",
    "OPERATOR": "test_the_operators_word_is_a_row_of_its_own_and_obeyed_in_its_tick",
    "COMPUTER_STRAINED": "test_a_computer_past_a_limit_at_three_looks_says_which_and_at_the_next_that_is_well_no_more",
    "DISK_FULL": "test_a_disk_that_refuses_is_named_within_a_second_and_the_record_has_no_hole_when_it_takes_again",
    "RECORD_FAIL": "test_a_disk_that_refuses_is_named_within_a_second_and_the_record_has_no_hole_when_it_takes_again",
    **dict.fromkeys(
        ("LIDAR_GARBLED", "LIDAR_DIRTY", "LIDAR_CLOCK", "CLOCK_JUMP", "TILT_STALL"),
        "test_a_device_that_goes_wrong_in_mid_sweep_is_named_in_time_and_the_sweep_is_scanned_again",
    ),
    "IMU_BIAS": "test_a_gyro_that_reads_otherwise_at_the_next_stop_is_named_and_learned",
    "NOT_MOVING": "test_a_rover_whose_wheels_turn_and_that_stands_is_found_within_five_seconds",
}
pytestmark = pytest.mark.copied


def bench(known=None, **sections):
    made = CoreBench(settings=quick(**sections), memory=known)
    made.settle()
    return made


def standing(rover):
    return rover.rates == [0.0] * 4


def contact(rover):
    """An authenticated datagram that asks nothing: an acknowledgement of no events."""
    rover.hear(LinkMessage(rover.now_ns, True, "ok", STATION, DatagramKind.REPORT, bytes(4)))


@pytest.fixture(scope="module")
def known():
    return first_map()


@pytest.fixture(scope="module")
def driving(known):
    rover = bench(known)
    rover.request = rover.goto(3.0, 0.5)
    rover.until_driving()
    return rover


# -- orders ------------------------------------------------------------------------------------------------------


def test_goto_is_started_and_completed(known):
    rover = bench(known)
    request = rover.goto(1.2, 0.2)
    assert rover.until_final(request) is RequestState.COMPLETED
    assert rover.states(request) == [
        RequestState.STARTED,
        RequestState.PROGRESS,
        RequestState.COMPLETED,
    ]  # in between: the way
    assert "from the goal" in rover.text(request)
    assert rover.mode is Mode.STANDBY
    rover.step()
    assert standing(rover)
    assert ((rover.pose[0] - 1.2) ** 2 + (rover.pose[1] - 0.2) ** 2) ** 0.5 < QUICK.mission.goal_tolerance_m


def test_a_goal_outside_the_orbiters_map_is_refused_with_the_maps_extent(known):
    rover = CoreBench(memory=known, gdem=Gdem(Grid(-9.0, -9.0, 2.0, 10, 15), np.zeros((10, 15), np.float32)))
    rover.settle()
    request = rover.goto(50.0, 0.0)
    assert rover.until_final(request, 1.0) is RequestState.FAILED
    assert "(50.0, 0.0) is outside the orbiter's map: x -10 to 20, y -10 to 10 m" in rover.text(request)
    assert rover.mode is Mode.STANDBY


def test_a_second_goto_cancels_the_first_and_begins_with_a_scan(driving):
    second = driving.goto(1.0, 0.0)
    driving.step()
    assert driving.until_final(driving.request, 1.0) is RequestState.CANCELLED
    assert "another goto" in driving.text(driving.request)
    assert driving.states(second) == [RequestState.STARTED]
    assert (driving.mode, driving.phase) == (Mode.AUTONOMOUS, Phase.SCANNING)
    driving.step()
    assert standing(driving)


@pytest.mark.parametrize("odd", [0, 1])
def test_stop_in_mid_drive_stands_by_in_the_same_tick_and_the_next_wheel_frames_have_zero_rates(driving, odd):
    if driving.tick % 2 == odd:  # wheel frames go in even ticks
        driving.step()
    request = driving.order("stop")
    driving.step()
    assert driving.mode is Mode.STANDBY
    assert driving.rover.twist == (0.0, 0.0, 0.0)
    if not driving.outputs.can_frames or driving.tick % 2:
        driving.step()
    assert standing(driving)
    driving.run(0.5)
    assert driving.states(driving.request)[-1] is RequestState.CANCELLED
    assert "operator" in driving.text(driving.request)
    assert driving.states(request)[-1] is RequestState.COMPLETED
    driving.run(1.5)
    assert max(map(abs, driving.turning_rates)) == 0.0


def test_stop_in_mid_sweep_ends_the_motion_of_the_tilt_axis_too():
    rover = bench()
    rover.goto(3.0, 0.5)
    rover.until(lambda: rover.rover.nodes.tilt_moving and rover.lidar.scans > 20, 20.0)
    rover.order("stop")
    rover.run(0.5)
    angle_rad = rover.rover.nodes.tilt_angle_rad
    rover.run(2.0)
    assert rover.rover.nodes.tilt_angle_rad == pytest.approx(angle_rad, abs=0.002)
    assert not rover.rover.lidar.streaming


def test_safe_refuses_goto_with_what_is_allowed_until_resume():
    rover = bench()
    safe = rover.order("safe")
    rover.run(0.3)
    assert rover.states(safe)[-1] is RequestState.COMPLETED
    assert rover.mode is Mode.SAFE
    refused = rover.goto(1.0, 0.0)
    rover.run(0.3)
    assert rover.states(refused) == [RequestState.FAILED]
    assert rover.text(refused).startswith("goto is refused in SAFE: it needs STANDBY, AUTONOMOUS; allowed now: resume")
    resume = rover.order("resume")
    rover.run(0.3)
    assert rover.states(resume)[-1] is RequestState.COMPLETED
    assert rover.mode is Mode.STANDBY


def test_of_two_orders_in_one_tick_the_second_meets_the_mode_that_the_first_made():
    rover = bench()
    rover.order("safe")
    second = rover.goto(1.0, 0.0)
    rover.run(0.3)
    assert rover.mode is Mode.SAFE
    assert rover.states(second) == [RequestState.FAILED]
    assert "refused in SAFE" in rover.text(second)
    assert not rover.rover.executive.in_mission


def test_status_says_mode_phase_and_place(driving):
    request = driving.order("status")
    driving.run(0.3)
    assert driving.text(request).startswith("AUTONOMOUS DRIVING at ")


def test_emergency_stop_latches_every_node_and_only_reset_releases_them(driving):
    stop = driving.order("emergency_stop")
    driving.run(0.3)
    assert driving.mode is Mode.ESTOP
    assert all(node.latched for node in driving.nodes.all)
    assert driving.states(stop)[-1] is RequestState.COMPLETED
    assert driving.states(driving.request)[-1] is RequestState.CANCELLED
    refused = driving.order("resume")
    driving.run(2.0)
    assert driving.states(refused) == [RequestState.FAILED]
    assert max(map(abs, driving.turning_rates)) == 0.0
    reset = driving.order("reset")
    assert driving.until_final(reset, 4.0) is RequestState.COMPLETED
    assert driving.mode is Mode.STANDBY
    assert not any(node.latched for node in driving.nodes.all)
    driving.run(1.0)
    assert driving.mode is Mode.STANDBY
    assert driving.until_final(driving.goto(*driving.pose[:2])) is RequestState.COMPLETED


def test_an_emergency_stop_frame_of_a_node_latches_estop_within_20_ms(driving):
    driving.nodes.wheels[2].assert_stop(StopReason.BUTTON)
    took = driving.until(lambda: driving.mode is Mode.ESTOP, 1.0)
    assert took <= BY_NAME["ESTOP_PRESSED"].detect_s + 0.01
    driving.run(0.3)
    assert standing(driving)
    assert driving.states(driving.request)[-1] is RequestState.FAILED
    assert "ESTOP_PRESSED" in driving.text(driving.request)
    assert driving.until_final(driving.order("reset"), 4.0) is RequestState.COMPLETED
    assert driving.mode is Mode.STANDBY


def test_a_reset_that_a_node_does_not_answer_fails_and_the_stop_holds():
    rover = bench()
    rover.order("emergency_stop")
    rover.run(0.5)
    rover.nodes.wheels[0].hears.clear()
    assert rover.until_final(rover.order("reset"), 4.0) is RequestState.FAILED
    assert rover.mode is Mode.ESTOP


def test_get_ldem_without_a_map_fails_with_help_and_with_one_brings_it_in_standby_and_in_a_scan(known):
    without = bench()
    early = without.order("get", product="ldem")
    without.run(0.3)
    assert without.states(early) == [RequestState.FAILED]
    assert "goto" in without.text(early)
    rover = bench(known)
    data = delivered(rover)
    assert decode_ldem(data).grid.cell_m == pytest.approx(QUICK.mapping.cell_m)
    poses = poses_of(data)
    assert poses.known and poses.pose[:2] == pytest.approx(rover.pose[:2], abs=0.02)
    rover.goto(2.0, 0.5)
    rover.run(0.1)
    assert rover.phase is Phase.SCANNING
    delivered(rover)


def test_a_goto_is_answered_with_the_way_that_the_ground_finds_on_the_map_it_was_sent(known):
    rover = bench(known)
    data = delivered(rover)
    request = rover.goto(3.0, 0.5)
    way = json.loads(received(rover, "way").data)
    rover.run(0.3)
    seen = predict(decode_ldem(data), poses_of(data), (3.0, 0.5), None, rover.rover.config)
    assert {key: way[key] for key in ("station", "request_id", "kind")} == {
        "station": STATION,
        "request_id": request,
        "kind": "goal",
    }
    assert way == json.loads(seen.to_json(station=STATION, request_id=request))
    assert way["length_m"] == pytest.approx(math.dist(rover.pose[:2], (3.0, 0.5)), abs=0.4)
    assert way["path"][-1][:2] == [3.0, 0.5]
    assert rover.text(request) == seen.words


def test_a_goto_into_the_unknown_is_answered_when_the_first_scans_are_in_the_map():
    rover = bench()
    request = rover.goto(2.0, 0.3)
    way = json.loads(received(rover, "way", 30_000).data)
    assert (way["request_id"], way["kind"]) == (request, "goal")
    assert Phase.TURNING in [phase for _, phase in rover.phases]  # it has looked behind


def test_the_way_of_a_goal_that_cannot_be_reached_says_so(known):
    rover = bench(known)
    walls = [
        (f"w{n}", corners)
        for n, corners in enumerate(
            (
                (1.2, -0.8, 1.4, -0.8, 1.4, 0.8, 1.2, 0.8),
                (1.2, 0.6, 2.8, 0.6, 2.8, 0.8, 1.2, 0.8),
                (2.6, -0.8, 2.8, -0.8, 2.8, 0.8, 2.6, 0.8),
                (1.2, -0.8, 2.8, -0.8, 2.8, -0.6, 1.2, -0.6),
            )
        )
    ]
    for name, corners in walls:
        rover.order("fence_add", fence=name, kind="keep_out", corners_m=corners)
    rover.run(0.1)
    request = rover.goto(2.0, 0.0)
    way = json.loads(received(rover, "way").data)
    rover.run(0.3)
    assert (way["kind"], way["length_m"], way["time_s"]) == ("unreachable", None, None)
    assert "no way" in rover.text(request)


def received(rover, name, most=3000):
    """The object of a name that comes down next."""
    receiver = bulk.Receiver(payload_limit(QUICK.link.rate_bps))
    for _ in range(most):
        for kind, payload in rover.step().link_payloads:
            product = receiver.receive(payload, rover.now_ns) if kind == DatagramKind.BULK_CHUNK else None
            if product is not None and product.name == name:
                return product
    raise AssertionError(f"no {name} came")


def delivered(rover):
    """The object that `get ldem` brings, received as the ground does."""
    request = rover.order("get", product="ldem")
    assert rover.until_final(request, 3.0) is RequestState.COMPLETED
    return received(rover, "ldem").data


# -- faults ------------------------------------------------------------------------------------------------------


def test_every_row_of_the_fault_table_has_a_test():
    tests = Path(__file__).parents[2]
    paths = (*(tests / "onboard").rglob("test_*.py"), tests / "hil" / "run" / "test_missions.py")
    text = "".join(path.read_text() for path in paths)
    assert set(TESTED_BY) == {fault.name for fault in FAULTS}
    assert not [name for name in TESTED_BY.values() if f"def {name}(" not in text]


def test_stale_wheel_feedback_stops_the_wheels_within_40_ms_and_they_go_on_by_themselves(driving):
    wheel = driving.nodes.wheels[1]
    wheel.silent = True
    took = driving.until(lambda: standing(driving), 1.0)
    assert took <= BY_NAME["WHEEL_STALE"].detect_s + 0.01  # the first frame that is missing comes a tick later
    assert driving.mode is Mode.AUTONOMOUS
    driving.run(0.05)
    wheel.silent = False
    driving.until(lambda: not standing(driving), 0.1)
    driving.run(0.5)
    assert (driving.mode, driving.phase) == (Mode.AUTONOMOUS, Phase.DRIVING)


def test_a_silent_wheel_leads_to_safe_within_210_ms_with_the_reason(driving):
    driving.nodes.wheels[1].silent = True
    took = driving.until(lambda: driving.mode is Mode.SAFE, 1.0)
    assert took <= BY_NAME["WHEEL_SILENT"].detect_s + 0.01
    assert "WHEEL_SILENT" in driving.told("MODE")[-1][1]
    assert driving.until_final(driving.request, 1.0) is RequestState.FAILED
    assert "WHEEL_SILENT" in driving.text(driving.request)
    refused = driving.order("resume")
    driving.run(0.3)
    assert driving.text(refused) == "still active: WHEEL_SILENT"
    driving.nodes.wheels[1].silent = False
    driving.run(0.3)
    assert driving.mode is Mode.SAFE  # latched
    driving.order("resume")
    driving.run(0.1)
    assert driving.mode is Mode.STANDBY


def test_a_closed_bus_stops_the_wheels_within_50_ms_and_alone_is_named(driving):
    driving.wire.unplug()
    took = driving.until(lambda: not any(order.rate_radps for order in driving.rover.orders), 1.0)
    assert took <= BY_NAME["CAN_BUS_OFF"].detect_s
    for node in driving.nodes.all:
        node.silent = True
    driving.run(2.0)
    told = {text.partition(":")[0] for _, text in driving.told("FAULT")}
    assert told == {"CAN_BUS_OFF"}
    assert driving.mode is Mode.AUTONOMOUS


@pytest.mark.parametrize("name", ["tilt", "imu", "power"])
def test_a_node_without_heartbeat_leads_to_safe_within_1600_ms(name):
    rover = bench()
    rover.run(1.2)
    getattr(rover.nodes, name).silent = True
    rover.until(lambda: rover.mode is Mode.SAFE, 0.5 + BY_NAME["NODE_LOST"].detect_s)
    assert "NODE_LOST" in rover.told("MODE")[-1][1]


def test_a_dead_imu_stops_the_wheels_within_40_ms_and_they_go_on_by_themselves(driving):
    driving.nodes.imu.silent = True
    took = driving.until(lambda: standing(driving), 1.0)
    assert took <= BY_NAME["IMU_DEAD"].detect_s + 0.01
    assert driving.mode is Mode.AUTONOMOUS
    driving.nodes.imu.silent = False
    driving.until(lambda: not standing(driving), 0.1)


@pytest.fixture(scope="module")
def guarded(known):
    rover = bench(known, drive_guard=config.DriveGuard(on=True))
    rover.request = rover.goto(2.8, 0.5)
    rover.until(lambda: rover.pose[0] > 0.6, 60.0)
    rover.put_post(2.3, 0.3)
    return rover


def test_a_thing_put_on_the_way_ends_it_within_200_ms_of_the_second_line_that_meets_it(guarded):
    lines_ns = {}  # when each line that was judged began, by the tick of its verdict
    while not guarded.told("HAZARD"):
        for job in guarded.step().jobs:
            if job.name == "guard_listen":
                lines_ns[job.due_tick] = job.arguments[1][-1].scan.start_ns
    confirming_ns = lines_ns[guarded.tick]
    guarded.until(lambda: guarded.told("FAULT"), 0.1)
    assert guarded.now_ns - confirming_ns <= BY_NAME["HAZARD_AHEAD"].detect_s * 1e9
    assert "HAZARD_AHEAD" in guarded.told("FAULT")[0][1]
    assert guarded.phase is Phase.BACKING_OFF
    assert guarded.rover.twist == (0.0, 0.0, 0.0)


def test_to_back_off_once_more_than_the_row_allows_leads_to_safe_with_the_reason(guarded):
    guarded.rover.executive.mission._backed["HAZARD_AHEAD"] = BY_NAME["HAZARD_AHEAD"].tries
    assert guarded.until_final(guarded.request, 20.0) is RequestState.FAILED
    assert guarded.mode is Mode.SAFE
    assert "backed off 20 times" in guarded.text(guarded.request)


def test_roll_over_the_limit_leads_to_safe_in_the_tick_that_sees_it(driving):
    driving.tilt_rad = 1.2 * QUICK.safety.tilt_limit_rad
    driving.until(lambda: abs(driving.rover.localisation.pose.roll_rad) > QUICK.safety.tilt_limit_rad, 60.0)
    assert driving.mode is Mode.SAFE
    assert "TILT_ANGLE" in driving.told("MODE")[-1][1]


def lose_the_pose(rover):
    """Registrations are refused until the filter does not know where it is."""
    localisation = rover.rover.localisation
    refused = RegistrationResult(False, "", localisation.pose.matrix(), np.eye(4), False, 0.0, 0.0, 0.0, 0.0, ())
    while localisation.sigma[0] <= QUICK.safety.pose_sigma_m:
        localisation.register(refused)


def test_a_pose_that_grows_unsure_ends_the_way_with_a_look_that_mends_it(driving):
    driving.until(lambda: not standing(driving), 10.0)
    driving.run(3.0)
    lose_the_pose(driving)
    before = len(driving.phases)
    driving.run(0.12)
    assert any("POSE_UNSURE" in text for _, text in driving.told("FAULT"))
    driving.until_driving()
    seen = [phase for _, phase in driving.phases[before:]]
    assert [phase for phase in seen if phase is not Phase.BACKING_OFF][:2] == [Phase.SCANNING, Phase.MAPPING]
    assert "POSE_UNSURE" in driving.told("FAULT_CLEARED")[-1][1]
    assert driving.rover.localisation.sigma[0] < 0.05
    assert driving.mode is Mode.AUTONOMOUS


def test_a_pose_that_a_look_does_not_mend_leads_to_safe_with_the_reason(known):
    rover = bench(known, localisation=config.Localisation(gate_m=0.01, gate_rad=0.01, start_x_m=0.2))
    request = rover.goto(3.0, 0.5)
    rover.until_driving()
    lose_the_pose(rover)
    rover.until(lambda: rover.mode is Mode.SAFE, 60.0)
    assert standing(rover)
    assert "POSE_UNSURE" in rover.told("MODE")[-1][1]
    assert "a look did not help" in rover.text(request)


def test_without_contact_the_leg_is_finished_then_the_rover_stands_by_and_says_so(known):
    rover = bench(known, safety=config.Safety(command_lost_ns=12_000_000_000), mission=config.Mission(leg_m=1.0))
    request = rover.goto(4.0, 0.5)
    rover.until_driving()
    rover.until(lambda: any("COMMAND_LOST" in text for _, text in rover.told("FAULT")), 60.0)
    at_s = rover.now_ns / 1e9
    assert at_s == pytest.approx(2.0 + 12.0, abs=BY_NAME["COMMAND_LOST"].detect_s)
    was_driving = rover.phase in (Phase.DRIVING, Phase.TURNING)
    assert was_driving
    assert rover.until_final(request, 60.0) is RequestState.FAILED
    assert "no authenticated contact" in rover.text(request)
    assert rover.mode is Mode.STANDBY
    assert rover.now_ns / 1e9 > at_s + 0.5


def test_contact_before_the_leg_ends_lets_the_mission_go_on(known):
    rover = bench(known, safety=config.Safety(command_lost_ns=12_000_000_000), mission=config.Mission(leg_m=1.0))
    request = rover.goto(1.6, 0.2)
    rover.until(lambda: rover.told("FAULT"), 60.0)
    assert rover.phase is Phase.DRIVING
    while not rover.states(request)[-1].final and rover.now_ns < 200e9:
        contact(rover)
        rover.run(1.0)
    assert ("FAULT_CLEARED", "COMMAND_LOST") in [(e.name, e.text) for e in rover.events]
    assert rover.states(request)[-1] is RequestState.COMPLETED


def test_a_late_job_is_reported_while_it_is_late():
    rover = bench()
    rover.job_late_ticks = 30
    rover.goto(3.0, 0.5)
    rover.until_phase(Phase.MAPPING)
    rover.until(lambda: rover.told("FAULT"), 1.0)
    assert rover.told("FAULT")[0][1].startswith("JOB_LATE")
    rover.until(lambda: rover.told("FAULT_CLEARED"), 1.0)
    assert rover.mode is Mode.AUTONOMOUS
    assert rover.rover.jobs.late_ticks == 30


def test_a_job_that_never_comes_ends_the_mission_in_safe_with_its_name(monkeypatch):
    monkeypatch.setattr("onboard.core.jobs.GIVE_UP_TICKS", 40)
    rover = bench()
    rover.job_late_ticks = 10**9
    request = rover.goto(3.0, 0.5)
    rover.until(lambda: rover.mode is Mode.SAFE, 30.0)
    assert rover.states(request)[-1] is RequestState.FAILED
    assert rover.text(request).startswith("look: no result")
    assert rover.rover.jobs.running == ()


def test_a_lidar_silent_in_mid_sweep_discards_the_sweep_and_scans_again():
    rover = bench()
    rover.goto(3.0, 0.5)
    rover.until(lambda: rover.lidar.scans > 30, 20.0)
    rover.lidar_plugged = False
    begin_s = rover.now_ns / 1e9
    rover.until(lambda: rover.told("FAULT"), 1.0)
    at_s, text = rover.told("FAULT")[0]
    assert text.startswith("LIDAR_SILENT")
    assert at_s - begin_s <= 0.025 + BY_NAME["LIDAR_SILENT"].detect_s + 0.01
    rover.run(3.0)
    rover.lidar_plugged = True
    rover.until_phase(Phase.MAPPING, 40.0)
    assert rover.told("FAULT_CLEARED")[-1][1] == "LIDAR_SILENT"
    assert rover.rover.executive.mission.scans_taken == 1


def test_a_lidar_that_stays_silent_fails_the_mission_after_3_new_tries():
    rover = bench()
    request = rover.goto(3.0, 0.5)
    rover.until(lambda: rover.lidar.scans > 30, 20.0)
    rover.lidar_plugged = False
    assert rover.until_final(request, 60.0) is RequestState.FAILED
    assert "LIDAR_SILENT" in rover.text(request)
    assert (rover.mode, rover.phase) == (Mode.SAFE, Phase.FAILED)
    rover.run(0.1)
    assert rover.rover.executive.active == ()


# -- wheel faults: what is done about them -------------------------------------------------------------------------


def jam(rover, n):
    rover.nodes.wheels[n - 1].encoder = Encoder.DEAD  # what the ideal ground here can show of a stuck wheel
    rover.nodes.wheels[n - 1].drive_stuck = True


def test_a_stuck_wheel_ends_the_way_with_a_scan_and_a_second_one_is_the_end(driving):
    jam(driving, 2)
    driving.until(lambda: driving.told("FAULT"), 1.5)
    assert driving.told("FAULT")[0][1].startswith("WHEEL_STUCK: ") and driving.told("FAULT")[0][1].endswith("(wheel 2)")
    driving.until_phase(Phase.SCANNING, 5.0)
    assert driving.mode is Mode.AUTONOMOUS
    assert driving.rover.wheels[1].drive is DriveHealth.STUCK
    driving.until_phase(Phase.DRIVING)
    driving.until(lambda: abs(driving.turning_rates[2]) > 0.3, 20.0)
    jam(driving, 3)
    driving.until(lambda: driving.mode is Mode.SAFE, 3.0)
    assert driving.told("FAULT")[-1][1].endswith("(wheel 2, 3)")


def test_without_leave_for_a_degraded_drive_a_stuck_wheel_leads_to_safe_and_resume_is_refused(known):
    rover = bench(known, safety=config.Safety(degraded_drive=False))
    goto = rover.goto(3.0, 0.5)
    rover.until_driving()
    jam(rover, 4)
    rover.until(lambda: rover.mode is Mode.SAFE, 1.5)
    assert "WHEEL_STUCK" in rover.text(goto)
    refused = rover.order("resume")
    rover.run(0.3)
    assert rover.text(refused) == "still active: WHEEL_STUCK"


def test_a_rover_that_does_not_move_backs_off_three_times_at_most_then_is_safe(driving):
    driving.grip = 0.0
    driving.until(lambda: driving.mode is Mode.SAFE, 300.0)
    found = [text for _, text in driving.told("FAULT") if text.startswith("NOT_MOVING")]
    assert len(found) == BY_NAME["NOT_MOVING"].tries + 1
    assert "NOT_MOVING" in driving.told("MODE")[-1][1]
