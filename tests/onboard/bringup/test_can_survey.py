"""`onboard can info`, `watch` and `load`: what two seconds of listening tell of a bus, well or not."""

import json
import os
import signal

import pytest
from click.testing import CliRunner

from hil.devices.can.command import faulty
from hil.devices.can.wheels_off_ground import Stand
from onboard.__main__ import app
from onboard.bringup.can.survey import NEEDED, Survey
from onboard.records import Frame
from protocol.can.guard import Sender
from protocol.generated.can_codec import DBC_VERSION
from protocol.generated.can_frames import FRAMES
from tests.onboard.stand_clock import StandClock, VirtualEnd, beats, handlers_kept


def surveyed(*faults, ticks=200, error_frames=0, more=()):
    survey = Survey()
    for now_ns, frames in beats(ticks, faulty(Stand(), list(faults))):
        survey.receive([*frames, *(f._replace(stamp_ns=now_ns) for f in more)])
    return survey.report(ticks / 100, error_frames)


def test_a_bus_that_is_well_has_no_findings_and_its_load_is_that_of_its_frames():
    report = surveyed()
    assert report.findings == []
    assert [node.name for node in report.nodes if node.beat] == list(NEEDED)
    assert {node.beat["dbc_version"] for node in report.nodes if node.beat} == {DBC_VERSION}
    assert {tally.name: round(tally.rate_hz) for tally in report.tallies}["WHEEL_3_STATUS"] == 20
    assert 0.15 < report.load_ratio < 0.19  # no computer, the axis parked
    json.dumps(report.as_dict())


@pytest.mark.parametrize(("fault", "told"), [
    ("silent=WHEEL_3", "WHEEL_3 is not heard"),
    ("foreign=WHEEL_2", "WHEEL_2 was built with version 99 of rover.dbc, this program with 1"),
    ("stop=TILT", "TILT is stopped: an EMERGENCY_STOP is latched"),
    ("damaged=IMU", "IMU_GYRO: "),
    ("twice=WHEEL_1", "two nodes seem to be WHEEL_1: alive counters interleave on 0x181"),
    ("twice=POWER", "two nodes seem to be POWER: alive counters interleave on 0x200"),
])  # fmt: skip
def test_what_is_wrong_is_named(fault, told):
    findings = surveyed(fault).findings
    assert any(line.startswith(told) for line in findings), findings


@pytest.mark.parametrize("fault", ["damaged=WHEEL_1", "silent=WHEEL_2", "foreign=IMU"])
def test_one_node_is_not_taken_for_two(fault):
    assert not any("two nodes" in line for line in surveyed(fault).findings)


def test_a_sender_that_loses_many_frames_is_not_taken_for_two():
    survey, sender = Survey(), Sender()
    stream = [Frame(0x1D0, sender.encode(0x1D0, 0, 0, 0, 0), n * 10_000_000) for n in range(400)]
    survey.receive([frame for n, frame in enumerate(stream) if n * 7919 % 10 >= 3])
    assert not any("two nodes" in line for line in survey.report(4.0, 0).findings)


def test_a_strange_device_and_a_slow_frame_are_named():
    findings = surveyed(more=(Frame(0x123, b"\1\2"),)).findings
    assert findings == ["0x123 not in the DBC, 200 frames: another device on this bus?"]
    survey = Survey()
    for _, frames in beats(200):
        survey.receive([f for f in frames if f.can_id != 0x1D0 or f.data[6] & 0x10])
    told = survey.report(2.0, 0).findings
    assert "IMU_GYRO comes 50.0 times a second, 100 are due" in told


def test_silence_and_nothing_but_error_frames_are_told_apart():
    assert Survey().report(2.0, 0).findings[0].startswith("nothing at all is heard: are the nodes powered")
    (line,) = Survey().report(2.0, 37).findings
    assert line.startswith("only error frames, 37 of them: another bit rate (right are 500 kbit/s)")
    assert surveyed(error_frames=3).findings[0].startswith("3 error frames of the controller")


