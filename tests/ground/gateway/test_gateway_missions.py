"""Missions through the gateway: uploaded as goals, read back, cleared, started; all of it or nothing."""

import math

import pytest

from ground.gateway.frames import mavlink as m
from ground.gateway.origin import e7
from protocol.tables.modes import Mode
from tests.ground.gateway_bed import ORIGIN, Bed, Client

START = m.MAV_CMD_MISSION_START
GOALS = ((4.0, 0.0), (8.0, 3.0), (0.0, 0.0))


@pytest.fixture
def met():
    bed = Bed()
    client = Client(bed)
    client.arm()
    return bed, client


def count(client: Client, number: int, kind: int = m.MAV_MISSION_TYPE_MISSION) -> None:
    client.say(m.MAVLink_mission_count_message(1, 1, number, kind))


def item(
    client: Client,
    seq: int,
    x_m: float,
    y_m: float,
    command: int = m.MAV_CMD_NAV_WAYPOINT,
    frame: int = m.MAV_FRAME_GLOBAL_INT,
) -> None:
    lat, lon, height_m = ORIGIN.globe(x_m, y_m, 0.0)
    client.say(
        m.MAVLink_mission_item_int_message(
            1, 1, seq, frame, command, 0, 1, 0, 0, 0, math.nan, e7(lat), e7(lon), height_m
        )
    )


def upload(client: Client, goals=GOALS) -> list[int]:
    """Answers each request with its item; the sequence numbers that were asked for."""
    before, asked = len(client.bed.said), []
    count(client, len(goals))
    while (requests := client.heard("MISSION_REQUEST_INT", before)) and requests[-1].seq not in asked:
        asked.append(requests[-1].seq)
        item(client, asked[-1], *goals[asked[-1]])
    return asked


def results(client: Client) -> list[int]:
    return [one.type for one in client.heard("MISSION_ACK")]


def test_an_upload_is_asked_for_item_by_item_and_becomes_our_mission_when_it_is_started(met):
    bed, client = met
    assert upload(client) == [0, 1, 2]
    assert results(client) == [m.MAV_MISSION_ACCEPTED]
    assert bed.rover.executed == []
    client.command(START, 0, 2)
    bed.step(1.0)
    name, arguments = bed.rover.orders[-1]
    assert name == "mission"
    assert arguments["goals_m"] == pytest.approx([v for goal in GOALS for v in goal], abs=0.02)
    assert client.finals(START) == [m.MAV_RESULT_ACCEPTED]
    bed.step(5.0)
    assert client.heard("MISSION_ITEM_REACHED")[-1].seq == 2
    assert "mission completed" in client.texts()


def test_what_was_uploaded_is_read_back_in_both_forms(met):
    _, client = met
    upload(client)
    client.say(m.MAVLink_mission_request_list_message(1, 1))
    assert client.heard("MISSION_COUNT")[-1].count == 3
    client.say(m.MAVLink_mission_request_int_message(1, 1, 1))
    client.say(m.MAVLink_mission_request_message(1, 1, 1))
    whole, single = client.heard("MISSION_ITEM_INT")[-1], client.heard("MISSION_ITEM")[-1]
    assert ORIGIN.map(whole.x / 1e7, whole.y / 1e7) == pytest.approx(GOALS[1], abs=0.02)
    assert ORIGIN.map(single.x, single.y) == pytest.approx(GOALS[1], abs=1.0)  # a float32 of degrees is that coarse
    client.say(m.MAVLink_mission_request_int_message(1, 1, 3))
    assert results(client)[-1] == m.MAV_MISSION_INVALID_SEQUENCE


def test_a_mission_begins_at_the_item_that_was_chosen(met):
    bed, client = met
    upload(client)
    client.say(m.MAVLink_mission_set_current_message(1, 1, 1))
    client.command(START)
    bed.step(1.0)
    assert bed.rover.orders[-1][1]["goals_m"] == pytest.approx([8, 3, 0, 0], abs=0.02)
    client.command(START, 2, 2)
    bed.step(1.0)
    assert bed.rover.orders[-1][1]["goals_m"] == pytest.approx([0, 0], abs=0.02)


def test_the_item_on_the_way_to_is_told_and_those_reached(met):
    bed, client = met
    upload(client)
    client.command(START)
    bed.step(1.0)
    bed.rover.goal_m = (8.0, 3.0)
    bed.step(1.0)
    assert client.heard("MISSION_CURRENT")[-1].seq == 1
    assert [one.seq for one in client.heard("MISSION_ITEM_REACHED")] == [0]


