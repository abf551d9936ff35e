"""`onboard calibrate`: what a drive shows is found, what it cannot show is named, and nothing moves unasked."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from hil.devices.can.command import faulty
from hil.devices.can.wheels_off_ground import Stand
from hil.devices.lidar.profile import IDEAL, stamp_to_first_byte_ns
from hil.faults.build_errors import BuildErrors, drawn
from onboard.__main__ import app
from onboard.bringup.calibrate.drive import CalibrationDrive
from onboard.bringup.calibrate.estimate import estimate
from onboard.bringup.calibrate.model import CALIBRATED, believed
from onboard.bringup.calibrate.plan import lag_steps, room_m, square
from onboard.bringup.calibrate.report import toml
from onboard.bringup.calibrate.shell import again
from onboard.bringup.can.moving.jog import Phase
from onboard.bringup.lidar.lag_report import LagReport
from onboard.config import Can, Config, Record, Rover, load
from onboard.devices.nodes import Nodes
from onboard.perception.scan.tilt_lag import Lag
from onboard.record.writer import Recorder
from onboard.records import WheelCommand, WheelMode
from protocol.generated.can_codec import TABLE
from tests.onboard.calibrate_rig import Yard
from tests.onboard.calibrate_twin import SQUARE, drive
from tests.onboard.stand_clock import StandClock, VirtualEnd, handlers_kept

LAST = len(lag_steps(Config())) + 3  # the step in which the drive below is stopped: a turn
DIAGONAL = "steer_1 - steer_2 + steer_3 - steer_4"
ERRORS = BuildErrors(1.02, (0.03, -0.01, -0.03, 0.01), (0.01, 0.0, -0.01), (0.02, -0.03, 0.01), (0.015, -0.01, 0.0))


def off(found, built):
    return dict(zip(CALIBRATED, np.array([value.after for value in found.values]) - believed(built)))


def test_a_drive_without_noise_gives_every_value_that_it_shows():
    built = ERRORS.built(Rover())
    found = estimate(drive(built, SQUARE), Rover())
    assert found.misfit < 0.02 and found.odd_pairs == 0
    assert all(abs(error) < (1e-4 if key.endswith("_m") else 1e-3) for key, error in off(found, built).items())


def test_a_second_calibration_that_begins_with_the_first_finds_the_same():
    built = ERRORS.built(Rover())
    first = estimate(drive(built, SQUARE), Rover())
    again = estimate(drive(built, SQUARE), first.applied(Rover()))
    assert [v.after for v in again.values] == pytest.approx([v.after for v in first.values], abs=1e-3)


def test_steering_that_is_off_crosswise_is_named_as_not_seen_and_keeps_the_drawing():
    crosswise = (0.03, -0.03, 0.03, -0.03)
    found = estimate(drive(BuildErrors(steer_rad=crosswise).built(Rover()), SQUARE), Rover())
    assert DIAGONAL in found.unobserved
    steers = [value.after for value in found.values if value.key.startswith("steer")]
    pattern = np.dot(steers, np.sign(crosswise)) / 4
    assert abs(pattern) < 0.003  # nothing of the 0.03 rad


def test_without_crabs_left_against_right_rests_on_the_turns_alone():
    sigmas = [
        {value.key: value.sigma for value in estimate(drive(Rover(), legs), Rover()).values}
        for legs in (SQUARE, tuple(leg for leg in SQUARE if leg[1] == 0.0 and leg[2] == 0.0))
    ]
    assert sigmas[1]["steer_1_offset_rad"] > sigmas[0]["steer_1_offset_rad"]
    assert sigmas[1]["lidar_x_m"] > 5 * sigmas[0]["lidar_x_m"]  # no turn, no place of the scanner


def test_a_scan_aligned_to_the_wrong_rocks_is_left_out():
    built = ERRORS.built(Rover())
    evidence = drive(built, SQUARE)
    ways_m = evidence.pairs.ways_m.copy()
    ways_m[3] += (0.0, 0.2, 0.0)
    found = estimate(replace(evidence, pairs=evidence.pairs._replace(ways_m=ways_m)), Rover())
    assert found.odd_pairs == 1
    assert all(abs(error) < 2e-3 for error in off(found, built).values())


def test_the_toml_it_writes_is_a_configuration_that_knows_the_rover(tmp_path):
    built = ERRORS.built(Rover())
    found = estimate(drive(built, SQUARE), Rover())
    path = tmp_path / "calibrated.toml"
    path.write_text(toml(found, LagReport(Lag(0.003, 1e-4, 9000, 0.0, 1e-5), 20_700_000), "a test"))
    assert load(path).lidar.latency_ns == 23_700_000
    assert believed(load(path).rover) == pytest.approx([value.after for value in found.values], abs=1e-6)


# -- the keys are used -----------------------------------------------------------------------------------------


def test_an_order_leaves_less_the_offset_of_its_steering_unit():
    nodes = Nodes(Rover(steer_2_offset_rad=0.03), Can())
    nodes.set_wheels([WheelCommand(WheelMode.RUN, 0.2, 0.5)] * 4)
    sent = {frame.can_id: TABLE[frame.can_id].decode(frame.data) for frame in nodes.send(10_000_000, 1)}
    assert [sent[0x100 + n].steer_rad for n in (1, 2, 3, 4)] == pytest.approx([0.2, 0.17, 0.2, 0.2], abs=1e-4)


def test_an_order_at_the_end_of_the_range_stays_in_the_units_range():
    rover = Rover(steer_1_offset_rad=-0.1)
    nodes = Nodes(rover, Can())
    nodes.set_wheels([WheelCommand(WheelMode.RUN, rover.steer_limit_rad, 0.0)] * 4)
    sent = {frame.can_id: TABLE[frame.can_id].decode(frame.data) for frame in nodes.send(10_000_000, 1)}
    assert sent[0x101].steer_rad == pytest.approx(rover.steer_limit_rad, abs=1e-4)


# -- the drive and the command ---------------------------------------------------------------------------------


def test_the_drive_ends_where_it_began_and_scans_after_each_motion():
    steps = square(1.5)
    assert [step.scans for step in steps] == [True, False] * 10 + [True]
    x = y = yaw = far = 0.0
    for step in steps:
        ahead, left = (step.amount * np.sign(v) for v in step.twist[:2])
        x, y = x + ahead * math.cos(yaw) - left * math.sin(yaw), y + ahead * math.sin(yaw) + left * math.cos(yaw)
        yaw, far = yaw + step.amount * np.sign(step.twist.yaw_radps), max(far, math.hypot(x, y))
    assert (x, y, math.remainder(yaw, math.tau)) == pytest.approx((0, 0, 0), abs=1e-9) and far < room_m(1.5)


@pytest.mark.parametrize(("words", "code", "told"), [
    (["--side", "9"], 64, "within 0.5 and 5"),
    (["--from", "nowhere.mcap"], 66, "no record"),
    (["--from", "."], 66, "Is a directory"),
    (["--config", "nowhere.toml"], 66, "no configuration file"),
    (["--bus", "can0"], 78, "can.uri"),
])  # fmt: skip
def test_what_is_asked_wrongly_ends_with_its_code(words, code, told, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(app, ["calibrate", *words])
    assert result.exit_code == code and told in result.output


@pytest.fixture(scope="module")
def begun(tmp_path_factory):
    """A drive that is stopped while it turns, after a side and two scans; its record; all frames it sent."""
    path = tmp_path_factory.mktemp("calibrate") / "drive.mcap"
    built = BuildErrors(wheel_radius_ratio=1.02, lidar_rad=(0.02, -0.01, 0.0), imu_rad=(0.0, 0.02, 0.0)).built(Rover())
    config = replace(Config(), record=Record(str(path)))
    sent = []

    def observe(world, machine):
        if machine.at == LAST and abs(world.state.angular_radps[2]) > 0.15:
            machine.stop()

    class Tapped(Yard):
        def hear(self, frames, lidar_bytes, now_ns):
            sent.extend(frames)
            super().hear(frames, lidar_bytes, now_ns)

    yard = Tapped(built)
    try:
        with Recorder(config, None) as recorder:
            machine = yard.run(CalibrationDrive(config, 0.5), observe, recorder)
        yield machine, yard, path, sent, built
    finally:
        yard.free()


def test_a_drive_that_is_stopped_ends_at_rest_with_wheels_off_and_the_drives_disabled(begun):
    machine, yard, _, sent, _ = begun
    assert machine.problem == "" and machine.stopped and not machine.complete and machine.at == LAST
    assert all(abs(wheel.rate_radps) < 0.01 for wheel in yard.state.wheels)
    orders = [TABLE[frame.can_id].decode(frame.data) for frame in sent if 0x101 <= frame.can_id <= 0x104][-4:]
    enables = [TABLE[frame.can_id].decode(frame.data) for frame in sent if frame.can_id == 0x100]
    assert {order.mode for order in orders} == {WheelMode.OFF} and enables[-1].enable == 0


def test_nothing_is_sent_before_the_operator_agrees():
    drive = CalibrationDrive(Config(), 1.0)
    yard = Yard(Rover())
    try:
        outputs = [drive.tick(yard.inputs(10_000_000))]
        for tick in range(2, 200):
            yard.advance((tick + 1) * 10_000_000)
            outputs.append(drive.tick(yard.inputs(tick * 10_000_000)))
    finally:
        yard.free()
    assert drive.phase is Phase.READY
    assert not any(out.can_frames or out.lidar_bytes or out.lidar_connect for out in outputs)


def test_the_record_of_a_drive_gives_the_drive_again_up_to_where_it_was_stopped(begun):
    machine, _, path, _, _ = begun
    first, second = machine.log, again(path).log
    rows = len(first.time_s)
    for name in ("step", "time_s", "standing", "position_rad", "steer_rad", "gyro_radps", "accel_mps2"):
        assert np.array_equal(getattr(first, name), getattr(second, name)[:rows])
    assert all(np.array_equal(a, b) for a, b in zip(first.clouds, second.clouds) if a is not None)


def test_one_side_of_the_square_is_enough_for_the_scanners_tilt(begun):
    *_, path, _, built = begun
    result = CliRunner().invoke(app, ["calibrate", "--from", str(path), "--out", str(path.with_suffix(".toml"))])
    assert result.exit_code == 0, result.output
    rover = load(path.with_suffix(".toml")).rover
    for key in ("lidar_roll_rad", "lidar_pitch_rad"):
        assert getattr(rover, key) == pytest.approx(getattr(built, key), abs=0.003)
    assert "lidar_yaw" in result.output.split("not seen:")[1]  # nothing turned: base and scanner share one heading


def test_the_drive_finds_that_the_latency_is_not_this_scanners_and_writes_what_is(begun):
    machine, _, path, _, _ = begun
    out = path.with_name("lag.toml")
    result = CliRunner().invoke(app, ["calibrate", "--from", str(path), "--json", "--out", str(out)])
    assert result.exit_code == 0, result.output
    own_ns = stamp_to_first_byte_ns(IDEAL)  # 3.95 ms less than the default
    assert load(out).lidar.latency_ns == pytest.approx(own_ns, abs=200_000)
    told = json.loads(result.stdout)["lag"]
    assert told["latency_before_ns"] == machine.latency_ns == 23_700_000
    assert told["late_s"] == pytest.approx(-3.95e-3, abs=2e-4)


def test_the_lag_is_taken_out_of_the_scans_before_they_are_weighed(begun):
    machine, _, _, _, _ = begun
    scan = len(lag_steps(Config()))
    log = machine.log
    raw, moved = machine._logger._cloud(scan, 0), log.clouds[scan]
    _, first, second = np.intersect1d(raw[:, 1], moved[:, 1], return_indices=True)  # a tilt leaves y as it is
    tilts = [np.arctan2(-cloud[:, 2], cloud[:, 0]) for cloud in (raw[first], moved[second])]
    rate_radps = np.median(tilts[1] - tilts[0]) / -log.lag.late_s
    assert len(first) > 0.9 * len(raw)
    assert math.radians(-20) < rate_radps < math.radians(-1)  # upwards, as a sweep goes
    assert all(log.clouds[step] is None for step in range(scan))


def test_a_record_of_a_drive_from_before_the_sweeps_is_taken_as_it_was_driven():
    drive = CalibrationDrive(Config(), 1.0, with_lag=False)
    assert drive.steps == square(1.0)
    assert drive.log.lag == "the drive has no sweeps down and up"


@pytest.fixture
def on_stand(monkeypatch, tmp_path):
    """The command on the rover's nodes with the wheels off the ground, time by hand, and no scanner at its address."""
    monkeypatch.chdir(tmp_path)
    end, clocks = VirtualEnd("calibrate"), []

    def invoke(faults, answer):
        clocks.append(StandClock(faulty(Stand(), faults), end))
        monkeypatch.setattr("onboard.drivers.platform.clock.WallClock", lambda: clocks[-1])
        words = ["calibrate", "--bus", end.uri, "-s", "lidar.address=tcp:127.0.0.1:1"]
        with handlers_kept():
            return CliRunner().invoke(app, words, input=answer), clocks[-1].heard

    yield invoke
    end.close()


