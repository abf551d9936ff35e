"""What firmware does besides the standard: each switch of the profile, byte for byte."""

import dataclasses

from hil.devices.lidar.profile import IDEAL, UTM30LX_EW, Quirks
from protocol import scip
from tests.hil.lidar_talk import EW, MS, frames, sensor, statuses, talk


def quirky(base=IDEAL, **switches):
    return sensor(dataclasses.replace(base, quirks=dataclasses.replace(base.quirks, **switches)))


def test_ew_answers_tm1_outside_tm_and_takes_tm0_twice_and_shows_what_it_is_meanwhile():
    assert talk(sensor(EW), b"TM1") == b"TM1\n00P\n00000\n\n"
    assert statuses(sensor(EW), b"TM0", b"TM0", b"VV", b"II", b"PP", b"TM2", b"TM2") == ["00"] * 4 + ["10", "00", "03"]


def test_qt_leaves_tm_mode():
    assert statuses(sensor(), b"TM0", b"QT", b"TM1", b"BM") == ["00", "00", "04", "00"]


def test_old_firmware_does_not_hear_the_first_qt_of_a_stream():
    device = quirky(deaf_quit=True)
    assert talk(device, b"QT") == b"QT\n00P\n\n"
    talk(device, b"MD0000108001000")
    assert talk(device, b"QT", at_ms=5) == b"" and device.laser_on
    assert talk(device, b"QT", at_ms=6) == b"QT\n00P\n\n" and not device.laser_on


def test_ii_may_say_measuring_for_a_while_after_qt():
    device = quirky(UTM30LX_EW, late_idle_ns=100 * MS)
    device.receive(b"MD0000108001000\nQT\n", 0)
    device.receive(b"II\n", 60 * MS)
    device.receive(b"II\n", 120 * MS)
    device.step(200 * MS)
    lines = b"".join(data for _, data in device.send()).split(b"\n")
    assert [line[5:9] for line in lines if b"MESM" in line] == [b"004 ", b"000 "]


def test_sums_of_old_firmware():
    line = b"SCSP:Initial(2400[rpm])<-Default setting by user;"
    arrow = line.partition(b"<-")[0]
    for name, summed in (("", line[:-1]), ("sum_with_semicolon", line), ("sum_stops_at_arrow", arrow)):
        switches = {name: True} if name else {}
        assert line + scip.checksum(summed) + b"\n" in talk(quirky(**switches), b"II")


def test_blanks_and_coded_time_of_other_firmware():
    assert b"\nDMIN: 23;W\n" in talk(quirky(leading_blanks=True), b"PP")
    assert b"\nTIME:000<;" in talk(quirky(time_in_characters=True), b"II", at_ms=12)


def test_the_last_cluster_may_be_left_out():
    for floor, beams in ((False, 361), (True, 360)):
        device = quirky(cluster_floor=floor)
        talk(device, b"MD0000108003001")
        (frame,) = frames(device, 100)
        size = sum(len(line) - 1 for line in frame.split(b"\n")[3:])
        assert size == beams * 3


def test_no_quirk_is_left_untried():
    tried = {
        "state_command",
        "timing_answers",
        "time_anywhere",
        "time_twice",
        "deaf_quit",
        "late_idle_ns",
        "cluster_floor",
        "sum_with_semicolon",
        "sum_stops_at_arrow",
        "leading_blanks",
        "time_in_characters",
    }
    assert {field.name for field in dataclasses.fields(Quirks)} == tried
