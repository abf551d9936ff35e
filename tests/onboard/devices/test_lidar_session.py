"""The session: texts read twice, modes, refusals, watchdogs, laser off; against a sensor that answers from a script."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from hil.devices.lidar import profile as profiles
from onboard.devices.lidar.phases import CONNECTING, SEEDING, Phase
from onboard.devices.lidar.watch import Watch
from onboard.records import BeamStatus
from protocol import scip
from tests.onboard.lidar_rig import II, TICK_NS, Rig, Script, half_request, stray_stream, time_adjustment
from tests.protocol.scip.test_scip import PP, VV
from tests.protocol.wire import flipped

TURN_TICKS = 5  # the script streams at 20 Hz, so that its turns fall on ticks


def frame(request, stamp_ms, value=2000, remaining=0):
    """One scan whose values are all alike."""
    kind = request.kind
    if kind.echoes > 1:
        values = np.full((request.beams, 3, request.channels), scip.MISSING, np.int32)
        values[:, 0], values[::2, 1] = value, value + 500
    else:
        values = np.full((request.beams, request.channels), value, np.int32)
        values[:, 1:] = 700
    echo = request.line(remaining) if request.streams else request.line()
    return scip.scan_reply(request, echo, stamp_ms, values)


def acknowledged(request):
    return scip.reply(request.line(), "00")


# -- texts ------------------------------------------------------------------------------------------------------


def test_texts_are_read_twice_and_ii_may_differ_in_its_time():
    later = II.replace(scip.text_line("TIME", "4991D0"), scip.text_line("TIME", "499210"))
    rig = Script({b"II": [II, later]})
    assert rig.run(30, lambda: rig.session.ready)
    assert rig.asked == [b"QT", b"VV", b"VV", b"PP", b"PP", b"II", b"II"]
    assert rig.session.counts["disagree"] == 0 and rig.session.info["TIME"] == "499210"


@pytest.mark.parametrize("code", [b"VV", b"PP", b"II"])
def test_a_text_that_disagrees_is_read_until_two_in_a_row_agree(code):
    good = {b"VV": VV, b"PP": PP, b"II": II}[code]
    key, value = {b"VV": ("SERI", "00903971"), b"PP": ("DMAX", "60000"), b"II": ("STAT", "Sensor works well.")}[code]
    legal = good.replace(scip.text_line(key, value), scip.text_line(key, value[:-1] + "7"))
    assert legal != good
    rig = Script({code: [good, legal, good, good]})
    assert rig.run(40, lambda: rig.session.ready)
    assert rig.session.counts["disagree"] == 2 and rig.session.info[key] == value


def test_a_damaged_text_is_asked_for_again_at_once():
    rig = Script({b"PP": [flipped(PP, 40), PP]})
    assert rig.run(30, lambda: rig.session.ready)
    assert rig.session.counts["text_sum"] == 1 and rig.session.counts["timeouts"] == 0 and rig.tick < 15


def test_a_wrong_model_is_told_and_never_asked_to_measure():
    rig = Script(
        {
            b"PP": PP.replace(
                b"MODL:UTM-30LX(Hokuyo Automatic Co.,Ltd.);U",
                scip.text_line("MODL", "URG-04LX(Hokuyo Automatic Co.,Ltd.)")[:-1],
            ),
            b"VV": VV.replace(
                b"PROD:SOKUIKI Sensor TOP-URG UTM-30LX;P", scip.text_line("PROD", "SOKUIKI Sensor URG-04LX")[:-1]
            ),
        }
    )
    rig.session.stream(True)
    rig.run(100)
    assert "URG-04LX" in rig.session.complaint and "lidar.model = 'UTM-30LX'" in rig.session.complaint
    assert b"MD0000108001000" not in rig.asked and not rig.session.ready
    assert "\n" not in rig.session.complaint


def test_what_is_no_hokuyo_is_told_in_one_line():
    rig = Script({code: b"login: \n\n" for code in (b"QT", b"VV", b"PP", b"II")})
    rig.run(300)
    assert rig.session.complaint.startswith("no SCIP answer on tcp:") and "\n" not in rig.session.complaint
    assert 10 < len(rig.asked) <= 20  # every 0.15 s


# -- modes ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("command", "line"), [
    ("MD", b"MD0000108001000"), ("MS", b"MS0000108001000"), ("ME", b"ME0000108003000"), ("ND", b"ND0000108001000"),
    ("NE", b"NE0000108003000"),
])  # fmt: skip
def test_every_stream_gives_scans_and_intensity_by_usb_is_clustered(command, line):
    request = scip.ScanRequest(command, 0, 1080, int(line[10:12]))
    rig = Script({line: acknowledged(request)}, command=command)
    rig.session.stream(True)
    assert rig.run(30, lambda: line in rig.asked)
    for k in range(5):
        rig.run(TURN_TICKS)
        rig.down += frame(request, 1000 + 50 * k)
    rig.run(1)
    scan = rig.scans[-1]
    assert len(rig.scans) == 5 and rig.session.bad == 0
    assert len(scan.ranges_m) == request.beams and np.allclose(scan.ranges_m, 2.0)
    assert (scan.intensity is None) == (command not in ("ME", "NE"))
    assert scan.intensity is None or (scan.intensity == 700).all() or command == "NE"
    assert (scan.further_m is None) == (command[0] != "N")
    if scan.further_m is not None:
        assert np.allclose(scan.further_m[::2, 0], 2.5) and np.isnan(scan.further_m[1::2]).all()
        assert np.isnan(scan.further_m[:, 1]).all()


def test_a_cluster_stands_for_the_middle_of_its_steps():
    request = scip.ScanRequest("MD", 180, 899, 3, 1)
    rig = Script({request.line(): acknowledged(request)}, first_step=180, last_step=899, cluster=3, skip=1)
    rig.session.stream(True)
    rig.run(12)
    rig.down += frame(request, 1000)
    rig.run(1)
    scan = rig.scans[0]
    assert len(scan.ranges_m) == 240 and scan.step_rad == pytest.approx(math.radians(0.75))
    assert scan.first_angle_rad == pytest.approx(math.radians(-135 + 181 * 0.25))
    assert scan.beam_ns == pytest.approx(3 * 25e6 / 1440)


@pytest.mark.parametrize("config", [{"wide_intensity": True}, {"cluster": 4}, {"first_step": 400, "last_step": 700}])
def test_the_usb_limit_of_intensity_yields_to_what_respects_or_overrules_it(config):
    rig = Script(command="ME", **config)
    assert rig.run(30, lambda: rig.session.ready)
    asked = rig.session.request
    assert asked.cluster == config.get("cluster", 1) and asked.first == config.get("first_step", 0)


def test_intensity_by_ethernet_is_not_limited():
    rig = Script(
        {
            b"II": II.replace(
                b"SBPS:USB Full Speed;" + scip.checksum(b"SBPS:USB Full Speed") + b"\n",
                scip.text_line("SBPS", "Ethernet 100 [Mbps]"),
            )
        },
        command="ME",
    )
    assert rig.run(30, lambda: rig.session.ready)
    assert rig.session.request.cluster == 1


def test_single_scans_are_asked_for_one_by_one_with_the_laser_on():
    rig = Rig(command="GD")
    rig.session.stream(True)
    rig.run(150)
    assert rig.asked[7:9] == [b"BM", b"GD0000108001"] and len(rig.scans) > 20 and rig.session.bad == 0
    rig.session.stream(False)
    rig.run(20)
    assert not rig.twin.laser_on and rig.session.dark


def test_a_counted_stream_is_asked_for_again_when_its_count_is_down():
    rig = Rig(scans=7)
    rig.session.stream(True)
    rig.run(200)
    assert rig.asked.count(b"MD0000108001007") >= 5 and len(rig.scans) >= 7 * (rig.asked.count(b"MD0000108001007") - 1)
    assert rig.session.bad == 0


def test_a_thinned_stream_brings_one_scan_of_so_many_turns_and_whole_ones_come_back():
    rig = Rig()
    rig.session.stream(True, turns=4)
    rig.run(200)
    assert b"MD0000108001300" in rig.asked
    starts = [scan.start_ns for scan in rig.scans]
    assert np.diff(starts) == pytest.approx(100e6, abs=1e6)
    rig.session.stream(True)
    rig.run(100)
    assert b"MD0000108001000" in rig.asked
    assert np.diff([scan.start_ns for scan in rig.scans[-20:]]) == pytest.approx(25e6, abs=1e6)
    assert rig.session.bad == rig.session.counts["missed"] == 0


def test_a_thinned_stream_is_silent_after_four_of_its_own_periods():
    rig = Rig()
    rig.session.stream(True, turns=4)
    rig.run(200)
    last_ns = rig.session._stream.heard_ns
    rig.twin.disconnect()
    rig.run(200, lambda: rig.session.silent(rig.now_ns))
    assert 0.45e9 < rig.now_ns - last_ns <= 0.45e9 + 2 * TICK_NS


def test_no_change_between_whole_and_thinned_streams_is_called_silence():
    rig, silent = Rig(), []
    assert rig.run(100, lambda: rig.session.ready)
    for turns in (4, 1, 4, 2, 1):
        rig.session.stream(True, turns)
        for _ in range(60):
            rig.run(1)
            silent.append(rig.session.silent(rig.now_ns))
    assert len(rig.scans) > 40 and not any(silent)


def test_a_remaining_count_that_does_not_fall_as_the_stamps_say_costs_that_scan():
    request = scip.ScanRequest("MD", 0, 1080, 1, 0, 50)
    rig = Script({request.line(): acknowledged(request)}, scans=50)
    rig.session.stream(True)
    assert rig.run(30, lambda: request.line() in rig.asked)
    for k, left in enumerate((49, 48, 41, 46, 45, 43, 42)):  # 41 is damaged, 44 was lost with its turn
        rig.run(3)
        rig.down += frame(request, 1000 + 25 * (k + (k > 4)), remaining=left)
    rig.run(1)
    assert rig.session.counts["echo"] == 1 and len(rig.scans) == 6 and rig.session.counts["missed"] == 2


def test_a_sensor_that_refuses_the_mode_says_why():
    rig = Script({b"ND0000108001000": scip.reply(b"ND0000108001000", "0E")}, command="ND")
    rig.session.stream(True)
    rig.run(100)
    assert "ND (0E: unknown command)" in rig.session.complaint
    assert rig.asked.count(b"ND0000108001000") == 1


def test_a_refusal_that_may_pass_is_tried_again_soon():
    line, request = b"MD0000108001000", scip.ScanRequest("MD", 0, 1080)
    rig = Script({line: [scip.reply(line, "0L"), scip.reply(line, "10"), acknowledged(request)]})
    rig.session.stream(True)
    assert rig.run(60, lambda: rig.session.streaming)
    assert rig.asked.count(line) == 3 and rig.session.counts["refused"] == 2


# -- any state --------------------------------------------------------------------------------------------------


def test_a_sensor_that_takes_nothing_but_tm_is_led_out_of_time_adjustment():
    rig = Script({b"QT": [scip.reply(b"QT", "10"), b"QT\n00P\n\n"], b"TM2": scip.reply(b"TM2", "00")})
    assert rig.run(30, lambda: rig.session.ready)
    assert rig.asked[:4] == [b"QT", b"TM2", b"QT", b"VV"] and rig.session.counts["timeouts"] == 0


def second_readings_ns(rig):
    """Time of the 3 second readings: by the tick's raster each costs what a reply does."""
    return 3 * 3 * TICK_NS


