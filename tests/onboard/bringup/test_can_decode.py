"""`onboard can decode`: lines of candump in all their forms, checks as in flight, files of other programs."""

import json
from contextlib import suppress

import can
import pytest
from can.io import ASCWriter, BLFWriter, CanutilsLogWriter
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.__main__ import app
from onboard.bringup.can.candump import ReceivedFrame, parse
from onboard.bringup.can.decode import Decoder
from onboard.bringup.can.names import UnknownNameError, frames_of
from onboard.bringup.can.show import line_of, row_of
from protocol.can.guard import Sender
from protocol.generated.can_codec import TABLE
from protocol.generated.can_frames import FRAMES
from tests.onboard.stand_clock import beats

GOOD = ReceivedFrame(1_436_509_052_249_713_000, 0x181, bytes(range(8)))
MS = 1_000_000


def run(*words, text=None):
    return CliRunner().invoke(app, ["can", "decode", *words], input=text)


@pytest.mark.parametrize(("line", "heard"), [
    ("(1436509052.249713) vcan0 181#0001020304050607", GOOD),
    ("(1436509052.249713) vcan0 181#0001020304050607 R", GOOD),
    ("(1436509052.249713) vcan0 181#00.01.02.03.04.05.06.07", GOOD),
    (" (1436509052.249713)  vcan0  181   [8]  00 01 02 03 04 05 06 07", GOOD),
    (" (1436509052.249713)  vcan0  RX - -  181   [8]  00 01 02 03 04 05 06 07   '........'", GOOD),
    (" (2015-07-10 06:17:32.249713)  can0  181   [8]  00 01 02 03 04 05 06 07", GOOD),
    ("  vcan0  181   [8]  00 01 02 03 04 05 06 07", GOOD._replace(stamp_ns=None)),
    ("(000.000100)  can0  1A1   [2]  0f F0", ReceivedFrame(100_000, 0x1A1, b"\x0f\xf0")),
    ("can0 300#", ReceivedFrame(None, 0x300, b"")),
    ("can0 300#R", ReceivedFrame(None, 0x300, b"", "remote frame")),
    ("  can0  300   [0]  remote request", ReceivedFrame(None, 0x300, b"", "remote frame")),
    ("can0 00000181#00", ReceivedFrame(None, 0x181, b"\0", "extended frame")),
    ("can0 20000040#0000000000000000", ReceivedFrame(None, 0x20000040, bytes(8), "error frame")),
    ("  can0  20000040   [8]  00 00 00 00 00 00 00 00   ERRORFRAME",
        ReceivedFrame(None, 0x20000040, bytes(8), "error frame")),
    ("can0 181##1001122", ReceivedFrame(None, 0x181, b"\x00\x11\x22", "CAN FD frame")),
    ("  can0  181  [02]  11 22", ReceivedFrame(None, 0x181, b"\x11\x22", "CAN FD frame")),
    ("", None), ("   \n", None),
])  # fmt: skip
def test_a_line_of_candump_is_read_in_each_of_its_forms(line, heard):
    assert parse(line) == heard


@pytest.mark.parametrize("line", [
    "hello", "can0 181",
    "can0 18#00", "can0 181#0", "can0 181#001122334455667788", "(x) can0 181#00",
    "(06:17.2) can0 181#00", "(2015-13-10 06:17:32.2)  can0  181   [0]",
    "can0  181   [3]  00 11", "can0  181   [1]  00 11", "can0  181   [1]  00 and more", "can0 181#GG",
])  # fmt: skip
def test_any_other_line_is_refused(line):
    with pytest.raises(ValueError):
        parse(line)


@settings(max_examples=300, deadline=None, derandomize=True, database=None)
@given(st.text() | st.from_regex(r"\(?[0-9.]{0,9}\)? ?can0 [0-9A-F]{0,8}[# ]?\[?[0-9]?\]?[0-9A-F ]{0,20}"))
def test_no_text_raises_anything_else(text):
    with suppress(ValueError):
        assert parse(text) is None or isinstance(parse(text), ReceivedFrame)


def wheel(counter, **changes):
    return TABLE[0x181].encode(changes.get("steer", 0.1234), 17, -1.5, 1, counter)


def test_a_good_frame_is_its_signals_with_units_and_as_many_decimals_as_the_wire():
    seen = Decoder().receive(ReceivedFrame(1_500_000_000, 0x181, wheel(0)))
    assert line_of(seen) == (
        "    1.500000  WHEEL_1_FEEDBACK         "
        "steer_rad 0.1234 rad  encoder_count 17 count  rate_radps -1.5000 rad/s  state RUNNING"
    )
    row = row_of(seen)
    assert (row["t_s"], row["node"], row["problems"]) == (1.5, "WHEEL_1", [])
    assert row["values"] == {
        "steer_rad": pytest.approx(0.1234),
        "encoder_count": 17,
        "rate_radps": -1.5,
        "state": "RUNNING",
    }


