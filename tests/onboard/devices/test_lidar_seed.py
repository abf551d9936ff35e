"""What is asked once a connection: TM, which bounds the constant delay of a scan's time, and the state code %ST."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from hil.devices.lidar import profile as profiles
from onboard.config import Lidar as LidarConfig
from protocol import scip
from tests.onboard.lidar_rig import TICK_NS, Rig, Script
from tests.protocol.wire import flipped

MD = b"MD0000108001000"
SEEDING = [b"TM0", *8 * [b"TM1"], b"TM2"]
PROFILES = [profiles.UTM30LX, profiles.UTM30LX_EW]


def flown(profile, ticks=600, slow_ns=0, **config):
    """A rig that streamed for a while."""
    rig = Rig(profile, time_seed=True, **config)
    rig.twin.slow_ns = slow_ns
    rig.session.stream(True)
    rig.run(ticks)
    assert len(rig.scans) > 100 and rig.session.bad == 0
    return rig


def constant_error_ns(rig):
    """Middle error of the scans' times, once the clock is settled, by the turns as the motor made them."""
    turns = rig.twin.turns
    errors = [s.start_ns - turns.start_ns(round(s.start_ns / turns.turn_ns)) for s in rig.scans[100:]]
    return float(np.median(errors))


# -- TM ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("profile", PROFILES, ids=lambda p: p.name)
@pytest.mark.parametrize("slow_ns", [0, 4_000_000])  # the reply's way alone: the worst that a round trip can hide
@pytest.mark.parametrize("wrong_ns", [-11_000_000, 11_000_000])
def test_after_the_seed_a_wrong_constant_is_right_to_half_a_round_trip(profile, slow_ns, wrong_ns):
    profile = dataclasses.replace(profile, rate_error=80e-6, jitter_ns=0.0)
    true_ns = 0.75 * profile.turn_ns + profile.latency_ns + slow_ns
    rig = flown(profile, slow_ns=slow_ns, latency_ns=round(true_ns + wrong_ns))
    round_trip_ns = profile.time_reply_ns + slow_ns
    whole_ms_ns = 1_000_000  # the counter is cut to milliseconds, and stamps at turns of whole ms do not tell where
    blur_ns = 500_000 if profile.turn_ns == 25e6 else 50_000
    assert abs(constant_error_ns(rig)) <= (round_trip_ns + whole_ms_ns) / 2 + blur_ns
    assert rig.session.info["TM"] == f"8 exchanges, the quickest in {round_trip_ns * 1e-6:.2f} ms"


@pytest.mark.parametrize("profile", PROFILES, ids=lambda p: p.name)
def test_without_the_seed_the_same_constant_stays_wrong(profile):
    rig = Rig(dataclasses.replace(profile, jitter_ns=0.0), latency_ns=8_000_000)
    rig.session.stream(True)
    rig.run(600)
    assert abs(constant_error_ns(rig)) > 8e6 and "TM" not in rig.session.info
    assert not set(rig.asked) & set(SEEDING)


@pytest.mark.parametrize("profile", PROFILES, ids=lambda p: p.name)
def test_counter_that_wraps_inside_the_seed_bounds_the_same(profile):
    first = Rig(profile, time_seed=True)
    first.session.stream(True)
    assert first.run(100, lambda: first.asked.count(b"TM1") == 4)
    fourth_ms = first.twin.clock_ms(first.now_ns)
    rig = flown(dataclasses.replace(profile, start_ms=scip.STAMP_MODULUS - fourth_ms), latency_ns=8_000_000)
    assert rig.twin.clock_ms(first.now_ns - TICK_NS) > scip.STAMP_MODULUS - 20 and rig.twin.clock_ms(first.now_ns) < 20
    plain = flown(profile, latency_ns=8_000_000)
    assert constant_error_ns(rig) == constant_error_ns(plain)
    assert rig.session.clock.jumps == rig.session.clock.reboots == 0


@pytest.mark.parametrize("profile", PROFILES, ids=lambda p: p.name)
def test_seed_is_before_the_first_stream_of_each_connection_one_request_at_a_time(profile):
    rig = Rig(profile, time_seed=True)
    assert rig.run(200, lambda: rig.session.ready)
    rig.run(50)
    assert b"TM0" not in rig.asked
    rig.asked.clear()
    rig.session.stream(True)
    rig.run(50)
    assert rig.asked == [*SEEDING, MD] and rig.session.counts["stray"] == 0
    rig.session.stream(False)
    rig.run(50)
    rig.session.stream(True)
    rig.run(50)
    assert rig.asked.count(b"TM0") == 1 and rig.asked.count(MD) == 2
    rig.unplug()
    assert rig.run(300, lambda: rig.asked.count(b"TM0") == 2 and rig.session.streaming)


def test_the_time_that_the_seed_takes_is_no_silence():
    rig = Rig(profiles.UTM30LX, time_seed=True)
    rig.twin.slow_ns = 10_000_000
    assert rig.run(200, lambda: rig.session.ready)
    rig.session.stream(True)
    asked_tick, silent = rig.tick, []
    rig.run(60, lambda: silent.append(rig.session.silent(rig.now_ns)) or bool(rig.scans))
    assert rig.scans and (rig.tick - asked_tick) * TICK_NS > 1.5 * LidarConfig().silent_ns and not any(silent)


