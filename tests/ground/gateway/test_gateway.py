"""The gateway shows the rover to ground programs and turns their commands into the rover's."""

import math
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ground.gateway.desks.modes import custom_mode
from ground.gateway.desks.orders import CANCELLED
from ground.gateway.frames import mavlink as m
from ground.gateway.origin import Origin, e7
from ground.link.news import Item
from protocol.link.datagrams import DatagramKind, bench_keys
from protocol.tables.commands import TABLE
from protocol.tables.modes import Mode
from protocol.tables.telemetry import TABLE as ITEMS
from tests.ground.gateway_bed import ORIGIN, Bed, Client, GatewayRover, S

ARM, GOTO, PAUSE = m.MAV_CMD_COMPONENT_ARM_DISARM, m.MAV_CMD_DO_REPOSITION, m.MAV_CMD_DO_PAUSE_CONTINUE
ACCEPTED, REJECTED, DENIED = m.MAV_RESULT_ACCEPTED, m.MAV_RESULT_TEMPORARILY_REJECTED, m.MAV_RESULT_DENIED
PROGRESS, UNSUPPORTED = m.MAV_RESULT_IN_PROGRESS, m.MAV_RESULT_UNSUPPORTED


@pytest.fixture
def met():
    """A bed whose client has seen the rover and armed it."""
    bed = Bed()
    client = Client(bed)
    client.arm()
    return bed, client


def goto(client: Client, x_m: float, y_m: float, yaw_rad: float = math.nan, confirmation: int = 0) -> None:
    lat, lon, height_m = ORIGIN.globe(x_m, y_m, 0.0)
    client.say(
        m.MAVLink_command_int_message(
            1, 1, m.MAV_FRAME_GLOBAL_INT, GOTO, 0, 0, -1.0, 0.0, 0.0, yaw_rad, e7(lat), e7(lon), height_m
        )
    )


# -- what is shown ---------------------------------------------------------------------------------------------


def test_the_rover_is_shown_as_a_ground_rover_where_it_is():
    bed = Bed()
    client = Client(bed)
    bed.step(3.0)
    beat = client.heard("HEARTBEAT")[-1]
    assert (beat.type, beat.custom_mode, beat.system_status) == (
        m.MAV_TYPE_GROUND_ROVER,
        custom_mode(Mode.STANDBY),
        m.MAV_STATE_STANDBY,
    )
    local, attitude = client.heard("LOCAL_POSITION_NED")[-1], client.heard("ATTITUDE")[-1]
    assert (local.x, local.y, local.z) == pytest.approx((3.0, 12.0, -0.5))  # north, east, down
    assert math.degrees(attitude.yaw) == pytest.approx(60.0)  # 30 degrees from east is 60 from north
    position = client.heard("GLOBAL_POSITION_INT")[-1]
    assert position.hdg == 6000
    assert position.relative_alt == 500
    east_m = math.radians((position.lon - e7(ORIGIN.longitude_deg)) / 1e7) * 6_378_137 * math.cos(math.radians(38.25))
    north_m = math.radians((position.lat - e7(ORIGIN.latitude_deg)) / 1e7) * 6_371_000
    assert (east_m, north_m) == (pytest.approx(12.0, rel=0.01), pytest.approx(3.0, rel=0.01))
    assert client.heard("SYS_STATUS")[-1].battery_remaining == 80


@settings(max_examples=60, deadline=None)
@given(st.floats(-80, 80), st.floats(-180, 180), st.floats(-1000, 1000), st.floats(-1000, 1000))
def test_a_place_goes_to_the_globe_and_back_within_a_decimetre(lat, lon, x_m, y_m):
    origin = Origin(lat, lon, 0.0)
    there = origin.globe(x_m, y_m, 0.0)
    back = origin.map(round(there[0] * 1e7) / 1e7, round(there[1] * 1e7) / 1e7)
    assert np.hypot(back[0] - x_m, back[1] - y_m) < 0.1 + 1e-6 * (x_m**2 + y_m**2)


