"""Lines for people: what is known of the rover, and what of it is out of its limits."""

import json

import pytest

from ground.cli.operations.operate import Teller
from ground.cli.operations.show import item_line, news_json, news_line, status, way_words
from ground.link.news import Item, ProductHeard, Progress
from ground.link.session import Session
from protocol.link.bulk import Product
from protocol.link.datagrams import bench_keys
from protocol.tables.telemetry import TABLE


@pytest.mark.parametrize(("name", "value", "line"), [
    ("computer_temperature_c", 54.0, "computer_temperature_c   54 °C"),
    ("computer_temperature_c", 97.0, "computer_temperature_c   97 °C  out of limits"),
    ("free_disk_mb", 12.5, "free_disk_mb             12.5 MB  out of limits"),
    ("faults", 0.0, "faults                   none"),
    ("faults", 2.0**32 + 2.0**33, "faults                   OPERATOR COMPUTER_STRAINED  out of limits"),
    ("mode", 2.0, "mode                     AUTONOMOUS"),
    ("x_m", 1e4, "x_m                      10000 m"), ("cpu_ratio", None, "cpu_ratio                ?"),
])  # fmt: skip
def test_an_item_is_a_line_and_marked_where_it_is_out_of_its_limits(name, value, line):
    assert item_line(name, value) == line


def test_every_item_with_limits_can_be_marked():
    for row in TABLE:
        if row.limits is not None:
            assert item_line(row.name, row.limits[0] - 1.0).endswith("out of limits")


WAY = {
    "station": 1,
    "request_id": 3,
    "kind": "goal",
    "rule": "R4",
    "reason": "why",
    "length_m": 7.27,
    "time_s": 171.0,
    "looks": 3,
    "path": [[0.0, 0.0, 0.1], [0.0, 0.0, 0.4], [6.0, 1.5, 0.4]],
    "beyond": [],
}


def test_the_answer_to_a_goto_is_one_line_and_one_json_object():
    heard = ProductHeard(5_000_000_000, Product(9, "way", "json", json.dumps(WAY).encode()))
    assert news_line(heard) == "    5.00 s  way       7.3 m in about 171 s, 3 looks; by 0.0 0.0, 6.0 1.5"
    assert json.loads(news_json(heard)) == {"news": "way", "at_ns": 5_000_000_000, **WAY}


def test_the_answer_to_a_goto_without_a_way_is_the_reason():
    assert way_words(json.dumps({**WAY, "kind": "unreachable", "length_m": None}).encode()) == "none: why"


def test_a_round_trip_that_is_not_known_is_no_number():
    session = Session(bench_keys(7), 1)
    assert status(session, 0)["link"]["rtt_s"] is None and status(session, 0)["link"]["clock_error_s"] is None
    session.far_clock.hear(5_000_000_000, 0)
    link = status(session, 0)["link"]
    assert link["clock"] == "5.00 s, its error unknown" and link["clock_error_s"] is None
    session.far_clock.measure(20_000_000)
    link = status(session, 0)["link"]
    assert (link["rtt_s"], link["clock_error_s"]) == (0.02, 0.011) and link["clock"].endswith("at most 0.011 s off")


def test_as_json_an_item_is_told_when_its_value_has_changed():
    told = []
    teller = Teller(told.append, True, 1.0)
    for n, value in enumerate((1.0, 1.0, 2.0, float("nan"), float("nan"), 2.0)):
        teller.news([Item(n, n, "mode", value), Item(n, n, "phase", 0.0)])
    trees = [json.loads(line) for line in told]
    assert [(tree["at_ns"], tree["value"]) for tree in trees if tree["name"] == "mode"] == [
        (0, 1.0),
        (2, 2.0),
        (3, None),
        (5, 2.0),
    ]
    assert len(trees) == 5


def test_a_transfer_ends_with_all_of_its_chunks():
    told = []
    teller = Teller(told.append, False, 1.0)
    for again in range(2):
        teller.news([Progress(0, "ldem", 7, 8)])
        teller.news([ProductHeard(1, Product(again, "ldem", "ldem-2", b"x"))])
    assert [line.split("ldem ")[1][:6] for line in told] == ["7 of 8", "8 of 8", "(ldem-"] * 2