@pytest.mark.parametrize(
    ("bad", "result"),
    [
        ({"command": m.MAV_CMD_NAV_TAKEOFF}, m.MAV_MISSION_UNSUPPORTED),
        ({"frame": m.MAV_FRAME_BODY_FRD}, m.MAV_MISSION_UNSUPPORTED_FRAME),
        ({"x_m": 30_000.0}, m.MAV_MISSION_INVALID_PARAM5_X),
        ({"y_m": -30_000.0}, m.MAV_MISSION_INVALID_PARAM6_Y),
    ],
)
def test_an_item_that_is_no_goal_refuses_the_upload_and_the_old_mission_stays(met, bad, result):
    _, client = met
    upload(client)
    count(client, 2)
    item(client, 0, 1.0, 1.0)
    item(client, 1, **{"x_m": 2.0, "y_m": 2.0, **bad})
    assert results(client)[-1] == result
    client.say(m.MAVLink_mission_request_list_message(1, 1))
    assert client.heard("MISSION_COUNT")[-1].count == 3


def test_more_goals_than_a_mission_takes_are_refused_before_they_are_sent(met):
    bed, client = met
    count(client, 17)
    bed.step(0.1)
    assert results(client) == [m.MAV_MISSION_NO_SPACE]
    assert "a mission has at most 16 goals, found 17" in client.texts()


def test_an_item_that_does_not_come_is_asked_for_again_and_given_up(met):
    bed, client = met
    count(client, 2)
    bed.step(2.1)
    assert [one.seq for one in client.heard("MISSION_REQUEST_INT")] == [0] * 5
    item(client, 0, 1.0, 1.0)
    item(client, 0, 1.0, 1.0)  # twice
    bed.step(10.0)
    assert results(client) == [m.MAV_MISSION_OPERATION_CANCELLED]
    assert client.bed.gateway.missions.goals_m == ()


def test_another_client_s_upload_takes_over_and_the_first_is_told(met):
    bed, client = met
    other = Client(bed, ("127.0.0.1", 40_002), system=254)
    count(client, 2)
    upload(other, GOALS[:1])
    assert results(client) == [m.MAV_MISSION_OPERATION_CANCELLED]
    assert results(other) == [m.MAV_MISSION_ACCEPTED]
    item(client, 0, 1.0, 1.0)
    assert results(client)[-1] == m.MAV_MISSION_INVALID_SEQUENCE


def test_clearing_leaves_nothing_to_start(met):
    bed, client = met
    upload(client)
    client.say(m.MAVLink_mission_clear_all_message(1, 1))
    client.command(START)
    bed.step(1.0)
    assert client.finals(START) == [m.MAV_RESULT_DENIED]
    assert bed.rover.executed == []


def test_fences_and_rally_points_are_none_and_cannot_be_uploaded(met):
    _, client = met
    count(client, 4, m.MAV_MISSION_TYPE_FENCE)
    assert results(client) == [m.MAV_MISSION_UNSUPPORTED]
    client.say(m.MAVLink_mission_request_list_message(1, 1, m.MAV_MISSION_TYPE_FENCE))
    assert client.heard("MISSION_COUNT")[-1].count == 0


def test_a_home_in_front_is_no_goal_where_that_is_said():
    bed = Bed(home_first=True)
    client = Client(bed)
    client.arm()
    upload(client, ((500.0, 500.0), *GOALS))
    client.command(START)
    bed.step(1.0)
    assert bed.rover.orders[-1][1]["goals_m"] == pytest.approx([v for goal in GOALS for v in goal], abs=0.02)
    client.say(m.MAVLink_mission_request_list_message(1, 1))
    assert client.heard("MISSION_COUNT")[-1].count == 4
    assert client.heard("MISSION_CURRENT")[-1].seq == 1


def test_the_single_item_of_older_programs_is_a_goto(met):
    bed, client = met
    lat, lon, _ = ORIGIN.globe(7.0, 2.0, 0.0)
    client.say(
        m.MAVLink_mission_item_message(
            1, 1, 0, m.MAV_FRAME_GLOBAL_RELATIVE_ALT, m.MAV_CMD_NAV_WAYPOINT, 2, 1, 0, 0, 0, 0, lat, lon, 0.0
        )
    )
    assert results(client) == []
    bed.step(1.0)
    assert results(client) == [m.MAV_MISSION_ACCEPTED]
    name, arguments = bed.rover.orders[-1]
    assert (name, bed.rover.mode) == ("goto", Mode.AUTONOMOUS)
    assert (arguments["x_m"], arguments["y_m"]) == pytest.approx((7.0, 2.0), abs=1.0)