def test_an_origin_that_is_no_place_is_refused():
    for lat, lon in ((90.0, 0.0), (math.nan, 0.0), (0.0, 181.0)):
        with pytest.raises(ValueError, match="should be a latitude"):
            Origin(lat, lon)


def test_events_become_status_texts_in_pieces_under_one_number():
    bed = Bed()
    client = Client(bed)
    bed.step(1.0)
    bed.rover.event(bed.now_ns, "FAULT", "WHEEL_STUCK: command, rate and current of wheel 2 disagree")
    bed.step(1.0)
    pieces = client.heard("STATUSTEXT")
    assert [(one.chunk_seq, len(one.text) == 50) for one in pieces] == [(0, True), (1, False)]
    assert pieces[0].id == pieces[1].id != 0
    assert "".join(one.text for one in pieces) == "FAULT: WHEEL_STUCK: command, rate and current of wheel 2 disagree"


def test_a_silent_rover_has_no_heartbeat_and_it_is_told():
    bed = Bed()
    client = Client(bed)
    bed.step(2.0)
    bed.silent = True
    bed.step(14.0)
    Client(bed)  # its heartbeat: it would be forgotten after 30 s
    bed.step(4.0)
    before = len(client.heard("HEARTBEAT"))
    bed.step(5.0)
    assert len(client.heard("HEARTBEAT")) == before
    assert "no word from the rover for 15 s" in client.texts()
    bed.silent = False
    bed.step(2.0)
    assert len(client.heard("HEARTBEAT")) > before


def test_a_client_is_forgotten_when_it_is_silent_for_30_s():
    bed = Bed()
    Client(bed)
    bed.step(29.0)
    assert len(bed.gateway.clients.known) == 1
    bed.step(2.0)
    assert bed.gateway.clients.known == ()


