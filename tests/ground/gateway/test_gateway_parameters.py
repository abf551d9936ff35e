"""Parameters through the gateway: listed, read, set; what the rover keeps is what is shown."""

import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ground.gateway.desks.parameters import Mirror, ids_of, read_listing, word
from ground.gateway.frames import mavlink as m
from ground.gateway.frames import text_of
from onboard.config import Config
from onboard.parameters import TABLE, ParameterSet, listing
from tests.ground.gateway_bed import Bed, Client

CRUISE, CRUISE_ID = "motion.cruise_mps", "MOT_CRUISE_MPS"


@pytest.fixture
def met():
    bed = Bed()
    client = Client(bed)
    bed.step(1.0)
    return bed, client


def ask_all(client: Client) -> None:
    client.say(m.MAVLink_param_request_list_message(1, 1))


def put(client: Client, name: str, value: float) -> None:
    client.say(m.MAVLink_param_set_message(1, 1, name.encode(), value, m.MAV_PARAM_TYPE_REAL32))


def values(client: Client) -> dict[str, float]:
    return {text_of(one, "param_id"): one.param_value for one in client.heard("PARAM_VALUE")}


def errors(client: Client) -> list[int]:
    return [one.error for one in client.heard("PARAM_ERROR")]


def full(client: Client) -> bool:
    found = client.heard("PARAM_VALUE")
    return bool(found) and len(found) == found[0].param_count


def test_every_parameter_has_an_id_of_its_own_that_fits():
    ids = ids_of(TABLE)
    assert list(ids.values()) == list(TABLE)
    assert all(re.fullmatch("[A-Z0-9_]{1,16}", short) for short in ids)
    assert ids[CRUISE_ID] == CRUISE


@given(st.lists(st.text("abio_", min_size=1, max_size=30).map(lambda key: f"section.{key}"), unique=True, max_size=40))
def test_ids_stay_apart_whatever_the_names(names):
    ids = ids_of(names)
    assert sorted(ids.values()) == sorted(names)
    assert all(len(short) <= 16 for short in ids)


def test_the_list_shows_every_number_of_the_configuration_once(met):
    bed, client = met
    ask_all(client)
    bed.until(lambda: full(client))
    known = read_listing(listing(ParameterSet(Config())))
    assert [one.param_index for one in client.heard("PARAM_VALUE")] == list(range(len(known)))
    assert values(client)[CRUISE_ID] == pytest.approx(Config().motion.cruise_mps, rel=1e-6)
    assert bed.rover.executed == ["param_list"]
    ask_all(client)
    bed.step(1.0)
    assert bed.rover.executed == ["param_list"]  # the mirror answers
    assert len(client.heard("PARAM_VALUE")) == 2 * len(known)


def test_one_is_read_by_its_id_and_by_its_number(met):
    bed, client = met
    client.say(m.MAVLink_param_request_read_message(1, 1, CRUISE_ID.encode(), -1))
    client.say(m.MAVLink_param_request_read_message(1, 1, b"", 0))
    client.say(m.MAVLink_param_request_read_message(1, 1, b"no_such", -1))
    bed.until(lambda: errors(client))
    first = next(iter(ids_of(TABLE)))
    assert set(values(client)) == {CRUISE_ID, first}
    assert errors(client) == [m.MAV_PARAM_ERROR_DOES_NOT_EXIST]


def test_a_set_is_told_to_all_when_the_rover_has_taken_it(met):
    bed, client = met
    other = Client(bed, ("127.0.0.1", 40_009), system=254)
    put(client, CRUISE_ID, 0.09)
    bed.until(lambda: values(client))
    assert bed.rover.orders[-1] == ("param_set", {"parameter": CRUISE, "value": "0.09"})
    assert bed.rover.settings.config.motion.cruise_mps == 0.09
    assert values(client) == values(other) == {CRUISE_ID: pytest.approx(0.09, rel=1e-6)}


def test_what_the_rover_refuses_is_answered_with_the_value_it_kept(met):
    bed, client = met
    put(client, CRUISE_ID, 55.0)
    bed.until(lambda: values(client))
    assert values(client)[CRUISE_ID] == pytest.approx(Config().motion.cruise_mps, rel=1e-6)
    assert errors(client) == [m.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE]
    assert f"{CRUISE} not set" in client.texts()
    put(client, "LINK_RATE_BPS", 1e6)
    bed.until(lambda: len(errors(client)) == 2)
    assert errors(client)[-1] == m.MAV_PARAM_ERROR_READ_ONLY


def test_what_no_parameter_can_be_is_refused_here(met):
    bed, client = met
    put(client, CRUISE_ID, math.nan)
    put(client, "DRIVE_GUARD_ON", 0.5)
    put(client, "jobs_map_ticks", 1.5)
    bed.until(lambda: len(errors(client)) == 3)
    assert "param_set" not in bed.rover.executed


def test_sets_in_a_row_are_carried_out_in_their_order_though_reports_are_late():
    bed = Bed(delay_s=1.3)
    client = Client(bed)
    bed.step(4.0)
    for value in (0.06, 0.07, 0.08):
        put(client, CRUISE_ID, value)
        put(client, CRUISE_ID, value)  # the client's own repetition
    bed.until(lambda: len(client.heard("PARAM_VALUE")) == 3)
    assert [a["value"] for name, a in bed.rover.orders if name == "param_set"] == ["0.06", "0.07", "0.08"]
    assert [round(one.param_value, 3) for one in client.heard("PARAM_VALUE")] == [0.06, 0.07, 0.08]


def test_a_change_by_another_station_is_seen_in_the_next_list(met):
    bed, client = met
    ask_all(client)
    bed.until(lambda: full(client))
    bed.rover.settings = bed.rover.settings.set(CRUISE, "0.05", (bed.now_ns, 1, 2))
    bed.rover.event(bed.now_ns, "PARAMETER", str(bed.rover.settings.changes[-1]))
    bed.step(1.0)
    since = len(client.heard("PARAM_VALUE"))
    ask_all(client)
    bed.until(lambda: len(client.heard("PARAM_VALUE")) >= 2 * since)
    assert values(client)[CRUISE_ID] == pytest.approx(0.05, rel=1e-6)


def test_a_rover_that_cannot_list_is_told_of():
    bed = Bed()
    client = Client(bed)
    bed.step(1.0)
    bed.rover._executor.receive = lambda station, payload, now_ns, mode: None  # hears, never answers
    ask_all(client)
    bed.step(20.0)
    assert client.heard("PARAM_VALUE") == []


@given(st.floats(0.0625, 2.0, width=32))
def test_what_is_sent_is_the_shortest_decimal_of_the_float32(value):
    mirror = Mirror()
    mirror.fill(listing(ParameterSet(Config())))
    text = word(mirror.find(CRUISE_ID), float(value))
    assert np.float32(text) == np.float32(value)
    assert len(text) <= 12
