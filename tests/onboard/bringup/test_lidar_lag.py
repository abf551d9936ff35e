"""`onboard lidar lag`: 3 ms are found on the bench's emulators, live and from a record; what cannot be seen is said."""

import json
import math
from dataclasses import replace

import pytest
from click.testing import CliRunner

from hil.devices.can.command import faulty
from hil.devices.can.errors import SensorErrors, TiltErrors
from hil.devices.can.nodes import build_nodes
from hil.devices.can.wheels_off_ground import Stand
from hil.devices.lidar.profile import IDEAL, UTM30LX, stamp_to_first_byte_ns
from hil.scenarios.model import Scenario, flight_settings, measured_latency
from onboard.__main__ import app
from onboard.bringup.lidar.lag_report import LagReport
from onboard.bringup.lidar.lag_sweeps import LagSweeps
from onboard.bringup.lidar.sweeps import RecordedSweep, standing
from onboard.config import Config, Lidar, Record, Rover, Scanning
from onboard.perception.scan.scan3d import gather
from onboard.perception.scan.tilt_lag import Lag, lag, nods
from onboard.record.writer import Recorder
from onboard.records import Pose
from protocol.generated.can_codec import TABLE
from tests.onboard.lag_rig import AXIS_S, LATE_NS, REAL, Port, RigClock, believing, standing_rover
from tests.onboard.nodding import Nodding
from tests.onboard.stand_clock import StandClock, VirtualEnd, handlers_kept

GOAL_S = 2e-4


def onboard(*words):
    return CliRunner().invoke(app, ["lidar", "lag", *map(str, words)])


def found_of(machine):
    return lag([gather(sweep.scans, sweep.tilt) for sweep in machine.sweeps], Config().rover)


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """(the machine after its sweeps over rough ground, their record, what it sent), 3 ms late by its configuration."""
    path = tmp_path_factory.mktemp("lag") / "lag.mcap"
    config, world, sent = believing(path), standing_rover("fbm"), []
    hear = world.hear

    def tapped(frames, *rest):
        sent.extend(frames)
        hear(frames, *rest)

    world.hear = tapped
    try:
        with Recorder(config, None) as recorder:
            machine = world.run(LagSweeps(config), None, recorder)
    finally:
        world.free()
    return machine, path, sent


def test_3_ms_are_found_within_0_2_ms_on_rough_ground_with_a_scanner_like_a_real_one(swept):
    machine, _, _ = swept
    found = found_of(machine)
    assert machine.problem == "" and machine.complete
    assert found.late_s == pytest.approx(LATE_NS * 1e-9, abs=GOAL_S)
    assert found.late_s == pytest.approx(LATE_NS * 1e-9 - AXIS_S, abs=3 * found.sigma_s) and found.sigma_s < 1.2e-4
    assert abs(found.play_rad) < math.radians(0.01)


def test_3_ms_are_found_within_0_2_ms_from_the_record(swept):
    _, path, _ = swept
    result = onboard(path, "--json")
    assert result.exit_code == 0, result.output
    told = json.loads(result.stdout)
    assert told["late_s"] == pytest.approx(LATE_NS * 1e-9, abs=GOAL_S)
    assert told["latency_ns"] == pytest.approx(stamp_to_first_byte_ns(REAL), abs=GOAL_S * 1e9)
    assert told["latency_ns"] == pytest.approx(told["latency_before_ns"] + told["late_s"] * 1e9, abs=1000)


def test_the_wheels_are_never_told_to_move_and_the_drives_are_disabled_at_the_end(swept):
    _, _, sent = swept
    orders = [TABLE[frame.can_id].decode(frame.data) for frame in sent if 0x101 <= frame.can_id <= 0x104]
    enables = [TABLE[frame.can_id].decode(frame.data).enable for frame in sent if frame.can_id == 0x100]
    assert {(order.mode, order.rate_radps) for order in orders} == {(0, 0.0)}
    assert 1 in enables and enables[-1] == 0


def test_play_between_motor_and_scanner_is_told_from_a_lag_and_a_lag_of_the_servo_is_none(tmp_path):
    play_rad = math.radians(0.2)
    world = standing_rover("flat")
    errors = SensorErrors(tilt=TiltErrors(lag_s=0.012, backlash_rad=play_rad))
    world.nodes = build_nodes(1, Rover(), errors)
    try:
        found = found_of(world.run(LagSweeps(believing(tmp_path / "lag.mcap"))))
    finally:
        world.free()
    assert found.late_s == pytest.approx(LATE_NS * 1e-9, abs=GOAL_S)
    assert found.play_rad == pytest.approx(play_rad, abs=math.radians(0.02))


def test_the_ordered_sweeps_go_both_ways_at_two_rates_within_the_axis_own_range():
    made = nods(Scanning(start_rad=math.radians(40), end_rad=math.radians(-20)))
    assert [nod.rate_radps > 0 for nod in made] == [True, False] * 3
    assert {round(abs(math.degrees(nod.rate_radps)), 3) for nod in made} == {27.5, 5.5}
    ends = {round(math.degrees(angle), 2) for nod in made for angle in (nod.start_rad, nod.end_rad)}
    assert ends == {5.0, 40.0}
    with pytest.raises(ValueError, match=r"scanning\.start_rad"):
        nods(Scanning(start_rad=math.radians(15), end_rad=math.radians(-20)))


