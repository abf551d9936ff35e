"""Orders beyond goto and stop, seen from outside: scan, turn, drive, several goals, masks, time, reboot."""

import math

import pytest

from hil.devices.can.nodes import Encoder
from onboard import config
from onboard.drivers.storage.map_tiles import Keeper, load
from onboard.records import LinkMessage
from protocol.link.datagrams import DatagramKind
from protocol.link.transactions import RequestState
from protocol.tables import commands
from protocol.tables.faults import BY_NAME, FAULTS
from protocol.tables.modes import TRANSITIONS, Mode, Phase
from tests.onboard.core_bench import STATION, CoreBench, first_map, quick

pytestmark = pytest.mark.copied


@pytest.fixture(scope="module")
def known():
    return first_map()


@pytest.fixture(scope="module")
def standing(known):
    rover = CoreBench(memory=known)
    rover.settle()
    return rover


def drive(rover, vx=0.1, vy=0.0, yaw=0.0, duration=20.0, distance=1.0):
    return rover.order("drive", vx_mps=vx, vy_mps=vy, yaw_radps=yaw, duration_s=duration, distance_m=distance)


# -- moves -----------------------------------------------------------------------------------------------------


def test_a_drive_ends_at_its_distance_and_says_how_far_and_how_long(standing):
    request = drive(standing, distance=0.5)
    standing.step()
    assert standing.mode is Mode.TELEOP
    assert standing.until_final(request) is RequestState.COMPLETED
    standing.run(2.0)  # it stands when it says so: nothing is added
    assert standing.pose[0] == pytest.approx(0.5, abs=0.01)
    assert standing.text(request).startswith("0.50 m in ") and standing.mode is Mode.STANDBY
    assert standing.rates == [0.0] * 4


def test_a_drive_ends_at_its_duration_though_the_distance_is_not_reached(standing):
    request = drive(standing, duration=3.0, distance=5.0)
    begun_s = standing.now_ns / 1e9
    standing.until(lambda: standing.rover.twist.vx_mps > 0.0, 1.0)
    standing.until(lambda: standing.rover.twist.vx_mps == 0.0, 5.0)
    assert standing.now_ns / 1e9 - begun_s == pytest.approx(3.0, abs=0.05)
    assert standing.until_final(request) is RequestState.COMPLETED
    assert standing.now_ns / 1e9 - begun_s < 4.5 and 0.1 < standing.pose[0] < 0.31


def test_a_drive_tells_its_progress_every_five_seconds(standing):
    request = drive(standing, duration=12.0, distance=5.0)
    standing.until_final(request)
    assert standing.states(request) == [
        RequestState.STARTED,
        RequestState.PROGRESS,
        RequestState.PROGRESS,
        RequestState.COMPLETED,
    ]


def test_a_second_drive_replaces_the_first_and_a_stop_ends_it(standing):
    first = drive(standing)
    standing.run(2.0)
    second = drive(standing, vx=-0.1)
    standing.run(2.0)
    assert standing.states(first)[-1] is RequestState.CANCELLED and standing.mode is Mode.TELEOP
    standing.order("stop")
    standing.run(0.02)
    assert standing.mode is Mode.STANDBY and standing.rates == [0.0] * 4
    assert standing.states(second)[-1] is RequestState.CANCELLED


def test_a_turn_ends_at_its_heading_where_the_rover_stands(standing):
    request = standing.order("turn", heading_rad=math.pi / 2)
    assert standing.until_final(request) is RequestState.COMPLETED
    assert standing.pose[2] == pytest.approx(math.pi / 2, abs=math.radians(3))
    assert math.hypot(*standing.pose[:2]) < 0.05


def test_a_goto_is_refused_while_the_operator_drives_and_says_why(standing):
    drive(standing)
    standing.step()
    request = standing.goto(3.0, 0.5)
    standing.run(0.1)
    assert standing.states(request) == [RequestState.FAILED]
    assert standing.text(request).startswith("goto is refused in TELEOP: it needs STANDBY, AUTONOMOUS; allowed now: ")


def test_a_fault_that_stops_the_rover_ends_the_operators_drive_and_a_new_one_is_refused_while_it_lasts(standing):
    request = drive(standing)
    standing.run(3.0)
    standing.nodes.imu.silent = True
    standing.until(lambda: standing.mode is Mode.STANDBY, 1.0)
    standing.step()
    assert standing.states(request)[-1] is RequestState.FAILED and standing.text(request).startswith("IMU_DEAD")
    assert standing.rates == [0.0] * 4
    again = drive(standing)
    standing.run(0.1)
    assert "held by a fault" in standing.text(again)


def test_an_emergency_stop_in_mid_drive_takes_the_wheels_off(standing):
    request = drive(standing)
    standing.run(3.0)
    standing.order("emergency_stop")
    standing.run(0.1)
    assert standing.mode is Mode.ESTOP and standing.states(request)[-1] is RequestState.CANCELLED


# -- scan, mission, map ----------------------------------------------------------------------------------------


