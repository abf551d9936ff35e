"""Every status and every state of the emulated sensors, byte for byte, in the order of the protocol's command table."""

import dataclasses

import numpy as np
import pytest

from hil.devices.lidar.commands import COMMANDS
from hil.devices.lidar.faults import ScheduledFault
from hil.devices.lidar.profile import IDEAL, PROFILES
from hil.devices.lidar.sensor import Lidar
from protocol import scip
from tests.hil.lidar_talk import EW, FULL, MS, frames, sensor, stamps, statuses, talk

# profile, requests, whole answer: the sum characters are those of the design's table, P b Q R S T U c d e l
ANSWERS = [
    (IDEAL, b"BM|BM", b"BM\n00P\n\nBM\n02R\n\n"),
    (IDEAL, b"QT", b"QT\n00P\n\n"),
    (IDEAL, b"RS|RT", b"RS\n00P\n\nRT\n00P\n\n"),
    (IDEAL, b"RB|RB", b"RB\n01Q\n\nRB\n00P\n\n"),
    (IDEAL, b"TM1|TM2|TM9", b"TM1\n04T\n\nTM2\n03S\n\nTM9\n01Q\n\n"),
    (IDEAL, b"TM0|TM1|TM0|TM2", b"TM0\n00P\n\nTM1\n00P\n00000\n\nTM0\n02R\n\nTM2\n00P\n\n"),
    (IDEAL, b"TM0|VV|MD0000108001000|BM", b"TM0\n00P\n\nVV\n10Q\n\nMD0000108001000\n10Q\n\nBM\n10Q\n\n"),
    (IDEAL, b"SS115200|SS019200", b"SS115200\n03S\n\nSS019200\n00P\n\n"),
    (IDEAL, b"SS12345x|SS123456", b"SS12345x\n01Q\n\nSS123456\n02R\n\n"),
    (EW, b"SS115200", b"SS115200\n0Ff\n\n"),
    (dataclasses.replace(IDEAL, baud="fixed"), b"SS115200", b"SS115200\n04T\n\n"),
    (IDEAL, b"CR00|HS1", b"CR00\n04T\n\nHS1\n03S\n\n"),
    (FULL, b"CR00|CR05|CR05", b"CR00\n03S\n\nCR05\n00P\n\nCR05\n03S\n\n"),
    (FULL, b"CR11|CRx1|CR99", b"CR11\n02R\n\nCRx1\n01Q\n\nCR99\n00P\n\n"),
    (FULL, b"HS0|HS1|HS1|HS2", b"HS0\n02R\n\nHS1\n00P\n\nHS1\n02R\n\nHS2\n01Q\n\n"),
    (IDEAL, b"DBx1|DB06|DB03|DB04|DB10", b"DBx1\n01Q\n\nDB06\n02R\n\nDB03\n00P\n\nDB04\n03S\n\nDB10\n00P\n\n"),
    (dataclasses.replace(IDEAL, drills=False), b"DB03", b"DB03\n04T\n\n"),
    (IDEAL, b"BM|DB03", b"BM\n00P\n\nDB03\n05U\n\n"),
    (IDEAL, b"MDx000108001000", b"MDx000108001000\n01Q\n\n"),
    (IDEAL, b"MD0000x08001000", b"MD0000x08001000\n02R\n\n"),
    (IDEAL, b"MD00001080x1000", b"MD00001080x1000\n03S\n\n"),
    (IDEAL, b"MD0000108101000", b"MD0000108101000\n04T\n\n"),
    (IDEAL, b"MD0010000901000", b"MD0010000901000\n05U\n\n"),
    (IDEAL, b"MD0000108001x00", b"MD0000108001x00\n06V\n\n"),
    (IDEAL, b"MD00001080010x0", b"MD00001080010x0\n07W\n\n"),
    (IDEAL, b"GD0000108001", b"GD0000108001\n10Q\n\n"),
    (EW, b"HD0000108001|ND0000108001000", b"HD0000108001\n10Q\n\nND0000108001000\n00P\n\n"),
    (IDEAL, b"ND0000108001000|HE0000108001", b"ND0000108001000\n0Ee\n\nHE0000108001\n0Ee\n\n"),
    (IDEAL, b"MD000010800100|MD00001080010000", b"MD000010800100\n0Cc\n\nMD00001080010000\n0Dd\n\n"),
    (IDEAL, b"VV1|TM|SCIP2.0|XX", b"VV1\n0Dd\n\nTM\n0Cc\n\nSCIP2.0\n0Ee\n\nXX\n0Ee\n\n"),
    (EW, b"%TM1|%MD0000108001000", b"%TM1\n0Ee\n\n%MD0000108001000\n0Ee\n\n"),
    (IDEAL, b"QT;abcdefghijklmnop|QT;a-b", b"QT;abcdefghijklmnop\n00P\n\nQT;a-b\n0Hh\n\n"),
    (IDEAL, b"QT;abcdefghijklmnopq", b"QT;abcdefghijklmnopq\n0Gg\n\n"),
    (EW, b"TM0|TM1;1f|TM2", b"TM0\n00P\n\nTM1;1f\n00P\n00000\n\nTM2\n00P\n\n"),
    (IDEAL, b"%ST", b"%ST\n0Ee\n\n"),
    (EW, b"%ST|BM|%ST", b"%ST\n00P\n000@\n\nBM\n00P\n\n%ST\n00P\n003C\n\n"),
    (EW, b"MD0000108001000|%ST", b"MD0000108001000\n00P\n\n%ST\n00P\n004D\n\n"),
    (EW, b"TM0|%ST|QT|%SL|%ST", b"TM0\n00P\n\n%ST\n00P\n002B\n\nQT\n00P\n\n%SL\n00P\n\n%ST\n00P\n005E\n\n"),
    (IDEAL, b"%SL|BM|TM0|QT|BM", b"%SL\n00P\n\nBM\n10Q\n\nTM0\n10Q\n\nQT\n00P\n\nBM\n00P\n\n"),
]  # fmt: skip


