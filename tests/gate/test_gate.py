"""The gate is red for each broken promise and for a figure that got worse, and green for the same flights."""

import pytest

from hil.campaign.compare import compare
from hil.campaign.plan import load_plan
from hil.campaign.table import read_table
from tests.gate.__main__ import BASELINE, PLAN
from tests.gate.judge import KNOWN, PROMISES, broken, equal, known, worse
from tests.gate.plants import PLANTS

SOUND = {
    "case_number": 1,
    "seed": 1,
    "outcome": "arrived",
    "reachable": True,
    "contacts": 0,
    "in_obstacle": None,
    "max_position_error_m": 0.05,
    "states_sha256": "a",
    "wires_sha256": "b",
}


def rows(count=20, **changed):
    return [{**SOUND, "case_number": number, **changed} for number in range(1, count + 1)]


def test_sound_flights_that_are_the_baselines_are_green():
    assert list(broken(rows())) == [] == list(worse(compare(rows(), rows())))
    assert equal(rows(), rows()) == 20


def test_a_goal_out_of_reach_need_not_be_reached():
    assert list(broken(rows(outcome="stopped", reachable=False))) == []


@pytest.mark.parametrize(
    "changed",
    [
        {"outcome": "stopped"},
        {"outcome": "silent"},
        {"outcome": "aborted", "contacts": None},
        {"contacts": 1},
        {"in_obstacle": True},
    ],
)
def test_each_broken_promise_is_named_with_its_case(changed):
    (reason, *_) = broken([SOUND, {**SOUND, "case_number": 2, **changed}])
    assert any(promise in reason for promise in PROMISES)
    assert "case 2" in reason


def test_a_figure_that_is_worse_in_every_pair_is_red_although_no_promise_is_broken():
    (reason,) = worse(compare(rows(), rows(max_position_error_m=0.09)))
    assert "worse" in reason
    assert list(broken(rows(max_position_error_m=0.09))) == []


def test_a_baseline_of_another_plan_is_red():
    (reason,) = worse(compare(rows(20), rows(21)))
    assert "baseline" in reason


def test_a_flight_whose_bytes_differ_is_not_equal():
    assert equal(rows(), rows(states_sha256="c")) == 0


def test_the_plan_is_sound_and_every_plant_says_what_is_wrong():
    plan = load_plan(PLAN)
    assert plan.faults == 1
    assert plan.knobs["set.drive_guard.on"].extremes == (True,)
    assert all(plant.__doc__ for plant in PLANTS.values())


def test_the_committed_baseline_breaks_no_promise_but_those_that_are_known():
    table = read_table(BASELINE)
    assert len(table) == load_plan(PLAN).cases
    assert list(broken(table)) == []
    told = list(known(table))
    assert len(told) == sum(map(len, KNOWN.values()))
    assert all(line.startswith("known") for line in told)


def test_a_known_case_is_told_apart_from_a_new_one_and_from_a_cured_one():
    promise, number = next((promise, number) for promise, cases in KNOWN.items() for number in cases)
    assert promise == "no wheel and no body touches a rock"
    assert list(broken([{**SOUND, "case_number": number, "contacts": 1}])) == []
    (cured,) = known([{**SOUND, "case_number": number}])
    assert "cured" in cured
    assert any(broken([{**SOUND, "case_number": number, "contacts": 1, "outcome": "silent"}]))