def test_a_scan_is_one_sweep_where_the_rover_stands_and_ends_in_the_map():
    rover = CoreBench()
    rover.settle()
    request = rover.order("scan")
    rover.step()
    assert rover.mode is Mode.AUTONOMOUS and rover.phase is Phase.SCANNING
    assert rover.until_final(request) is RequestState.COMPLETED
    assert [phase for _, phase in rover.phases] == [Phase.SCANNING, Phase.MAPPING, Phase.NONE]
    assert rover.mode is Mode.STANDBY and rover.told("SCANNED")
    assert (rover.rover.executive.memory.cells.n > 0).sum() > 1000
    assert math.hypot(*rover.pose[:2]) == 0.0


def test_a_mission_reaches_its_goals_in_their_order_and_tells_each(known):
    rover = CoreBench(memory=known)
    rover.settle()
    goals = (0.8, 0.0, 0.3, 0.4)
    request = rover.order("mission", goals_m=goals)
    assert rover.until_final(request, 200.0) is RequestState.COMPLETED
    assert math.dist(rover.pose[:2], goals[2:]) <= 0.3
    told = list(dict.fromkeys(r.text for _, r in rover.reports if r.state is RequestState.PROGRESS))
    assert [text.split()[0] for text in told] == ["predicted", "goal", "predicted"]
    assert told[1].startswith("goal 1 of 2: ") and rover.text(request).startswith("all 2 goals; ")


def test_status_tells_what_waits_for_its_start_time(standing):
    sent = commands.Telecommand(77, 0, 0, "turn", {"heading_rad": 0.5}, 900_000_000_000)
    standing.hear(LinkMessage(standing.now_ns, True, "ok", STATION, DatagramKind.TELECOMMAND, commands.encode(sent)))
    standing.run(0.1)
    request = standing.order("status")
    standing.run(0.3)
    assert standing.text(request).endswith(f"; 1 wait: turn at 900.0 s ({STATION}#77)")


def test_a_scan_is_enough_for_a_map_that_can_be_fetched():
    rover = CoreBench()
    rover.settle()
    assert rover.until_final(rover.order("scan"), 60.0) is RequestState.COMPLETED
    assert rover.until_final(rover.order("get", product="ldem"), 5.0) is RequestState.COMPLETED


def test_a_cleared_map_makes_the_next_goto_scan_ahead_and_behind(standing):
    request = standing.order("map_clear")
    standing.run(0.1)
    assert standing.states(request) == [RequestState.COMPLETED] and standing.rover.executive.memory is None
    standing.goto(3.0, 0.5)
    standing.until_phase(Phase.PLANNING)
    assert standing.rover.executive.mission.scans_taken == 2


def test_a_cleared_map_leaves_the_disk_too(known, tmp_path):
    keeper = Keeper(str(tmp_path), None, print)
    keeper.keep(known)
    keeper.keep(None)
    keeper.close()
    assert load(tmp_path).files == ()


# -- masks -----------------------------------------------------------------------------------------------------


def mask(rover, fault, lasting_s=5.0):
    request = rover.order("faults_mask", fault=fault, lasting_s=lasting_s)
    rover.run(0.1)
    return request


def test_a_masked_row_is_told_and_its_response_not_taken_until_the_mask_ends(standing):
    request = mask(standing, "NODE_LOST", 10.0)
    assert standing.states(request) == [RequestState.COMPLETED]
    standing.nodes.power.silent = True
    standing.run(5.0)
    assert standing.mode is Mode.STANDBY and not standing.told("FAULT")
    assert any(text.startswith("NODE_LOST is active; masked until ") for _, text in standing.told("FAULT_MASKED"))
    listed = standing.order("faults_list")
    standing.run(0.1)
    assert standing.text(listed) == "active: NODE_LOST; masked: NODE_LOST for 5 s"
    standing.run(5.0)
    assert standing.mode is Mode.SAFE and standing.told("FAULT")
    assert standing.told("FAULT_MASKED")[-1][1] == "NODE_LOST no longer: its time is over"


def test_a_cleared_mask_ends_at_once(standing):
    mask(standing, "NODE_LOST", 3600.0)
    standing.nodes.power.silent = True
    standing.run(3.0)
    request = standing.order("faults_clear", fault="NODE_LOST")
    standing.run(0.1)
    assert standing.states(request)[-1] is RequestState.COMPLETED and standing.mode is Mode.SAFE


@pytest.mark.parametrize("row", [row for row in FAULTS if not row.maskable], ids=lambda row: row.name)
def test_a_row_that_guards_life_is_never_masked(standing, row):
    request = mask(standing, row.name)
    assert standing.states(request) == [RequestState.FAILED] and "guards life" in standing.text(request)
    listed = standing.order("faults_list")
    standing.run(0.1)
    assert standing.text(listed).endswith("masked: none")


def test_the_rows_that_stop_for_people_and_for_the_rovers_life_are_not_maskable():
    life = {"ESTOP_PRESSED", "TILT_ANGLE", "WHEEL_STALE", "WHEEL_SILENT", "CAN_BUS_OFF", "HAZARD_AHEAD", "NODE_TWICE"}
    assert not [name for name in life if BY_NAME[name].maskable]