@pytest.mark.parametrize(("profile", "requests", "answer"), ANSWERS, ids=[row[1].decode() for row in ANSWERS])
def test_the_table_of_answers(profile, requests, answer):
    assert talk(sensor(profile), *requests.split(b"|")) == answer
    device, bytewise = sensor(profile), b""
    for byte in requests.replace(b"|", b"\r\n") + b"\r":
        device.receive(bytes((byte,)), 0)
        device.step(0)
        bytewise += b"".join(data for _, data in device.send())
    assert bytewise == answer


def test_the_table_covers_every_command_and_the_statuses_of_each():
    asked = {scip.parse_request(line).code for _, lines, _ in ANSWERS for line in lines.split(b"|")}
    elsewhere = {"PP", "II", "MS", "ME", "GS", "GE", "NE", "%SL"}
    assert set(COMMANDS) <= asked | elsewhere


def test_a_request_line_that_is_too_long_is_refused_and_cut_to_what_others_can_read():
    reply = talk(sensor(), b"MD" + b"7" * 100_000)
    assert reply == b"MD" + b"7" * 62 + b"\n0Bb\n\n"


@pytest.mark.parametrize(("kind", "status"), [("0A", "0A"), ("0B", "0B"), ("0I", "0I"), ("0M", "0M")])
def test_general_refusals_are_a_fault_of_their_own(kind, status):
    device = sensor(IDEAL, ScheduledFault("refuse", 0.0, 1.0, kind))
    assert statuses(device, b"VV", b"BM", b"MD0000108001000") == [status] * 3
    assert statuses(device, b"QT", at_ms=1001) == ["00"]


def test_more_single_scans_than_it_can_hold_are_0b():
    asked = [b"BM"] + [b"GD0000108001"] * 10
    assert statuses(sensor(), *asked) == ["00", "0B", "0B"]


