"""`onboard lidar` against the emulated sensor, on TCP and on a pseudo terminal, with time by hand."""

from __future__ import annotations

import errno
import fcntl
import json
import os
import re
import signal
import socket
import struct
import threading
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from hil.devices.lidar import profile as profiles
from hil.devices.lidar.server import LidarServer, LidarTerminal
from onboard.__main__ import app
from onboard.bringup.lidar.listener import Listener, log_of
from onboard.bringup.lidar.report import CHECKS, ScanSums
from onboard.bringup.lidar.show import numbers, polar, view
from onboard.config import Lidar
from onboard.devices.lidar.clock import ClockQuality
from onboard.drivers.storage.record_file import DiskFile
from onboard.record.reader import open_record
from onboard.records import BeamStatus, Chunk, Scan
from protocol import scip
from tests.onboard.hand_clock import HandClock

CABLES = [LidarServer, LidarTerminal]


def room(times_ns):
    """A wall 2 m ahead, 3 m to the left, none behind on the right."""
    phi = np.radians(np.arange(len(times_ns)) * 0.25 - 135.0)
    with np.errstate(divide="ignore"):
        ahead, left = 2.0 / np.cos(phi), 3.0 / np.sin(phi)
    return np.minimum(np.where(ahead > 0, ahead, np.inf), np.where(left > 0, left, np.inf))


class World:
    """An emulated sensor on a cable, and `onboard lidar` with time by hand."""

    def __init__(self, cable, profile, monkeypatch):
        self.server, self.profile, self.clocks, self.plans = cable(), profile, [], {}
        monkeypatch.setattr("onboard.drivers.platform.clock.WallClock", self.clock)
        self.address = self.server.address

    def clock(self):
        clock = HandClock(self.server, self.profile, room)
        clock.at_ns = dict(self.plans)
        self.clocks.append(clock)
        return clock

    @property
    def twin(self):
        return self.clocks[-1].twin

    def run(self, *words):
        return CliRunner().invoke(app, ["lidar", *words])


@contextmanager
def handlers_kept():
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@pytest.fixture(params=CABLES, ids=["tcp", "pty"])
def world(request, monkeypatch):
    with handlers_kept():
        made = World(request.param, profiles.UTM30LX, monkeypatch)
        yield made
        made.server.close()


@pytest.fixture
def tcp(monkeypatch):
    with handlers_kept():
        made = World(LidarServer, profiles.UTM30LX, monkeypatch)
        yield made
        made.server.close()


def test_info_prints_what_the_sensor_says_and_leaves_it_quiet(world):
    got = world.run("info", world.address)
    assert got.exit_code == 0, got.output
    lines = got.stdout.splitlines()
    assert "40 turns a second, 270 degrees in steps of 0.25" in lines[0]
    assert "PROD  SOKUIKI Sensor TOP-URG UTM-30LX" in lines and "STAT  Sensor works well." in lines
    assert lines[-1] == "asked with MD0000108001000: 1081 beams"
    assert not world.twin.laser_on
    told = json.loads(world.run("info", world.address, "--json").stdout)
    assert told["info"]["SERI"] == "00903971" and told["request"] == "MD0000108001000"


@pytest.mark.parametrize(("profile", "line"), [
    (profiles.UTM30LX_EW, "%ST  000: standby"), (profiles.UTM30LX, "%ST  0E: unknown command"),
])  # fmt: skip
def test_info_shows_the_state_code_or_that_there_is_none(profile, line, monkeypatch):
    with handlers_kept():
        world = World(LidarServer, profile, monkeypatch)
        got = world.run("info", world.address, "--set", "lidar.probe_state=true")
        world.server.close()
    assert got.exit_code == 0 and line in got.stdout.splitlines()


def test_info_shows_control_characters_of_the_sensors_strings(monkeypatch):
    texts = profiles.UTM_TEXTS
    hostile = replace(texts, version=(*texts.version[:2], ("FIRM", "1\x1b[2J\x07"), *texts.version[3:]))
    with handlers_kept():
        world = World(LidarServer, replace(profiles.UTM30LX, texts=hostile), monkeypatch)
        got = world.run("info", world.address)
        world.server.close()
    assert got.exit_code == 0 and "FIRM  1\\x1b[2J\\x07" in got.stdout.splitlines()