def test_only_sweeps_both_ways_from_one_place_are_taken_of_a_record():
    def sweep(name, rises, rolled_rad):
        return RecordedSweep(name, rises, (rolled_rad,) * 4)

    ups = [sweep("a", True, 0.0), sweep("b", True, 5.0)]
    pair = [sweep("c", False, 9.0), sweep("d", True, 9.0)]
    assert standing(iter([*ups, *pair, sweep("e", False, 20.0)])) == ["c", "d"]
    assert standing(iter(ups)) == ["a"] and standing(iter([])) == []
    unheard = [sweep("f", False, math.nan), sweep("g", True, math.nan)]
    assert standing(iter(unheard)) == ["f", "g"]  # a scanner and an axis on a table have no wheels


def test_the_report_says_what_to_set_and_null_for_a_play_that_was_not_seen():
    report = LagReport(Lag(0.003, 1e-4, 5000, math.nan, math.nan), 20_700_000)
    assert report.latency_ns == 23_700_000
    assert report.as_dict()["play_rad"] is None and json.dumps(report.as_dict(), allow_nan=False)
    assert "lidar.latency_ns = 23700000" in "\n".join(report.lines())


# -- the command -----------------------------------------------------------------------------------------------


def test_the_command_finds_it_live_on_the_emulated_scanner_and_axis(tmp_path, monkeypatch):
    world, record = standing_rover("yard"), tmp_path / "lag.mcap"
    end = VirtualEnd("lag")
    port = Port(world)
    monkeypatch.setattr("onboard.drivers.platform.clock.WallClock", lambda: RigClock(world, end, port))
    monkeypatch.setattr("onboard.bringup.calibrate.ports.open_port", lambda _: port)
    own_ns = stamp_to_first_byte_ns(REAL)
    try:
        with handlers_kept():
            result = onboard(
                "tcp:127.0.0.1:1",
                "--bus",
                end.uri,
                "--yes",
                "--record",
                record,
                "--json",
                "-s",
                f"lidar.latency_ns={own_ns - LATE_NS}",
            )
    finally:
        world.free()
        end.close()
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["latency_ns"] == pytest.approx(own_ns, abs=GOAL_S * 1e9)


def test_a_record_of_sweeps_that_all_go_one_way_says_so_and_what_to_do(tmp_path):
    path, bench = tmp_path / "up.mcap", Nodding()
    with Recorder(Config(record=Record(str(path))), None) as bench.recorder:
        bench.settle(1)
        bench.sweep(60, 5, 30)
        bench.sweep(60, 5, 30)
    result = onboard(path)
    assert result.exit_code == 65 and "same way" in result.output and "onboard calibrate" in result.output


@pytest.mark.parametrize(("words", "code", "told"), [
    (["nowhere.mcap"], 66, "no record"),
    (["nowhere.mcap", "--bus", "virtual:x"], 64, "own configuration"),
    (["--config", "nowhere.toml"], 66, "no configuration file"),
    (["tcp:127.0.0.1:1", "--bus", "can0"], 78, "can.uri"),
    (["tcp:127.0.0.1:1", "-s", "scanning.start_rad=0.1"], 64, "degrees"),
])  # fmt: skip
def test_what_is_asked_wrongly_ends_with_its_code(words, code, told, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = onboard(*words)
    assert result.exit_code == code and told in result.output


@pytest.fixture
def on_stand(monkeypatch, tmp_path):
    """The command on the rover's nodes, time by hand, and no scanner at its address."""
    monkeypatch.chdir(tmp_path)
    end, clocks = VirtualEnd("lag-stand"), []

    def invoke(faults, answer):
        clocks.append(StandClock(faulty(Stand(), faults), end))
        monkeypatch.setattr("onboard.drivers.platform.clock.WallClock", lambda: clocks[-1])
        with handlers_kept():
            words = ["lidar", "lag", "tcp:127.0.0.1:1", "--bus", end.uri]
            return CliRunner().invoke(app, words, input=answer), clocks[-1].heard

    yield invoke
    end.close()


@pytest.mark.parametrize(("faults", "answer", "code", "told"), [
    (["silent=TILT"], "y\n", 69, "refused, nothing was sent: TILT is not heard"),
    (["stop=POWER"], "y\n", 69, "asserts an EMERGENCY_STOP"),
    ([], "n\n", 130, "ended before anything moved"),
])  # fmt: skip
def test_sweeps_that_are_refused_or_not_agreed_to_send_nothing(on_stand, tmp_path, faults, answer, code, told):
    result, heard = on_stand(faults, answer)
    assert result.exit_code == code and told in result.output and heard == []
    assert not (tmp_path / "lag.mcap").exists()


def test_an_axis_without_a_scanner_ends_with_the_reason(on_stand):
    result, _ = on_stand([], "y\n")
    assert result.exit_code == 1 and "gives no whole scan" in result.output


# -- the default -----------------------------------------------------------------------------------------------


def test_the_default_latency_is_that_of_the_logged_utm_30lx_and_the_bench_sets_that_of_another():
    assert Lidar().latency_ns == stamp_to_first_byte_ns(UTM30LX) == 23_700_000
    ideal = flight_settings(Scenario(lidar={"profile": "ideal"}), Pose(0.0, 0.0))
    assert ideal["lidar.latency_ns"] == stamp_to_first_byte_ns(IDEAL)
    assert "lidar.latency_ns" not in flight_settings(Scenario(), Pose(0.0, 0.0))
    assert measured_latency(REAL) == {}
    assert measured_latency(replace(IDEAL, turn_ns=25.05e6)) == {"lidar.latency_ns": 19_787_500}