@pytest.mark.parametrize(("frames", "problems"), [
    ([(0, wheel(0)), (10, wheel(1))], ()),
    ([(0, wheel(15)), (10, wheel(0))], ()),
    ([(0, wheel(0)), (10, wheel(4))], ("lost 3",)),
    ([(0, wheel(0)), (10, wheel(0))], ("repeated",)),
    ([(0, wheel(0)), (26, wheel(1))], ("late",)),
    ([(0, wheel(0)), (26, wheel(2))], ("late", "lost")),
    ([(0, wheel(0)), (10, wheel(1)[:7])], ("length",)),
    ([(0, wheel(0)), (10, bytes([1]) + wheel(1)[1:])], ("crc",)),
])  # fmt: skip
def test_what_is_wrong_with_a_frame_is_named(frames, problems):
    decoder = Decoder()
    seen = [decoder.receive(ReceivedFrame(at_ms * MS, 0x181, data)) for at_ms, data in frames][-1]
    assert seen.problems == problems
    assert (seen.values is None) == bool({"crc", "length", "repeated"} & set(problems))


def test_what_is_no_frame_of_the_dbc_is_shown_and_counted():
    decoder = Decoder()
    assert decoder.receive(ReceivedFrame(0, 0x7FF, b"\1")).problems == ("not in the DBC",)
    assert decoder.receive(ReceivedFrame(0, 0x20000040, bytes(8), "error frame")).node is None
    assert dict(decoder.others) == {"0x7ff not in the DBC": 1, "0x20000040 error frame": 1}


def test_names_are_found_by_pattern_id_and_node_and_a_wrong_one_is_met_with_the_nearest():
    assert frames_of([], []) == FRAMES.keys()
    assert frames_of(["wheel_*_status"], []) == {0x1A1, 0x1A2, 0x1A3, 0x1A4}
    assert frames_of(["0x181", "IMU_GYRO"], ["IMU"]) == {0x1D0}
    assert frames_of([], ["tilt"]) == {0x015, 0x1C0, 0x305}
    with pytest.raises(UnknownNameError, match="did you mean WHEEL_1_FEEDBACK"):
        frames_of(["WHEEL_1_FEDBACK"], [])
    with pytest.raises(UnknownNameError, match="no node WHEEL_7; did you mean WHEEL_"):
        frames_of([], ["WHEEL_7"])
    with pytest.raises(UnknownNameError, match="no frame 0x7ff"):
        frames_of(["0x7ff"], [])


@pytest.fixture(scope="module")
def messages():
    return [
        can.Message(
            timestamp=100.0 + frame.stamp_ns / 1e9, arbitration_id=frame.can_id, data=frame.data, is_extended_id=False
        )
        for _, frames in beats(30)
        for frame in frames
    ]


@pytest.mark.parametrize(("suffix", "writer"), [(".log", CanutilsLogWriter), (".asc", ASCWriter), (".blf", BLFWriter)])
def test_a_log_written_by_python_can_decodes_without_an_error(suffix, writer, messages, tmp_path):
    path = tmp_path / f"rover{suffix}"
    with writer(str(path)) as out:
        for message in messages:
            out(message)
    got = run(str(path), "--json")
    assert got.exit_code == 0, got.output
    rows = [json.loads(line) for line in got.stdout.splitlines()]
    assert [(row["id"], row["data"]) for row in rows] == [(m.arbitration_id, m.data.hex()) for m in messages]
    assert all(row["problems"] == [] and row["values"] for row in rows)
    times = [row["t_s"] - rows[0]["t_s"] for row in rows]
    assert times == pytest.approx([m.timestamp - messages[0].timestamp for m in messages], abs=1e-4)


def log(*frames):
    return "".join(f"({at_ms / 1000:.6f}) can0 {can_id:03X}#{data.hex()}\n" for at_ms, can_id, data in frames)


def test_a_bad_line_is_told_with_its_number_and_the_rest_goes_on(tmp_path):
    path = tmp_path / "cut.log"
    path.write_text(log((0, 0x181, wheel(0))) + "(0.01) can0 181#00112\n" + log((20, 0x181, wheel(1))))
    got = run(str(path))
    assert got.exit_code == 0
    assert len(got.stdout.splitlines()) == 2
    told = "its bytes are no pairs of hexadecimal digits: '(0.01) can0 181#00112'"
    assert got.stderr == f"onboard: {path}:2: {told}\n"