def test_record_is_replayed_bit_by_bit_and_a_changed_byte_is_named(world, tmp_path):
    out = tmp_path / "room.mcap"
    got = world.run("record", world.address, "--out", str(out), "--scans", "40", "--json")
    assert got.exit_code == 0, got.output
    assert json.loads(got.stdout)["scans"] == 40 and not world.twin.laser_on
    again = world.run("replay", str(out), "--json")
    verdict = json.loads(again.stdout)
    assert again.exit_code == 0 and verdict["verdict"] == "identical"
    assert verdict["bytes"]["/out/lidar"] > 40 and verdict["ticks"] > 100
    data = bytearray(out.read_bytes())
    data[len(data) // 2] ^= 1
    out.write_bytes(data)
    damaged = world.run("replay", str(out))
    assert damaged.exit_code == 65 and "is damaged" in damaged.stderr


def test_check_of_a_good_sensor_finds_nothing(world):
    got = world.run("check", world.address, "--seconds", "12", "--json", "--set", "lidar.latency_ns=23700000")
    told = json.loads(got.stdout)
    assert got.exit_code == 0 and told["findings"] == [] and told["damaged"] == 0
    assert told["rate_hz"] == pytest.approx(40.0, abs=0.02) and 460 <= told["scans"] <= 481
    assert told["clock"]["sigma_ms"] < 0.05 and abs(told["clock"]["ppm"]) < 20
    assert sum(told["beams"].values()) == told["scans"] * 1081
    assert "healthy   nothing is wrong" in world.run("check", world.address, "--seconds", "3").stdout


def spoil_some(clock):
    clock.twin.garble_ratio = 0.2


def reboot(clock):
    clock.twin.jump_clock(5e6)


def cover(clock):
    clock.twin._cast = lambda times_ns: np.full(len(times_ns), 0.05)


def darken(clock):
    rng = np.random.default_rng(7)
    clock.twin._cast = lambda times_ns: np.where(rng.random(len(times_ns)) < 0.3, np.inf, room(times_ns))


@pytest.mark.parametrize(("harm", "name", "words"), [
    (spoil_some, "damage", "block_sum"), (reboot, "counter", "power"), (cover, "window", "dirty"),
    (darken, "lost", "dark"),
])  # fmt: skip
def test_check_names_the_likely_cause_of_what_is_wrong(tcp, harm, name, words):
    tcp.plans = {1_500_000_000: harm}
    got = tcp.run("check", tcp.address, "--seconds", "4", "--json")
    told = {row["name"]: row["text"] for row in json.loads(got.stdout)["findings"]}
    assert got.exit_code == 1 and name in told and words in told[name], told
    assert set(told) <= {check[0] for check in CHECKS}


def test_beams_without_return_are_lost_between_others_that_returned_and_not_in_the_sky():
    status = np.full(1081, BeamStatus.NO_RETURN, np.uint8)
    status[100:900] = BeamStatus.OK
    status[[300, 400, 401, 402, 500]] = BeamStatus.NO_RETURN
    scan = Scan(0, 1.0, -2.3, 0.004, np.where(status == BeamStatus.OK, 3.0, np.nan).astype(np.float32), status)
    tally = ScanSums()
    tally.add([scan, scan])
    assert tally.lost == 2 * 5
    assert tally.lost_ratio == pytest.approx(5 / 800)


def test_check_tells_a_clock_that_drifts(tcp):
    tcp.profile = replace(profiles.UTM30LX, rate_error=400e-6)
    told = json.loads(tcp.run("check", tcp.address, "--json").stdout)
    assert [row["name"] for row in told["findings"]] == ["drift"]
    assert told["clock"]["ppm"] == pytest.approx(-400, abs=30)


def test_check_of_a_record_says_what_the_check_of_the_sensor_said(tcp, tmp_path):
    out = tmp_path / "r.mcap"
    assert tcp.run("record", tcp.address, "--out", str(out), "--seconds", "3").exit_code == 0
    told = json.loads(tcp.run("check", str(out), "--json").stdout)
    assert told["findings"] == [] and told["info"]["MODL"].startswith("UTM-30LX") and told["scans"] > 110


def test_watch_prints_a_line_a_second_or_json_or_the_room_from_above(tcp):
    lines = tcp.run("watch", tcp.address, "--seconds", "4").stdout.splitlines()
    assert len(lines) == 3 and all(re.search(r" Hz .*ahead  (1.9|2.0)", line) for line in lines)
    rows = [json.loads(line) for line in tcp.run("watch", tcp.address, "--seconds", "4", "--json").stdout.splitlines()]
    assert rows[-1]["ahead_m"] == pytest.approx(2, abs=0.1) and rows[-1]["nearest_m"] == pytest.approx(2, abs=0.1)
    assert abs(rows[-1]["nearest_deg"]) < 20
    assert len(rows) == 3 and rows[-1]["rate_hz"] == pytest.approx(40, abs=1) and rows[-1]["counts"]["scans"] > 100
    drawn = tcp.run("watch", tcp.address, "--seconds", "2", "--polar", "--reach", "4").stdout.splitlines()
    assert len(drawn) == 25 and "edge = 4 m" in drawn[-2] and any("+" in line for line in drawn)


def unplug(clock):
    clock.port._fail("unplugged")
    clock.port.connect = lambda: None
    clock.pass_time = lambda left_s: setattr(clock, "time_ns", clock.time_ns + round(left_s * 1e9))


def test_watch_of_a_sensor_that_goes_away_shows_nothing_as_live_and_ends_with_69(tcp):
    tcp.plans = {2_500_000_000: unplug}
    got = tcp.run("watch", tcp.address, "--seconds", "6")
    lines = got.stdout.splitlines()
    assert " ahead " in lines[0] and all("0.0 Hz" in line and "ahead" not in line for line in lines[-2:])
    assert lines[-1].endswith("gone: unplugged or closed; trying again")
    assert got.exit_code == 69 and "is gone: unplugged or closed" in got.stderr and got.stderr.count("\n") == 1


def test_watch_of_a_sensor_that_came_back_ends_well(tcp):
    tcp.plans = {2_500_000_000: lambda clock: (clock.server.disconnect(), clock.pieces.clear())}
    got = tcp.run("watch", tcp.address, "--seconds", "8", "--json")
    rows = [json.loads(line) for line in got.stdout.splitlines()]
    assert got.exit_code == 0 and rows[-1]["counts"]["reconnects"] == 1
    assert rows[-1]["trouble"] == "" and rows[-1]["ahead_m"] > 1.9


def test_line_of_numbers_fits_80_columns_and_a_view_of_nothing_is_none():
    far = Scan(0, 1.0, -2.3, 0.01, np.full(400, 59.999, np.float32), np.zeros(400, np.uint8))
    line = numbers(far, 40.0, {"scans": 999_999}, ClockQuality()._replace(sigma_ns=9.9e6))
    assert "nearest 59.999 m at -132°" in line and len(line) <= 80
    dark = Scan(0, 1.0, -1.0, 0.5, np.full(5, np.nan, np.float32), np.full(5, 1, np.uint8))
    assert view(dark) == (None, None, None)


def test_polar_plot_has_a_point_where_the_beam_ended():
    ranges_m = np.array([3.0, 2.0, np.nan], np.float32)
    scan = Scan(0, 1.0, 0.0, np.pi / 2, ranges_m, np.array([0, 0, 1], np.uint8))  # ahead 3 m, left 2 m, behind nothing
    lines = polar(scan, columns=40, rows=20, reach_m=4.0)
    marks = {(row, column) for row, line in enumerate(lines) for column, sign in enumerate(line) if sign not in " +"}
    assert marks == {(2, 20), (10, 10)}  # a row is 0.4 m high, a column 0.2 m wide


def test_ctrl_c_ends_a_watch_with_the_laser_off(tcp):
    tcp.plans = {2_000_000_000: lambda clock: os.kill(os.getpid(), signal.SIGINT)}
    got = tcp.run("watch", tcp.address)
    assert got.exit_code == 0 and got.stderr == "" and len(got.stdout.splitlines()) == 1
    assert not tcp.twin.laser_on and tcp.twin.scans > 0


@pytest.mark.parametrize(("words", "code", "text"), [
    (("info", "/nowhere/ttyACM0"), 69, "plugged in"), (("info", "/dev/null"), 69, "no tty"),
    (("check", "tcp:127.0.0.1:1"), 69, "refuses"), (("watch", "usb"), 78, "ADDRESS = 'usb' should be tcp:"),
    (("check", "tcp:127.0.0.1:1", "--set", "lidar.cluter=3"), 78, "cluter"),
    (("check", "/nowhere/r.mcap"), 66, "No such"), (("replay", "/nowhere/r.mcap"), 66, "no record"),
    (("record", "/dev/null", "--out", "/dev/null/r.mcap"), 73, "written"),
])  # fmt: skip
def test_bad_input_is_one_line_that_says_what_to_do(words, code, text):
    with handlers_kept():
        got = CliRunner().invoke(app, ["lidar", *words])
    assert got.exit_code == code and text in got.stderr, got.output
    assert got.stderr.startswith("onboard: ") and got.stderr.count("\n") == 1 and got.stdout == ""


def test_device_in_use_is_told(monkeypatch):
    with handlers_kept():
        world = World(LidarTerminal, profiles.IDEAL, monkeypatch)
        monkeypatch.undo()
        holder = os.open(world.address.removeprefix("tty:"), os.O_RDWR | os.O_NOCTTY)
        fcntl.flock(holder, fcntl.LOCK_EX)
        got = CliRunner().invoke(app, ["lidar", "info", world.address])
        os.close(holder)
        world.server.close()
    assert got.exit_code == 69 and "in use" in got.stderr


def test_another_model_and_no_hokuyo_are_told(tcp):
    got = tcp.run("check", tcp.address, "--set", "lidar.model=UST-20LX")
    assert got.exit_code == 78 and "UTM-30LX" in got.stderr and "lidar.model" in got.stderr
    tcp.plans = {0: lambda clock: setattr(clock.twin, "stalled", True)}
    got = tcp.run("check", tcp.address)
    assert got.exit_code == 69 and "is this a Hokuyo" in got.stderr and got.stderr.count("\n") == 1


def test_nothing_is_left_of_a_record_without_a_sensor(tmp_path):
    with handlers_kept():
        got = CliRunner().invoke(app, ["lidar", "record", "/nowhere/tty", "--out", str(tmp_path / "r.mcap")])
    assert got.exit_code == 69 and not list(tmp_path.iterdir())


def piece(at_us, data):
    return struct.pack(">III", *divmod(at_us, 1_000_000), len(data)) + data


def test_hokuyoaist_log_is_checked_like_a_record(tmp_path):
    asked = scip.ScanRequest("GD", 44, 725)
    values = np.full(asked.values, 1500)
    log = piece(1000, scip.reply(b"VV", "00", scip.text_line("PROD", "SOKUIKI Sensor URG-04LX")))
    for k in range(5):
        frame = scip.scan_reply(asked, asked.line(), 5000 + 100 * k, values)
        log += piece(50_000 + 100_000 * k, frame[:700]) + piece(52_000 + 100_000 * k, frame[700:])
    (tmp_path / "urg.logr").write_bytes(log)
    assert next(iter(log_of(log))) == (1_000_000, log[12 : 12 + struct.unpack(">I", log[8:12])[0]])
    got = CliRunner().invoke(app, ["lidar", "check", str(tmp_path / "urg.logw"), "--json"])
    told = json.loads(got.stdout)
    assert told["scans"] == 5 and told["damaged"] == 0 and told["beams"]["ok"] == 5 * 682
    (tmp_path / "cut.logr").write_bytes(log[:-3])
    got = CliRunner().invoke(app, ["lidar", "check", str(tmp_path / "cut.logr")])
    assert got.exit_code == 65 and "ends inside a piece" in got.stderr


@pytest.mark.parametrize(("asked_to_stop", "gaps"), [(True, 0), (False, 1)])
def test_pause_that_was_asked_for_is_no_gap(asked_to_stop, gaps):
    asked, listener = scip.ScanRequest("MD", 0, 1080), Listener(Lidar())
    values = np.full(asked.values, 1500)
    for begin_ms in (5000, 9000):
        for k in range(5):
            at_ms = begin_ms + 25 * k
            frame = scip.scan_reply(asked, asked.line(), at_ms, values)
            assert len(listener.receive(Chunk(at_ms * 1_000_000, frame))) == 1
        if asked_to_stop:
            listener.receive(Chunk((at_ms + 20) * 1_000_000, scip.reply(b"QT", "00")))
    assert listener.counts["gap"] == gaps and listener.counts["scans"] == 10


def test_record_makes_no_folders_and_writes_over_nothing_unasked(tcp, tmp_path):
    got = tcp.run("record", tcp.address, "--out", str(tmp_path / "none" / "r.mcap"))
    assert got.exit_code == 73 and "is no folder" in got.stderr and not list(tmp_path.iterdir())
    out = tmp_path / "r.mcap"
    out.write_bytes(b"dear")
    got = tcp.run("record", tcp.address, "--out", str(out), "--seconds", "1")
    assert got.exit_code == 73 and "--force" in got.stderr and out.read_bytes() == b"dear"
    assert tcp.run("record", tcp.address, "--out", str(out), "--seconds", "1", "--force").exit_code == 0
    assert out.stat().st_size > 1000


@pytest.mark.parametrize(("room", "code", "text"), [
    (0, 73, "cannot be written: No space left on device"), (100_000, 74, "is not whole: No space left on device"),
])  # fmt: skip
def test_a_disk_that_refuses_is_told_and_what_it_took_can_be_read(tcp, tmp_path, monkeypatch, room, code, text):
    put = DiskFile.put

    def refuse(file, data, offset):
        if offset + len(data) > room:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        put(file, data, offset)

    monkeypatch.setattr(DiskFile, "put", refuse)
    out = tmp_path / "r.mcap"
    got = tcp.run("record", tcp.address, "--out", str(out), "--seconds", "3")
    assert got.exit_code == code and text in got.stderr and got.stderr.count("\n") == 1 and got.stdout == ""
    assert not out.exists()
    if room:
        part = Path(re.search(r" is in (.+)$", got.stderr).group(1))
        assert open_record(part).cut_off and len(list(open_record(part).ticks())) > 0
    else:
        assert not list(tmp_path.iterdir())


def test_a_recording_is_not_lost_to_a_sensor_that_is_not_there(tmp_path):
    out = tmp_path / "r.mcap"
    out.write_bytes(b"dear")
    got = CliRunner().invoke(app, ["lidar", "record", str(tmp_path / "none"), "--out", str(out), "--force"])
    assert got.exit_code != 0 and got.stderr.count("\n") == 1
    assert out.read_bytes() == b"dear" and list(tmp_path.iterdir()) == [out]


@pytest.mark.parametrize("words", ["scanner", "tty:scanner", "./scanner"])
def test_relative_path_alone_is_a_tty(words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with handlers_kept():
        world = World(LidarTerminal, profiles.UTM30LX, monkeypatch)
        (tmp_path / "scanner").symlink_to(world.address.removeprefix("tty:"))
        got = world.run("info", words)
        world.server.close()
    assert got.exit_code == 0 and "UTM-30LX" in got.stdout, got.output


def test_check_of_a_file_that_is_no_record_says_what_it_reads(tmp_path):
    (tmp_path / "notes.txt").write_text("no record")
    got = CliRunner().invoke(app, ["lidar", "check", str(tmp_path / "notes.txt")])
    assert got.exit_code == 65 and ".mcap and .logr" in got.stderr and got.stderr.count("\n") == 1


@pytest.mark.parametrize(("answer", "told"), [
    (b"HTTP/1.0 400 Bad Request\r\n\r\nwhat?\n\n", "answered, but not in SCIP: is this a Hokuyo"),
    (b"", "closed without an answer in SCIP: is this a Hokuyo"),
])  # fmt: skip
def test_what_answers_otherwise_or_not_and_closes_is_no_hokuyo(answer, told):
    with socket.create_server(("127.0.0.1", 0)) as server, handlers_kept():

        def refuse():
            client = server.accept()[0]
            client.recv(100)
            client.sendall(answer)
            client.close()

        web = threading.Thread(target=refuse)
        web.start()
        got = CliRunner().invoke(app, ["lidar", "info", f"tcp:127.0.0.1:{server.getsockname()[1]}"])
        web.join()
    assert got.exit_code == 69 and told in got.stderr
    assert got.stderr.count("\n") == 1


@pytest.mark.parametrize("words", [["info"], ["watch"], ["record", "--out", "r.mcap"]])
def test_ctrl_c_before_the_sensor_answers_ends_with_130(words, tcp, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    tcp.plans = {0: lambda clock: os.kill(os.getpid(), signal.SIGINT)}
    got = tcp.run(words[0], tcp.address, *words[1:])
    assert got.exit_code == 130 and got.stderr == "onboard: ended before the sensor answered\n"
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("words", "work"), [
    (["lidar", "watch", "tcp:127.0.0.1:1"], "onboard.drivers.platform.clock.WallClock"),
    (["lidar", "scan", "r.mcap", "--out", "r.ply"], "onboard.bringup.lidar.again.config_of"),
    (["gdem", "import", "dem.tif"], "onboard.bringup.maps.gdem_import.import_gdem"),
])  # fmt: skip
def test_ctrl_c_in_any_command_is_one_line_and_130(words, work, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(work, interrupted)
    got = CliRunner().invoke(app, words)
    assert got.exit_code == 130 and got.stderr == "onboard: ended by Ctrl-C\n"


@pytest.mark.parametrize("command", ["info", "watch", "record", "replay", "check"])
def test_every_command_has_help_with_examples(command):
    got = CliRunner().invoke(app, ["lidar", command, "--help"])
    assert got.exit_code == 0 and f"onboard lidar {command} " in got.stdout.split("Examples:")[1]