@pytest.mark.parametrize(("faults", "answer", "code", "told"), [
    (["silent=IMU"], "y\n", 69, "refused, nothing was sent: IMU is not heard"),
    (["stop=POWER"], "y\n", 69, "asserts an EMERGENCY_STOP"),
    ([], "n\n", 130, "ended before anything moved"),
])  # fmt: skip
def test_a_drive_that_is_refused_or_not_agreed_to_sends_nothing(on_stand, faults, answer, code, told):
    result, heard = on_stand(faults, answer)
    assert result.exit_code == code and told in result.output and heard == []
    assert not Path("calibrate.mcap").exists()


def test_a_rover_without_a_scanner_never_rolls_and_is_told_so(on_stand):
    result, heard = on_stand([], "y\n")
    assert result.exit_code == 1 and "gives no whole scan" in result.output
    orders = [TABLE[frame.can_id].decode(frame.data) for frame in heard if 0x101 <= frame.can_id <= 0x104]
    assert {order.rate_radps for order in orders} == {0.0} and orders[-1].mode == WheelMode.OFF
    again_result, _ = on_stand([], "y\n")
    assert again_result.exit_code == 73 and "calibrate.mcap is there already" in again_result.output


def test_errors_drawn_by_chance_are_the_same_for_a_seed():
    assert drawn(4) == drawn(4) != drawn(5)