def test_a_message_is_sent_on_request_and_an_unknown_one_is_unsupported(met):
    bed, client = met
    client.command(m.MAV_CMD_REQUEST_MESSAGE, m.MAVLINK_MSG_ID_HOME_POSITION)
    client.command(m.MAV_CMD_REQUEST_MESSAGE, m.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
    bed.step(0.1)
    assert client.heard("HOME_POSITION")[0].latitude == e7(ORIGIN.latitude_deg)
    assert client.heard("AUTOPILOT_VERSION")[0].capabilities & m.MAV_PROTOCOL_CAPABILITY_MISSION_INT
    since = len(bed.said)
    client.command(m.MAV_CMD_REQUEST_MESSAGE, m.MAVLINK_MSG_ID_RAW_IMU)
    assert client.acks(m.MAV_CMD_REQUEST_MESSAGE, since) == [UNSUPPORTED]


# -- commands ---------------------------------------------------------------------------------------------------


def test_each_request_has_the_client_that_asked_it(met):
    bed, client = met
    other = Client(bed, ("127.0.0.1", 40_002), system=254)
    goto(client, 20.0, -5.0)
    bed.step(0.5)
    other.command(ARM, 0)
    other.say(m.MAVLink_param_request_list_message(1, 1))
    bed.step(3.0)
    other.say(m.MAVLink_param_set_message(1, 1, b"MOT_CRUISE_MPS", 0.09, m.MAV_PARAM_TYPE_REAL32))
    bed.step(0.5)
    asked = {r.telecommand.name: r.asked_by for r in bed.session.requester.requests.values()}
    assert asked["goto"] == "gateway 127.0.0.1:40001 system 255, unsigned"
    second = "gateway 127.0.0.1:40002 system 254, unsigned"
    assert asked["stop"] == asked["param_list"] == asked["param_set"] == second


def test_a_goto_is_in_progress_at_once_and_accepted_when_it_has_begun(met):
    bed, client = met
    goto(client, 20.0, -5.0, yaw_rad=0.0)
    assert client.acks(GOTO) == [PROGRESS]  # the rover has not been asked yet
    bed.step(0.5)
    assert client.acks(GOTO) == [PROGRESS, ACCEPTED]
    name, arguments = bed.rover.orders[-1]
    assert name == "goto"
    assert (arguments["x_m"], arguments["y_m"]) == pytest.approx((20.0, -5.0), abs=0.02)
    assert arguments["heading_rad"] == pytest.approx(math.pi / 2)  # north
    bed.step(5.0)
    assert "goto completed: there" in client.texts()


def test_without_arming_nothing_moves_and_stop_still_works():
    bed = Bed()
    client = Client(bed)
    bed.step(1.0)
    goto(client, 1.0, 1.0)
    client.command(m.MAV_CMD_NAV_RETURN_TO_LAUNCH)
    client.command(m.MAV_CMD_USER_2)
    bed.step(1.0)
    for command in (GOTO, m.MAV_CMD_NAV_RETURN_TO_LAUNCH, m.MAV_CMD_USER_2):
        assert client.acks(command) == [REJECTED]
    assert bed.rover.executed == []
    client.command(ARM, 0)
    bed.step(1.0)
    assert bed.rover.executed == ["stop"]


def test_disarm_stops_and_force_disarm_is_the_emergency_stop(met):
    bed, client = met
    goto(client, 9.0, 9.0)
    bed.step(0.5)
    client.command(ARM, 0)
    bed.step(1.1)
    assert bed.rover.executed == ["goto", "stop"]
    assert client.acks(ARM)[-1] == ACCEPTED
    assert not client.heard("HEARTBEAT")[-1].base_mode & m.MAV_MODE_FLAG_SAFETY_ARMED
    client.command(ARM, 0, 21196)
    bed.step(1.1)
    assert bed.rover.mode is Mode.ESTOP
    assert client.heard("HEARTBEAT")[-1].system_status == m.MAV_STATE_EMERGENCY
    client.command(ARM, 1)
    assert client.acks(ARM)[-1] == REJECTED


def test_arming_takes_the_rover_out_of_safe(met):
    bed, client = met
    client.command(m.MAV_CMD_DO_SET_MODE, m.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED, custom_mode(Mode.SAFE))
    bed.step(1.1)
    assert client.heard("HEARTBEAT")[-1].system_status == m.MAV_STATE_CRITICAL
    assert not client.heard("HEARTBEAT")[-1].base_mode & m.MAV_MODE_FLAG_SAFETY_ARMED
    client.command(ARM, 1)
    bed.step(1.6)
    assert bed.rover.executed == ["safe", "resume"]
    assert client.heard("HEARTBEAT")[-1].base_mode & m.MAV_MODE_FLAG_SAFETY_ARMED


def test_a_rover_that_somebody_else_made_safe_is_to_be_armed_anew(met):
    bed, client = met
    bed.rover.mode = Mode.SAFE
    bed.step(1.0)
    bed.rover.mode = Mode.STANDBY
    bed.step(1.0)
    goto(client, 1.0, 1.0)
    bed.step(1.0)
    assert client.finals(GOTO) == [REJECTED]
    assert "arm first" in client.texts()


def test_a_rover_that_came_up_anew_is_to_be_armed_again_and_gets_nothing_that_waited():
    bed = Bed()
    client = Client(bed)
    bed.step(30.0)
    client.arm()
    bed.silent = True
    goto(client, 1.0, 1.0)
    goto(client, 2.0, 2.0)
    bed.step(1.0)
    bed.rover, bed.silent = GatewayRover(bench_keys(7), boot_id=2), False
    bed.rover.tick = partial(late, bed.rover.tick, bed.now_ns)
    since = len(bed.said)
    bed.step(3.0)
    assert client.finals(GOTO) == [m.MAV_RESULT_FAILED, CANCELLED] and bed.rover.executed == []
    assert not client.heard("HEARTBEAT", since)[-1].base_mode & m.MAV_MODE_FLAG_SAFETY_ARMED
    assert all(one.time_boot_ms <= 3000 for one in client.heard("LOCAL_POSITION_NED", since))
    goto(client, 3.0, 3.0)
    bed.step(1.0)
    assert "arm first" in client.texts() and bed.rover.executed == []


def late(tick, zero_ns, now_ns):
    """A rover whose clock began later."""
    return tick(now_ns - zero_ns)


@pytest.mark.parametrize(
    ("command", "params", "name"),
    [
        (PAUSE, (0,), "stop"),
        (m.MAV_CMD_OVERRIDE_GOTO, (m.MAV_GOTO_DO_HOLD,), "stop"),
        (m.MAV_CMD_NAV_RETURN_TO_LAUNCH, (), "return"),
        (m.MAV_CMD_DO_FLIGHTTERMINATION, (1,), "emergency_stop"),
        (m.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, (1,), "reboot"),
        (m.MAV_CMD_PREFLIGHT_STORAGE, (1,), "param_save"),
        (m.MAV_CMD_USER_1, (), "safe"),
        (m.MAV_CMD_USER_2, (), "scan"),
        (m.MAV_CMD_CONDITION_YAW, (90,), "turn"),
        (m.MAV_CMD_DO_SET_MODE, (1, custom_mode(Mode.STANDBY)), "stop"),
        (m.MAV_CMD_DO_SET_MODE, (1, custom_mode(Mode.ESTOP)), "emergency_stop"),
    ],
)
def test_a_mapped_command_becomes_ours(met, command, params, name):
    bed, client = met
    client.command(command, *params)
    bed.step(1.0)
    assert bed.rover.executed == [name]
    assert client.finals(command) == [ACCEPTED]


@pytest.mark.parametrize(
    ("command", "params", "result"),
    [
        (PAUSE, (1,), DENIED),
        (m.MAV_CMD_MISSION_START, (), DENIED),
        (ARM, (0.5,), DENIED),
        (m.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, (2,), DENIED),
        (m.MAV_CMD_DO_SET_MODE, (1, 99), DENIED),
        (m.MAV_CMD_DO_SET_MODE, (1, custom_mode(Mode.TELEOP)), DENIED),
        (GOTO, (0, 0, 0, 0, math.nan, 0), DENIED),
        (GOTO, (0, 0, 0, 0, 95.0, 0), DENIED),
        (GOTO, (0, 0, 0, math.nan, 0.0, 0.0), DENIED),
        (m.MAV_CMD_NAV_TAKEOFF, (), UNSUPPORTED),
        (m.MAV_CMD_SET_MESSAGE_INTERVAL, (30, 1e5), UNSUPPORTED),
        (m.MAV_CMD_REQUEST_MESSAGE, (math.nan,), UNSUPPORTED),
        (m.MAV_CMD_DO_SET_MODE, (math.inf, 1), DENIED),
    ],
)
def test_what_is_not_mapped_or_makes_no_sense_reaches_no_rover(met, command, params, result):
    bed, client = met
    since = len(bed.said)
    client.command(command, *params)
    bed.step(1.0)
    assert bed.rover.executed == []
    assert client.finals(command, since) == [result]


def test_the_older_message_for_the_mode_does_the_same(met):
    bed, client = met
    client.say(m.MAVLink_set_mode_message(1, m.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED, custom_mode(Mode.SAFE)))
    bed.step(1.0)
    assert bed.rover.mode is Mode.SAFE
    assert client.finals(m.MAV_CMD_DO_SET_MODE) == [ACCEPTED]


def test_a_rover_that_another_station_drives_is_armed_and_obeys_until_it_is_being_stopped():
    bed = Bed(delay_s=1.0, drive_s=100.0)
    client = Client(bed)
    bed.rover.mode = Mode.AUTONOMOUS
    bed.step(3.0)
    assert client.heard("HEARTBEAT")[-1].base_mode & m.MAV_MODE_FLAG_SAFETY_ARMED
    client.command(ARM, 0)
    goto(client, 4.0, 4.0)
    assert client.finals(GOTO) == [REJECTED]  # the stop is on its way
    bed.step(5.0)
    assert bed.rover.executed == ["stop"]


def test_a_turn_relative_to_the_heading_counts_clockwise(met):
    bed, client = met
    client.command(m.MAV_CMD_CONDITION_YAW, 40, 0, 1, 1)
    bed.step(1.0)
    assert math.degrees(bed.rover.orders[-1][1]["heading_rad"]) == pytest.approx(30 - 40)


def test_what_the_rover_refuses_is_refused_with_its_reason(met):
    bed, client = met
    bed.rover.mode = Mode.TELEOP
    client.command(m.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1)
    bed.step(1.0)
    assert client.finals(m.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN) == [REJECTED]
    assert "reboot is refused in TELEOP: it needs STANDBY, SAFE" in client.texts()


def test_a_command_for_another_system_is_not_obeyed(met):
    bed, client = met
    client.say(m.MAVLink_command_long_message(7, 1, m.MAV_CMD_USER_1, 0, *[0.0] * 7))
    client.say(m.MAVLink_command_long_message(1, 100, m.MAV_CMD_USER_1, 0, *[0.0] * 7))
    bed.step(1.0)
    assert bed.rover.executed == []
    assert client.acks(m.MAV_CMD_USER_1) == []


# -- confirmed by their own reports alone -----------------------------------------------------------------------


def test_a_second_goto_waits_until_the_first_has_its_word_and_each_is_confirmed_by_its_own():
    bed = Bed(delay_s=1.3, drive_s=30.0)
    client = Client(bed)
    client.arm()
    goto(client, 5.0, 0.0)
    goto(client, 6.0, 0.0)
    bed.step(2.0)
    assert [round(a["x_m"]) for _, a in bed.rover.orders] == [5]
    bed.until(lambda: client.finals(GOTO))
    assert [round(a["x_m"]) for _, a in bed.rover.orders] == [5]  # the first is confirmed; the second leaves now
    bed.until(lambda: len([a for a in client.heard("COMMAND_ACK") if a.command == GOTO and a.result == ACCEPTED]) == 2)
    assert [round(a["x_m"]) for _, a in bed.rover.orders] == [5, 6]


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(0, 40))
def test_an_acknowledgement_never_comes_before_the_rover_has_begun_that_goto(seed, loss_percent):
    rng = np.random.default_rng(seed)
    bed = Bed(delay_s=1.3, drive_s=100.0, loses=lambda *_: rng.random() * 100 < loss_percent)
    client = Client(bed)
    client.arm()
    for x_m in (1.0, 2.0, 3.0):
        goto(client, x_m, 0.0)
    for _ in range(1500):
        bed.step(0.05)
        confirmed = sum(a.command == GOTO and a.result == ACCEPTED for a in client.heard("COMMAND_ACK"))
        executed = [round(a["x_m"]) for name, a in bed.rover.orders if name == "goto"]
        assert executed == [1, 2, 3][: len(executed)]
        assert confirmed <= len(executed)
        if confirmed == 3:
            break
        Client(bed)  # the heartbeat that keeps it known
    assert confirmed == 3