@pytest.mark.parametrize("before", [lambda twin: None, half_request, stray_stream, time_adjustment])
@pytest.mark.parametrize("offset", [0, 1, 2, 3, 4])
def test_the_stream_is_on_within_300_ms_without_the_second_readings(before, offset):
    rig = Rig(dataclasses.replace(profiles.UTM30LX))
    before(rig.twin)
    rig.twin.step(30_000_000)
    rig.tick = 3 + offset
    rig.session.stream(True)
    assert rig.run(60, lambda: rig.session.streaming)
    assert (rig.tick - 4 - offset) * TICK_NS - second_readings_ns(rig) <= 300_000_000
    assert rig.session.counts["timeouts"] == 0


def test_a_sensor_that_boots_is_met_within_300_ms_of_its_end():
    rig = Script({b"QT": [b""]})
    rig.run(200)
    rig.replies[b"QT"] = b"QT\n00P\n\n"
    assert rig.run(30, lambda: rig.session.ready)


def woken(twin):
    twin.receive(b"%SL\n", 0)
    return 0  # QT wakes it, at the first tick


def booted(twin):
    twin.reboot()
    return twin.profile.dark_ns + twin.profile.denied_ns


@pytest.mark.parametrize("before", [woken, booted])
@pytest.mark.parametrize("offset", [0, 1, 2, 3, 4])
def test_the_stream_is_on_within_300_ms_of_the_end_of_sleep_or_boot(before, offset):
    rig = Rig(profiles.UTM30LX_EW)
    ends_ns = before(rig.twin)
    rig.twin.step(30_000_000)
    rig.tick = began = 3 + offset
    rig.session.stream(True)
    assert rig.run(600, lambda: rig.session.streaming)
    own_ns = rig.twin.profile.wake_ns + began * TICK_NS if before is woken else ends_ns
    assert rig.now_ns - own_ns - second_readings_ns(rig) <= 300_000_000


