"""The mode numbers of the gateway: ours, PX4's, ArduPilot's, and every other."""

import math
from itertools import product

import pytest

from ground.gateway.desks.modes import custom_mode
from ground.gateway.desks.orders import GatewayAnswer, MavCommand, RoverState, order
from ground.gateway.frames import mavlink as m
from protocol.tables.modes import Mode
from tests.ground.gateway_bed import ORIGIN, Bed, Client

SET_MODE, CUSTOM = m.MAV_CMD_DO_SET_MODE, m.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
DENIED = m.MAV_RESULT_DENIED
MOVES = ("goto", "mission", "return", "turn", "scan", "drive", "sequence_run")
AUTO, LOITER, MISSION, RTL = 4, 3, 4, 5  # px4_custom_mode.h of PX4
OURS = 100  # our mode 4 is custom mode 104


def known(mode, enabled):
    return RoverState(ORIGIN, mode, 0.0, enabled, goals_m=((3.0, 0.0), (6.0, 1.0)))


def asked(*params):
    return MavCommand(SET_MODE, (*params, *[0.0] * (4 - len(params))))


def walk():
    """Every number and sub mode of other programs, in every mode of the rover, armed and not."""
    for mode, enabled in product((None, *Mode), (False, True)):
        state = known(mode, enabled)
        for number, sub in product(range(256), range(11)):
            yield mode, enabled, number, sub, order(asked(CUSTOM, number, sub), state)


def test_of_all_mode_numbers_only_auto_mission_and_auto_rtl_of_an_armed_rover_start_motion():
    moved = {
        (enabled, number, sub, made.name)
        for _, enabled, number, sub, made in walk()
        if not isinstance(made, GatewayAnswer) and made.name in MOVES
    }
    assert moved == {(True, AUTO, MISSION, "mission"), (True, AUTO, RTL, "return")}


def test_of_all_mode_numbers_only_our_own_is_an_emergency_stop():
    stops = {(number, sub) for *_, number, sub, made in walk() if getattr(made, "name", "") == "emergency_stop"}
    assert stops == {(OURS + Mode.ESTOP, 0)}


def test_every_number_that_is_not_in_the_list_is_denied_with_the_list():
    listed = {(OURS + mode, 0) for mode in (Mode.STANDBY, Mode.SAFE, Mode.ESTOP)}
    listed |= {(AUTO, sub) for sub in (LOITER, MISSION, RTL)}
    for mode, _, number, sub, made in walk():
        if (number, sub) not in listed:
            assert isinstance(made, GatewayAnswer) and made.result == DENIED, (mode, number, sub)
            assert {"101 STANDBY", "103 SAFE", "104 ESTOP", "4/3 AUTO.LOITER"} <= _items(made.text)


def _items(text):
    return {part.strip() for part in text.replace(":", ",").split(",")}


def test_our_numbers_stay_clear_of_those_of_ardupilot_and_px4():
    assert [custom_mode(mode) for mode in Mode] == [OURS + mode for mode in Mode]
    assert all(30 < custom_mode(mode) < 2**16 for mode in Mode)  # PX4's number has its parts above bit 16


@pytest.mark.parametrize("base", [b for b in range(256) if not b & CUSTOM])
def test_a_base_mode_without_a_custom_one_sets_nothing(base):
    for number, sub in ((AUTO, MISSION), (OURS + Mode.ESTOP, 0), (OURS + Mode.STANDBY, 0)):
        assert order(asked(base, number, sub), known(Mode.STANDBY, True)).result == DENIED


@pytest.mark.parametrize("params", [
    (math.nan, AUTO, MISSION), (CUSTOM, math.nan, MISSION), (CUSTOM, 4.5, MISSION), (CUSTOM, AUTO, 4.5),
    (math.inf, AUTO, MISSION), (CUSTOM, AUTO, math.inf), (CUSTOM, -AUTO, MISSION), (CUSTOM, AUTO + 256, MISSION),
    (CUSTOM, 104.5, 0), (CUSTOM, AUTO, math.nan), (CUSTOM, 1e30, 0), (-1, AUTO, MISSION),
])  # fmt: skip
def test_a_number_that_is_no_whole_mode_is_denied(params):
    made = order(asked(*params), known(Mode.STANDBY, True))
    assert isinstance(made, GatewayAnswer) and made.result == DENIED and "104 ESTOP" in made.text


def test_auto_mission_without_goals_asks_for_an_upload():
    made = order(asked(CUSTOM, AUTO, MISSION), RoverState(ORIGIN, Mode.STANDBY, 0.0, True))
    assert made.result == DENIED and "upload" in made.text


def test_auto_loiter_stops_and_releases_no_latch():
    for mode in (None, *Mode):
        made = order(asked(CUSTOM, AUTO, LOITER), known(mode, False))
        assert (made.name, made.urgent) == ("stop", True)


@pytest.mark.parametrize("params", [(CUSTOM, 4), (CUSTOM, AUTO, 0), (CUSTOM, 2), (CUSTOM, 5), (29, 4, 6), (217, 4)])
def test_hold_altctl_and_learning_of_other_programs_leave_the_rover_as_it_is(params):
    bed = Bed(drive_s=100.0)
    client = Client(bed)
    client.arm()
    client.command(SET_MODE, *params)
    bed.step(1.0)
    assert (client.finals(SET_MODE), bed.rover.executed, bed.rover.mode) == ([DENIED], [], Mode.STANDBY)
    assert "104 ESTOP" in client.texts()


def test_what_mavsdk_sends_for_hold_return_and_mission_does_that():
    bed = Bed(drive_s=100.0)
    client = Client(bed)
    client.arm()
    bed.gateway.missions.goals_m = ((3.0, 0.0),)
    steps = ((RTL, "return"), (LOITER, "stop"), (MISSION, "mission"), (LOITER, "stop"))
    for sub, name in steps:
        mode = Mode.STANDBY if name == "stop" else Mode.AUTONOMOUS
        client.command(SET_MODE, CUSTOM, AUTO, sub)
        bed.until(lambda name=name, mode=mode: bed.rover.executed[-1:] == [name] and bed.rover.mode is mode)


def test_the_packed_number_of_px4_in_the_older_message_is_the_same():
    bed = Bed(drive_s=100.0)
    client = Client(bed)
    client.arm()
    for sub in (RTL, LOITER):
        client.say(m.MAVLink_set_mode_message(1, CUSTOM, AUTO << 16 | sub << 24))
        bed.step(1.0)
    client.say(m.MAVLink_set_mode_message(1, CUSTOM, AUTO << 16))
    bed.step(1.0)
    assert bed.rover.executed == ["return", "stop"]
    assert client.finals(SET_MODE)[-1] == DENIED


def test_the_mode_that_the_heartbeat_tells_can_be_set():
    bed = Bed()
    client = Client(bed)
    for mode in (Mode.SAFE, Mode.ESTOP, Mode.STANDBY):
        client.command(SET_MODE, CUSTOM, OURS + mode)
        bed.until(lambda mode=mode: bed.rover.mode is mode)
        bed.step(2.0)
        assert client.heard("HEARTBEAT")[-1].custom_mode == OURS + mode