# -- time ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("command", [b"RS", b"RT"])
def test_reset_puts_the_counter_to_zero_and_the_laser_off(command):
    device = sensor()
    talk(device, b"MD0000108001000", at_ms=10)
    assert statuses(device, command, at_ms=400)[-1] == "00"
    assert not device.laser_on and device.clock_ms(450 * MS) == 50 and frames(device, 900) == []


def test_two_rb_within_a_second_reboot_and_two_that_are_further_apart_do_not():
    device = sensor(EW)
    assert statuses(device, b"RB", at_ms=0) == ["01"]
    assert statuses(device, b"RB", at_ms=1001) == ["01"]
    assert statuses(device, b"RB", at_ms=1900) == ["00"]
    assert device.reachable
    device.step(2950 * MS)
    assert not device.reachable and device.machine.boots == 1 and device.clock_ms(2950 * MS) == 50


def test_booting_takes_tcp_early_and_denies_to_measure_for_some_seconds():
    device = sensor(EW)
    device.reboot()
    assert talk(device, b"VV", at_ms=500) == b""  # not there yet
    assert device.reachable is False
    booting = [b"%ST", b"TM0", b"MD0000108001000", b"BM", b"QT"]
    assert statuses(device, *booting, at_ms=1000) == ["00", "10", "10", "10", "00"]
    assert b"001A" in talk(device, b"%ST", at_ms=3900) and b"MESM:001 Booting;" in talk(device, b"II", at_ms=3900)
    assert statuses(device, b"TM0", b"TM2", b"BM", at_ms=4001) == ["00", "00", "00"]


def test_usb_and_ideal_sensors_are_ready_when_the_link_is_there():
    for profile in (PROFILES["utm-30lx"], IDEAL):
        device = sensor(profile)
        device.reboot()
        device.step(profile.dark_ns)
        assert device.reachable and device.machine.report == "000"


def test_waking_takes_its_time():
    device = sensor(dataclasses.replace(EW, wake_ns=500 * MS))
    asleep = statuses(device, b"%SL", b"GD0000108001", b"%SL", b"VV")
    assert asleep == ["00", "10", "10", "00"]
    assert talk(device, b"QT", b"%ST", at_ms=10).endswith(b"%ST\n00P\n006F\n\n")
    assert statuses(device, b"BM", b"MD0000108001000", at_ms=500) == ["10", "10"]
    assert statuses(device, b"BM", at_ms=511) == ["00"]


def test_the_reply_tick_serves_all_that_came_before_it_and_tm1_does_not_wait():
    device = sensor(PROFILES["utm-30lx"])
    device.receive(b"TM0\n", 30 * MS)
    device.step(60 * MS)
    device.receive(b"TM1\n", 60 * MS)
    device.step(90 * MS)
    assert [at_ns for at_ns, _ in device.send()] == [50 * MS, 60_950_000]


def test_a_slower_motor_turns_slower_and_rs_gives_the_speed_back():
    device = sensor(FULL)
    talk(device, b"CR10", b"MD0000108001000", at_ms=1)
    assert set(np.diff(stamps(device, 1000))) == {27, 28}
    talk(device, b"RS", b"MD0000108001000", at_ms=1000)
    assert set(np.diff(stamps(device, 2000))) == {25}


def test_the_stamp_may_name_another_step_than_the_first():
    device = sensor(dataclasses.replace(IDEAL, stamp_step=-720, start_ms=1000.0))  # half a turn before
    talk(device, b"MD0000108001003")
    assert stamps(device, 100) == [987, 1012, 1037]