def test_a_flight_computer_and_the_frames_that_it_owes_are_seen():
    survey, sender = Survey(), Sender()
    for now_ns, frames in beats(200):
        beat = [Frame(0x300, sender.encode(0x300, 1, 7, 3), now_ns)] if now_ns % 100_000_000 == 0 else []
        survey.receive([*frames, *beat])
    report = survey.report(2.0, 0)
    assert next(node.beat for node in report.nodes if node.name == "COMPUTER") == {
        "mode": 1,
        "beats": 7,
        "boot_count": 3,
    }
    assert "TIME_SYNC is not heard, though COMPUTER is there: 10 a second are due" in report.findings


# -- the commands ----------------------------------------------------------------------------------------------


class World:
    """`onboard can` on a virtual bus with the stand at its far end; time by hand."""

    def __init__(self, monkeypatch, end):
        self.end, self.monkeypatch, self.clock = end, monkeypatch, None

    def run(self, *words, faults=(), at=None):
        self.clock = StandClock(faulty(Stand(), list(faults)), self.end, at)
        self.monkeypatch.setattr("onboard.drivers.platform.clock.WallClock", lambda: self.clock)
        return CliRunner().invoke(app, ["can", *words, "--bus", self.end.uri])


@pytest.fixture
def world(monkeypatch):
    end = VirtualEnd()
    with handlers_kept():
        yield World(monkeypatch, end)
    end.close()


def test_info_says_that_all_is_well_and_sends_nothing(world):
    got = world.run("info")
    assert got.exit_code == 0, got.output
    lines = got.stdout.splitlines()
    assert lines[0].startswith("listened 2.0 s: load 1") and lines[-1] == "all is well"
    name, frames, *beat = lines[3].split()
    assert (name, beat[:3], beat[4:]) == ("WHEEL_1", ["COMMAND_TIMEOUT", "1", "1"], ["0", "0"]) and int(frames) > 240
    assert "no flight computer on this bus" in lines
    assert world.clock.heard == []


def test_info_tells_what_is_wrong_and_exits_with_1(world):
    got = world.run("info", "--json", faults=["silent=TILT"])
    assert got.exit_code == 1
    (finding,) = json.loads(got.stdout)["findings"]
    assert finding == "TILT is not heard: no power, no cable, or it was given another number"


def test_watch_prints_the_newest_of_each_frame_once_a_second_where_there_is_no_terminal(world):
    got = world.run("watch", "--only", "WHEEL_*_FEEDBACK", "--seconds", "2")
    assert got.exit_code == 0, got.output
    lines = got.stdout.splitlines()
    assert [line.split()[:2] for line in lines] == [
        [at, f"WHEEL_{n}_FEEDBACK"] for at in ("1.000000", "2.000000") for n in (1, 2, 3, 4)
    ]
    rows = [json.loads(line) for line in world.run("watch", "--seconds", "2", "--json").stdout.splitlines()]
    assert rows[-1]["frames"]["IMU_GYRO"]["rate_hz"] == pytest.approx(100.0)
    assert len(rows[-1]["frames"]) == sum(layout.sender in NEEDED and not layout.event for layout in FRAMES.values())


def test_watch_is_a_table_in_a_terminal(world):
    world.monkeypatch.setenv("FORCE_COLOR", "1")
    world.monkeypatch.setenv("COLUMNS", "120")
    lines = world.run("watch", "--node", "WHEEL_1", "--seconds", "2", faults=["silent=IMU"]).stdout.splitlines()
    row = next(line for line in reversed(lines) if "WHEEL_1_FEEDBACK" in line).split()
    assert row[1:4] == ["100", "0", "steer_rad"] and "state" in row and not any("WHEEL_2" in line for line in lines)


def test_decode_of_a_live_bus_ends_with_ctrl_c_and_still_sums_up(world):
    got = world.run("decode", "--errors", at={150: lambda _: os.kill(os.getpid(), signal.SIGINT)})
    assert got.exit_code == 0
    assert got.stdout.splitlines()[1].split() == ["WHEEL_1_FEEDBACK", "149", "100.0"]


def test_load_prints_three_cases():
    got = CliRunner().invoke(app, ["can", "load"])
    assert got.exit_code == 0
    totals = [line.split()[-1] for line in got.stdout.splitlines() if line.startswith("all ")]
    assert totals == ["30.8%", "28.3%", "33.5%"]
    told = json.loads(CliRunner().invoke(app, ["can", "load", "--json"]).stdout)
    assert told["operation"][0]["name"] == "TIME_SYNC"