# -- watchdogs --------------------------------------------------------------------------------------------------


def streaming(**replies):
    request = scip.ScanRequest("MD", 0, 1080)
    rig = Script({request.line(): acknowledged(request), **replies})
    rig.session.stream(True)
    assert rig.run(30, lambda: rig.session.streaming)
    rig.stamp_ms = 0

    def turn(value=2000, passed_ms=50, ticks=TURN_TICKS):
        rig.run(ticks)
        rig.stamp_ms += passed_ms
        rig.down += frame(request, rig.stamp_ms, value)

    rig.turn = turn
    return rig


def test_a_silent_stream_is_suspected_and_the_state_is_read_before_it_begins_anew():
    rig = streaming()
    for _ in range(10):
        rig.turn()
    rig.asked.clear()
    rig.run(35)
    assert rig.asked[:5] == [b"II", b"II", b"QT", b"VV", b"VV"]
    assert rig.session.counts["laser_off"] == 1 and rig.session.counts["unhealthy"] == 0


def test_scans_that_come_again_end_the_suspicion():
    rig = streaming()
    for _ in range(10):
        rig.turn()
    rig.run(17)
    assert rig.asked[-1] == b"II"
    rig.turn(passed_ms=200, ticks=0)
    rig.run(1)
    assert rig.session.streaming and rig.session.counts["gap"] == 1 and rig.session.counts["missed"] == 7 + 9