def test_motor_jitter_moves_beams_and_stamps_alike_whoever_looks():
    profile, starts = dataclasses.replace(IDEAL, motor_jitter_ns=2e6), []

    def cast(times_ns):
        starts.append(int(times_ns[0]))
        return np.full(len(times_ns), 5.0)

    device = Lidar(7, cast, profile)
    device.connect()
    talk(device, b"MD0000108001000", at_ms=200)
    found = stamps(device, 3000)
    assert found == [start // MS for start in starts]
    off_ms = (np.array(starts) / MS + 12.5) % 25 - 12.5
    assert off_ms.std() == pytest.approx(2.0, rel=0.2)
    late = sensor(profile)
    talk(late, b"MD0000108001000", at_ms=2000)
    assert set(stamps(late, 3000)) <= set(found)


# -- streams ---------------------------------------------------------------------------------------------------


def test_md_over_md_replaces_it():
    device = sensor()
    talk(device, b"MD0000108001000", at_ms=0)
    assert len(frames(device, 95)) == 4 and statuses(device, b"MD0100020001002", at_ms=96)[-1] == "00"
    later = [frame.split(b"\n")[0] for frame in frames(device, 1000)]
    assert later == [b"MD0100020001001", b"MD0100020001000"] and not device.laser_on


def test_a_single_scan_is_the_latest_and_the_stream_goes_on():
    device = sensor()
    talk(device, b"MD0000108001000", at_ms=0)
    frames(device, 110)
    (shot,) = [f for f in talk(device, b"GD0000108001;mine", at_ms=120).split(b"\n\n") if f.startswith(b"GD")]
    echo, status, stamp, *_ = shot.split(b"\n")
    assert (echo, status, scip.parse_stamp(stamp)) == (b"GD0000108001;mine", b"00P", 100)
    assert len(stamps(device, 200)) == 3


def test_two_single_scans_of_one_turn_are_the_same_scan():
    device = sensor()
    talk(device, b"BM")
    one, two = talk(device, b"GD0000108001", b"GD0000108001", at_ms=130).split(b"\n\n")[:2]
    assert one == two and device.scans == 1


@pytest.mark.parametrize("code", [b"TM0", b"%SL", b"RS", b"QT"])
def test_whatever_leaves_the_measuring_state_ends_the_stream(code):
    device = sensor()
    talk(device, b"MD0000108001000")
    assert statuses(device, code, at_ms=100)[-1] == "00"
    assert frames(device, 500) == [] and not device.laser_on


def test_counted_usb_stream_counts_on_without_its_client_and_ends():
    device = sensor(dataclasses.replace(IDEAL, usb=True))
    talk(device, b"MD0000108001010")
    device.step(60 * MS)
    device.disconnect()
    device.step(200 * MS)
    device.connect()
    assert [f.split(b"\n")[0][-2:] for f in frames(device, 1000)] == [b"01", b"00"] and not device.laser_on
    assert device.scans == 4  # the six that nobody heard were not cast


def test_half_a_request_stays_in_a_usb_sensor_and_dies_with_a_tcp_client():
    for usb, answer in ((True, b"VVQT\n0Dd\n\n"), (False, b"QT\n00P\n\n")):
        device = sensor(dataclasses.replace(IDEAL, usb=usb))
        device.receive(b"VV", 0)
        device.disconnect()
        device.connect()
        assert talk(device, b"QT") == answer


def test_full_intensity_scan_of_the_usb_sensor_is_the_logged_size_in_three_bursts_over_two_turns():
    device = sensor(PROFILES["utm-30lx"])
    talk(device, b"ME0000108001000")
    device.step(1000 * MS)
    pieces = [piece for piece in device.pieces() if piece.scan]
    assert [len(piece.data) for piece in pieces[:3]] == [2402, 2376, 1939]  # 6,717 bytes
    begun = [piece.at_ns for piece in pieces if piece.begins]
    assert np.diff(begun).mean() == pytest.approx(50 * MS, rel=0.01)
    pauses_ms = np.diff([piece.at_ns for piece in pieces[:3]]) / MS
    assert pauses_ms.tolist() == pytest.approx([24.7, 17.7])


# -- trouble ---------------------------------------------------------------------------------------------------


def test_failure_ends_the_stream_with_a_status_and_only_a_reboot_is_left():
    device = sensor(EW, ScheduledFault("fail", 0.1))
    talk(device, b"MD0000108001000")
    *good, last = frames(device, 1000)
    assert len(good) == 4 and last == b"MD0000108001000\n50U"
    asked = [b"BM", b"MD0000108001000", b"TM0", b"RS", b"%ST", b"II", b"DB03", b"RB"]
    assert statuses(device, *asked, at_ms=1000) == ["01", "0L", "0L", "0L", "00", "00", "05", "01"]
    assert b"900I" in talk(device, b"%ST", at_ms=1000) and b"STAT:Error" in talk(device, b"II", at_ms=1000)
    assert statuses(device, b"RB", at_ms=1001) == ["00"]
    device.step(7000 * MS)
    assert device.reachable and device.machine.report == "000"


def test_the_utm_says_trouble_in_the_words_of_a_real_one():
    assert b"STAT:Trouble!! Error No. =[00->33];" in talk(sensor(IDEAL, ScheduledFault("fail", 0.0)), b"II")


def test_unstable_scans_have_a_status_and_no_data():
    device = sensor(EW, ScheduledFault("unstable", 0.1, 0.1))
    talk(device, b"MD0000108001000")
    found = frames(device, 300)
    assert [frame.split(b"\n")[1] for frame in found] == [b"99b"] * 4 + [b"0Mm"] * 4 + [b"99b"] * 4
    device = sensor(EW, ScheduledFault("unstable", 0.0))
    assert talk(device, b"%ST") == b"%ST\n00P\n100A\n\n" and statuses(device, b"BM", b"MD0000108001000") == ["01", "0M"]


@pytest.mark.parametrize(
    ("code", "kinds"),
    [
        (b"DB01", ["99"] * 30),
        (b"DB03", ["99"] * 9 + ["21", "98"] + ["99"] * 10),
        (b"DB04", ["99"] * 9 + ["21", "50"]),
        (b"DB05", ["99"] * 19 + ["50"]),
    ],
)
def test_the_vendors_fault_drill(code, kinds):
    device = sensor()
    talk(device, code, b"MD0000108001000")
    assert [scip.parse_reply(frame).status for frame in frames(device, 750)] == kinds
    failed = kinds[-1] == "50"
    assert statuses(device, b"RS", at_ms=760)[-1] == ("0L" if failed else "00")
    assert statuses(device, b"DB10", b"BM", at_ms=770) == ["00", "00"]


def test_db02_fails_at_once():
    assert statuses(sensor(), b"DB02", b"MD0000108001000", b"DB10", b"MD0000108001000") == ["00", "0L", "00", "00"]


# -- what every client needs -----------------------------------------------------------------------------------


@pytest.mark.parametrize("profile", PROFILES.values(), ids=PROFILES)
def test_lines_are_short_ends_are_bare_and_replies_come_in_time(profile):
    device, asked = sensor(profile), b"VV PP II %ST BM TM0 TM1 TM2 QT RS MD0000108001001".split()
    for k, line in enumerate(asked):
        asked_ns = k * 200 * MS
        device.receive(line + b"\r\n", asked_ns)
        device.step(asked_ns + 199 * MS)
        pieces = device.pieces()
        data = b"".join(piece.data for piece in pieces)
        assert pieces[0].at_ns - asked_ns < 140 * MS
        assert data.endswith(b"\n\n") and b"\r" not in data and max(map(len, data.split(b"\n"))) <= 71


def test_pp_has_8_keys_and_ii_has_7():
    for profile in PROFILES.values():
        device = sensor(dataclasses.replace(profile, reply_tick_ns=0))
        assert len(scip.parse_text(scip.parse_reply(talk(device, b"PP")[:-2]))) == 8
        assert len(scip.parse_text(scip.parse_reply(talk(device, b"II")[:-2]))) == 7