def test_a_repetition_of_a_waiting_command_is_the_same_command(met):
    bed, client = met
    goto(client, 5.0, 0.0)
    goto(client, 5.0, 0.0)
    bed.step(1.0)
    assert bed.rover.executed == ["goto"]


def test_a_late_repetition_with_confirmation_repeats_the_acknowledgement_alone(met):
    bed, client = met
    client.command(m.MAV_CMD_USER_2)
    bed.step(1.0)
    client.command(m.MAV_CMD_USER_2, confirmation=1)
    bed.step(1.0)
    assert bed.rover.executed == ["scan"]
    said = [a.result for a in client.heard("COMMAND_ACK") if a.command == m.MAV_CMD_USER_2]
    assert said == [PROGRESS, ACCEPTED, ACCEPTED]


def test_a_stop_waits_for_nothing_and_nothing_asked_before_is_executed_after_it():
    bed = Bed(
        loses=lambda way, kind, n: way == "up" and kind is DatagramKind.TELECOMMAND and n < 3
    )  # the goto's first copies
    client = Client(bed)
    client.arm()
    goto(client, 5.0, 0.0)
    goto(client, 6.0, 0.0)
    bed.step(0.6)
    other = Client(bed, ("127.0.0.1", 40_002), system=254)
    other.command(PAUSE, 0)
    bed.step(30.0)
    assert bed.rover.executed == ["stop"]
    assert other.finals(PAUSE) == [ACCEPTED]
    assert client.finals(GOTO) == [CANCELLED]
    assert sum(a.command == GOTO and a.result == CANCELLED for a in client.heard("COMMAND_ACK")) == 2