def test_stream_that_is_no_longer_wanted_ends_the_seed_in_standby():
    rig = Rig(profiles.UTM30LX, time_seed=True)
    rig.session.stream(True)
    assert rig.run(100, lambda: b"TM1" in rig.asked)
    rig.session.stream(False)
    rig.run(50)
    assert rig.asked[-1] == b"TM2" and rig.session.dark and rig.twin.machine.report == "000"


def streams(rig):
    rig.session.stream(True)
    assert rig.run(500, lambda: rig.session.streaming)
    assert rig.session.complaint == ""
    return rig.session


@pytest.mark.parametrize("status", ["0E", "10", "0L", "01"])
def test_sensor_that_refuses_time_adjustment_streams_without_a_seed(status):
    rig = Script({b"TM0": scip.reply(b"TM0", status), MD: scip.reply(MD, "00")}, time_seed=True)
    session = streams(rig)
    assert rig.asked[-2:] == [b"TM0", MD] and session.counts["refused"] == 1 and session.counts["timeouts"] == 0
    assert session.info["TM"] == f"{status}: {scip.meaning('TM', status)}"


def test_sensor_that_refuses_the_time_alone_is_led_out_of_time_adjustment():
    rig = Script(
        {
            b"TM0": scip.reply(b"TM0", "00"),
            b"TM1": scip.reply(b"TM1", "0A"),
            b"TM2": scip.reply(b"TM2", "00"),
            MD: scip.reply(MD, "00"),
        },
        time_seed=True,
    )
    session = streams(rig)
    assert rig.asked[-4:] == [b"TM0", b"TM1", b"TM2", MD] and session.info["TM"].startswith("0A: ")


@pytest.mark.parametrize("deaf_to", [b"TM0", b"TM1", b"TM2"])
def test_sensor_that_does_not_answer_is_met_anew_and_not_asked_again(deaf_to):
    stamp = scip.reply(b"TM1", "00", scip.stamp_line(1234))
    known = {b"TM0": scip.reply(b"TM0", "00"), b"TM1": stamp, b"TM2": scip.reply(b"TM2", "00")}
    rig = Script({**known, deaf_to: b"", MD: scip.reply(MD, "00")}, time_seed=True)
    session = streams(rig)
    assert session.info["TM"] == "no reply" and session.counts["timeouts"] == 1
    assert rig.asked.count(b"TM0") == 1


def test_sensor_that_still_boots_streams_without_a_seed_when_it_may():
    rig = Rig(dataclasses.replace(profiles.UTM30LX_EW, dark_ns=0, denied_ns=1_000_000_000), time_seed=True)
    rig.twin.reboot()
    rig.session.stream(True)
    assert rig.run(300, lambda: bool(rig.scans))
    assert rig.now_ns > 1_000_000_000 and rig.session.info["TM"] == "10: denied in this state"


def test_damaged_time_is_not_asked_again_and_what_was_taken_holds():
    stamp = scip.reply(b"TM1", "00", scip.stamp_line(1234))
    rig = Script(
        {
            b"TM0": scip.reply(b"TM0", "00"),
            b"TM1": [stamp, stamp, flipped(stamp, 9)],
            b"TM2": scip.reply(b"TM2", "00"),
            MD: scip.reply(MD, "00"),
        },
        time_seed=True,
    )
    session = streams(rig)
    assert rig.asked[-6:] == [b"TM0", b"TM1", b"TM1", b"TM1", b"TM2", MD]
    assert session.info["TM"] == "damaged after 2 exchanges" and session.bad == 1


# -- %ST --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("profile", "config", "told"), [
    (profiles.IDEAL, {}, None), (profiles.UTM30LX, {}, None), (profiles.UTM30LX_EW, {}, "000: standby"),
    (profiles.UTM30LX, {"probe_state": True}, "0E: unknown command"),
])  # fmt: skip
def test_state_code_is_asked_once_of_scip_2_2_or_on_request_and_what_came_of_it_is_kept(profile, config, told):
    rig = Rig(profile, **config)
    rig.session.stream(True)
    rig.run(200)
    assert rig.session.info.get("%ST") == told and rig.asked.count(b"%ST") == (told is not None)
    assert len(rig.scans) > 40 and rig.session.complaint == "" and rig.session.counts["timeouts"] == 0


@pytest.mark.parametrize(("state", "text"), [("103", "103: unstable, from single scans"),
                                             ("777", "777: a state that no manual lists")])  # fmt: skip
def test_damaged_state_code_is_asked_for_again(state, text):
    good = scip.reply(b"%ST", "00", scip.state_line(state))
    rig = Script({b"%ST": [flipped(good, 9), flipped(good, 8), good]}, probe_state=True)
    assert rig.run(40, lambda: rig.session.ready)
    assert rig.session.info["%ST"] == text and rig.session.counts["text_sum"] == 2
    assert rig.asked.count(b"%ST") == 3 and rig.asked[-2:] == [b"II", b"II"]


def test_sensor_that_does_not_answer_the_probe_is_known_without_it():
    rig = Script(probe_state=True)
    assert rig.run(100, lambda: rig.session.ready)
    assert rig.session.info["%ST"] == "no reply" and rig.asked.count(b"%ST") == 1