def test_a_stream_is_never_asked_for_its_state():
    rig = Rig(health_ns=100_000_000)
    rig.session.stream(True)
    rig.run(40)
    rig.asked.clear()
    rig.run(200)
    assert not rig.asked


def test_an_idle_sensor_tells_its_state_every_few_seconds_and_trouble_is_counted():
    trouble = II.replace(
        scip.text_line("STAT", "Sensor works well."), scip.text_line("STAT", "Trouble!! Error No. =[00->33]")
    )
    rig = Script({b"II": [II, II, trouble]}, health_ns=1_000_000_000)
    rig.run(450)
    assert rig.asked.count(b"II") == 2 + 2 * 4 and rig.session.counts["unhealthy"] == 4
    assert rig.session.info["STAT"].startswith("Trouble")


def test_scans_of_errors_alone_are_counted():
    rig = streaming()
    for value in (2000, 5, 3, 1, 2000):
        rig.turn(value)
    rig.run(1)
    assert rig.session.counts["all_error"] == 2  # a code 1 is no error: nothing was in range
    assert [int(scan.status[0]) for scan in rig.scans] == [
        BeamStatus.OK,
        BeamStatus.ERROR,
        BeamStatus.INTERFERENCE,
        BeamStatus.NO_RETURN,
        BeamStatus.OK,
    ]


def test_a_hardware_status_in_the_stream_is_told():
    rig = streaming()
    rig.down += scip.reply(b"MD0000108001000", "64")
    rig.run(1)
    assert rig.session.complaint == "the sensor stopped: hardware trouble" and rig.session.counts["status"] == 1


@pytest.mark.parametrize(("turn_ms", "off"), [(25.0, 0), (25.2, 0), (24.85, 0), (25.3, 1), (24.7, 1)])
def test_a_period_more_than_one_percent_off_is_counted_once_in_100_turns(turn_ms, off):
    counts = dict.fromkeys(("gap", "missed", "period_off", "all_error", "laser_off", "unhealthy"), 0)
    watch = Watch(counts)
    for k in range(150):
        watch.scan(int(k * turn_ms) % 2**24, int(k * turn_ms * 1e6), np.zeros(3, np.uint8))
    assert counts == {**dict.fromkeys(counts, 0), "period_off": off}


# -- the end ----------------------------------------------------------------------------------------------------


def test_the_farewell_does_not_wait_for_a_reply_and_sees_the_laser_off():
    rig = Rig()
    rig.session.stream(True)
    rig.run(40)
    rig.up = rig.session.farewell(rig.now_ns)
    assert rig.up == b"\nQT\n" and not rig.session.dark
    assert rig.run(30, lambda: rig.session.dark)
    assert not rig.twin.laser_on and rig.asked[-2:] == [b"II", b"II"]


def test_a_laser_that_is_still_on_is_stopped_again():
    on = II.replace(scip.text_line("LASR", "OFF"), scip.text_line("LASR", "ON"))
    rig = streaming()
    rig.replies[b"II"] = [on, on, II]
    rig.session.stream(False)
    assert rig.run(30, lambda: rig.session.dark)
    assert rig.asked[-6:] == [b"QT", b"II", b"II", b"QT", b"II", b"II"]


def test_a_sensor_is_ready_in_every_phase_but_those_of_connecting():
    assert [p for p in Phase if p not in CONNECTING] == [
        Phase.QUIET,
        Phase.HEALTH,
        Phase.LASER,
        Phase.STREAM,
        Phase.SUSPECT,
        Phase.STOP,
        Phase.DARK,
        *sorted(SEEDING),
    ]


def test_pause_between_two_streams_is_no_gap():
    request = scip.ScanRequest("MD", 0, 1080)
    rig = Script({request.line(): acknowledged(request)})
    for begin_ms in (1000, 4000):
        rig.session.stream(True)
        assert rig.run(60, lambda: rig.session.streaming)
        for k in range(3):
            rig.run(TURN_TICKS)
            rig.down += frame(request, begin_ms + 50 * k)
        rig.run(2)
        rig.session.stream(False)
        rig.run(200)
    assert len(rig.scans) == 6 and rig.session.counts["gap"] == 0