def test_a_wheel_that_was_found_bad_is_judged_anew_once_its_finding_is_cleared(standing):
    standing.nodes.wheels[1].encoder = Encoder.DEAD
    drive(standing, duration=60.0, distance=3.0)
    standing.until(lambda: not standing.rover.wheels[1].encoder, 30.0)
    standing.order("stop")
    standing.step()
    standing.nodes.wheels[1].encoder = Encoder.GOOD
    request = standing.order("faults_clear", fault="ENCODER_BAD")
    standing.run(0.1)
    assert standing.states(request) == [RequestState.COMPLETED] and standing.rover.wheels[1].encoder
    drive(standing, duration=10.0, distance=3.0)
    standing.run(10.0)
    assert standing.rover.wheels[1].encoder and "ENCODER_BAD" not in standing.rover.executive.active


# -- time and reboot -------------------------------------------------------------------------------------------


def test_the_time_is_told_in_onboard_seconds(standing):
    request = standing.order("time")
    standing.run(0.1)
    (report,) = {r for _, r in standing.reports if r.request_id == request}
    assert report.data[0] == pytest.approx(standing.now_ns / 1e9, abs=0.11) and "UTC is not known" in report.text


def test_a_reboot_ends_the_program_once_both_copies_of_its_report_are_out(standing):
    request = standing.order("reboot")
    ticks = 0
    while not standing.step().reboot:
        ticks += 1
        assert ticks < 200
    assert ticks == 100
    assert len([r for _, r in standing.reports if r.request_id == request]) == 2


@pytest.mark.parametrize("name", ["goto", "turn"])
def test_a_moving_rover_is_not_rebooted(standing, name):
    standing.order(name, **({"x_m": 2.0, "y_m": 0.0} if name == "goto" else {"heading_rad": 1.0}))
    standing.step()
    request = standing.order("reboot")
    standing.run(0.1)
    assert standing.states(request) == [RequestState.FAILED]


def test_an_order_for_later_begins_at_its_time_unless_a_stop_comes_before(standing):
    for request_id, stop in ((900, False), (901, True)):
        start_ns = standing.now_ns + 2_000_000_000
        sent = commands.Telecommand(request_id, 0, 0, "turn", {"heading_rad": 1.5 if stop else 0.8}, start_ns)
        standing.hear(
            LinkMessage(standing.now_ns, True, "ok", STATION, DatagramKind.TELECOMMAND, commands.encode(sent))
        )
        standing.run(1.0)
        if stop:
            standing.order("stop")
        standing.run(1.1)
        assert (standing.mode is Mode.TELEOP) is not stop
        standing.order("stop")
        standing.run(0.5)
    assert standing.states(901)[-1] is RequestState.CANCELLED


# -- the transition table, flown -------------------------------------------------------------------------------

ARGUMENTS = {
    "goto": {"x_m": 3.0, "y_m": 0.5},
    "mission": {"goals_m": (3.0, 0.5)},
    "turn": {"heading_rad": 1.0},
    "drive": {"vx_mps": 0.1, "vy_mps": 0.0, "yaw_radps": 0.0, "duration_s": 20.0, "distance_m": 2.0},
}
ARGUMENTS["sequence_run"] = {"sequence": "stay"}
INTO = {
    Mode.SEQUENCE: "sequence_run",
    Mode.AUTONOMOUS: "goto",
    Mode.TELEOP: "drive",
    Mode.SAFE: "safe",
    Mode.ESTOP: "emergency_stop",
}
COMMANDED = {row.name for row in commands.TABLE} & {t.event for t in TRANSITIONS}
PAIRS = [(mode, name) for mode in Mode if mode is not Mode.BOOT for name in sorted(COMMANDED)]


@pytest.fixture(scope="module")
def rovers(known):
    """A rover in each mode."""
    made = {}
    for mode in (mode for mode in Mode if mode is not Mode.BOOT):
        rover = made[mode] = CoreBench(memory=known, settings=quick(safety=config.Safety(tilt_limit_rad=0.5)))
        rover.settle()
        rover.order("sequence_upload", sequence="stay", number=1, line="after 60")
        rover.step()
        if mode in INTO:
            rover.order(INTO[mode], **ARGUMENTS.get(INTO[mode], {}))
            rover.run(0.2)
        assert rover.mode is mode
    return made


@pytest.mark.parametrize(("mode", "name"), PAIRS, ids=lambda part: part if isinstance(part, str) else part.name)
def test_every_command_that_changes_the_mode_does_so_where_the_table_says_and_is_refused_elsewhere(rovers, mode, name):
    rover = rovers[mode]
    request = rover.order(name, **ARGUMENTS.get(name, {}))
    rover.run(2.0 if name == "reset" else 0.05)
    wanted = next((t.next for t in TRANSITIONS if (t.state, t.event) == (mode, name)), None)
    assert rover.mode is (mode if wanted is None else wanted)
    if mode not in commands.command(name).modes:
        assert rover.states(request) == [RequestState.FAILED] and f"refused in {mode.name}" in rover.text(request)