def test_errors_shows_bad_frames_only_and_a_table_of_them():
    damaged = bytes([wheel(2)[0] ^ 1]) + wheel(2)[1:]
    text = log(
        (0, 0x181, wheel(0)),
        (10, 0x181, wheel(1)),
        (20, 0x181, damaged),
        (30, 0x181, wheel(3)),
        (40, 0x7FF, b"\1"),
        (40, 0x1D0, Sender().encode(0x1D0, 0, 0, 0, 0)),
    )
    lines = run("-", "--errors", text=text).stdout.splitlines()
    assert [line.split()[1:3] for line in lines[:3]] == [
        ["WHEEL_1_FEEDBACK", "!"],
        ["WHEEL_1_FEEDBACK", "!"],
        ["0x7ff", "!"],
    ]
    assert "crc" in lines[0] and "lost" in lines[1]
    assert lines[3].split()[:7] == ["frame", "frames", "rate/s", "late", "lost", "repeated", "crc"]
    assert lines[4].split() == ["WHEEL_1_FEEDBACK", "4", "100.0", "1", "1"]
    assert lines[5].split() == ["IMU_GYRO", "1", "-"] and lines[6] == "0x7ff not in the DBC: 1"
    last = json.loads(run("-", "--errors", "--json", text=text).stdout.splitlines()[-1])
    assert last["summary"]["WHEEL_1_FEEDBACK"]["crc"] == 1 and last["others"] == {"0x7ff not in the DBC": 1}


def test_only_and_node_show_what_they_name():
    text = "".join(log(*((f.stamp_ns / MS, f.can_id, f.data) for f in frames)) for _, frames in beats(60))
    assert {line.split()[1] for line in run("-", "--only", "imu_*", text=text).stdout.splitlines()} == {
        "IMU_GYRO",
        "IMU_ACCEL",
    }
    assert {line.split()[1] for line in run("-", "--node", "POWER", text=text).stdout.splitlines()} == {
        "POWER_STATUS",
        "NODE_HEARTBEAT_POWER",
    }


@pytest.mark.parametrize(("words", "code", "told"), [
    ((), 64, "give a log file, - for standard input, or --bus URI"),
    (("a.log", "--bus", "virtual:x"), 64, "give a log file, - for standard input, or --bus URI"),
    (("missing.log",), 66, "missing.log cannot be read: No such file or directory"),
    (("missing.blf",), 66, "missing.blf cannot be read: No such file or directory"),
    (("tests",), 66, "tests cannot be read: Is a directory"),
    (("-", "--only", "TILT_FEEDBAK"), 64, "rover.dbc has no frame TILT_FEEDBAK; did you mean TILT_FEEDBACK?"),
    (("-", "--node", "xyz"), 64, "rover.dbc has no node xyz; it has COMPUTER, WHEEL_1, WHEEL_2, WHEEL_3, WHEEL_4, "
                               "TILT ..."),
    (("pyproject.toml",), 65, "pyproject.toml is no log of a CAN bus: candump (-L or not), .asc and .blf are read"),
    (("--bus", "can0"), 78, "can.uri = 'can0' names no bus"),
    (("--bus", "socketcand:127.0.0.1:1/can0"), 69, "socketcand:127.0.0.1:1/can0 cannot be opened"),
])  # fmt: skip
def test_what_cannot_be_done_is_one_line_and_an_exit_code(words, code, told):
    got = run(*words, text="")
    assert got.exit_code == code
    assert got.stderr.splitlines()[-1].startswith(f"onboard: {told}")


def test_a_damaged_blf_is_one_line(tmp_path):
    path = tmp_path / "bad.blf"
    path.write_bytes(b"LOGG" + bytes(200))
    got = run(str(path))
    assert got.exit_code == 65 and f"onboard: {path} is damaged" in got.stderr
    path.write_bytes(b"no blf at all")
    assert run(str(path)).exit_code == 65


def test_every_signal_of_every_frame_has_a_text():
    for can_id, row in TABLE.items():
        low = [s.low for s in FRAMES[can_id].signals if s.name in row.fields]
        line = line_of(Decoder().receive(ReceivedFrame(0, can_id, row.encode(*low, 0))))
        assert all(f"  {name} " in line for name in row.fields)


def test_many_bad_lines_are_counted_and_a_file_without_a_good_one_is_given_up_at_once(tmp_path):
    path = tmp_path / "noisy.log"
    path.write_text(log((0, 0x181, wheel(0))) + "noise\n" * 50 + log((10, 0x181, wheel(1))))
    got = run(str(path))
    assert got.exit_code == 0 and len(got.stdout.splitlines()) == 2
    assert got.stderr.splitlines()[19:] == [
        f"onboard: {path}:21: no line of candump: 'noise'",
        f"onboard: {path}: 30 more lines are none of candump",
    ]
    path.write_text("noise\n" * 1000 + log((10, 0x181, wheel(1))))
    got = run(str(path))
    assert got.exit_code == 65 and got.stdout == "" and len(got.stderr.splitlines()) == 1
    assert got.stderr.endswith(f"{path}:1: no line of candump: 'noise'\n")