def test_a_disarm_overtakes_an_arm_that_still_waits():
    bed = Bed(delay_s=2.0)
    client = Client(bed)
    bed.rover.mode = Mode.SAFE
    bed.until(lambda: client.heard("HEARTBEAT"))
    client.command(ARM, 1)
    bed.step(0.1)
    client.command(ARM, 0)
    assert client.acks(ARM) == [PROGRESS, CANCELLED, PROGRESS]
    bed.step(10.0)
    assert client.acks(ARM) == [PROGRESS, CANCELLED, PROGRESS, ACCEPTED]
    assert bed.rover.executed[-1] == "stop"
    assert not client.heard("HEARTBEAT")[-1].base_mode & m.MAV_MODE_FLAG_SAFETY_ARMED


def test_in_progress_is_told_each_second_until_the_end_of_a_blackout(met):
    bed, client = met
    bed.silent = True
    client.command(PAUSE, 0)
    bed.step(10.0)
    said = [a.result for a in client.heard("COMMAND_ACK") if a.command == PAUSE]
    assert said == [PROGRESS] * len(said)
    assert 10 <= len(said) <= 12
    bed.silent = False
    bed.step(2.0)
    assert client.finals(PAUSE) == [ACCEPTED]


NAMES = Bed().gateway._handlers.keys()
HANDLED = tuple(number for number, kind in m.mavlink_map.items() if kind.msgname in NAMES)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(HANDLED), st.binary(min_size=60, max_size=60)), min_size=1, max_size=6))
def test_no_message_whatever_its_fields_ends_the_gateway(messages):
    """Random payloads with right checksums, meant for the rover; what they ask for stays within the table."""
    bed = Bed()
    client = Client(bed)
    client.arm()
    for number, raw in messages:
        kind = m.mavlink_map[number]
        fields = dict(zip(kind.ordered_fieldnames, kind.unpacker.unpack(raw[: kind.unpacker.size])))
        made = kind(*(fields[name] for name in kind.fieldnames))
        for name, value in (("target_system", 1), ("target_component", 1)):
            if hasattr(made, name):
                setattr(made, name, value)
        client.say(made)
        bed.step(0.1)
    bed.step(1.0)
    assert set(bed.rover.executed) <= {row.name for row in TABLE}
    assert client.heard("HEARTBEAT")


@settings(max_examples=60, deadline=None)
@given(st.dictionaries(st.sampled_from([row.name for row in ITEMS]), st.floats(width=32)))
def test_no_value_of_the_rover_ends_the_gateway(values):
    bed = Bed()
    client = Client(bed)
    bed.step(1.0)
    news = [Item(bed.now_ns, bed.now_ns, name, value) for name, value in values.items()]
    bed.session.items |= {item.name: item for item in news}
    bed.gateway.turn(news, bed.now_ns)
    bed._collect()
    bed.step(1.0)
    assert client.heard("HEARTBEAT")


def test_garbage_is_counted_and_does_nothing():
    bed = Bed()
    rng = np.random.default_rng(5)
    for _ in range(2000):
        bed.receive(rng.bytes(int(rng.integers(0, 300))))
        bed.receive(b"\xfd" + rng.bytes(int(rng.integers(0, 60))))
    assert bed.gateway.clients.counts["ok"] == 0
    assert bed.gateway.clients.known == ()
    assert bed.now_ns < S
