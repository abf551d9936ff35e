"""The campaign's table, and what counts as falling short of the promise."""

import math
from dataclasses import replace

import pytest

from tests.missions.__main__ import runs
from tests.missions.campaign import Row, summary
from tests.missions.promise import PROMISES, markdown, shortfalls

GOOD = Row("optimistic", 1, "main", True, 10.0, "arrived", "", 3, 4, 10.2, 1.02, 0.05, 0, 0, "R5 R5 R4")


def rows(**changes):
    return [replace(GOOD, seed=seed, **(changes if seed == 1 else {})) for seed in range(1, 6)]


def test_a_good_run_breaks_no_promise():
    assert shortfalls([summary("optimistic", rows())]) == []


@pytest.mark.parametrize(
    ("name", "changes", "text"),
    [
        ("optimistic", {"outcome": "unreachable"}, "reached 4 of 5 reachable goals"),
        ("optimistic", {"hard": 2}, "1 missions with a hard contact"),
        ("optimistic", {"ratio": 9.0}, "p90 of way / optimum"),
        ("optimistic", {"outcome": "endless", "reachable": False}, "1 endless"),
        ("explore, guarded", {"outcome": "endless"}, "1 endless"),
        ("pose error 5 cm + 1 deg", {"outcome": "unreachable"}, "reached 4 of 5"),
        ("U-traps", {"reachable": False}, "only 4 of 5 goals are reachable"),
        ("ringed goals", {}, "reported 0 of 5 goals unreachable"),
    ],
)
def test_each_promise_broken_is_named(name, changes, text):
    assert any(text in line for line in shortfalls([summary(name, rows(**changes))]))


def test_an_unguarded_run_may_be_endless():
    assert shortfalls([summary("visibility, unguarded", rows(outcome="endless"))]) == []


def test_sixty_fields_of_which_few_are_reachable_fall_short():
    many = [replace(GOOD, seed=seed, reachable=seed > 30) for seed in range(1, 61)]
    assert "optimistic: only 30 of 60 goals are reachable" in shortfalls([summary("optimistic", many)])


def test_every_promise_is_of_a_run_that_is_flown():
    assert set(PROMISES) <= {run.name for run in runs(fresh=1000)}


def test_a_row_comes_back_from_its_file():
    lost = replace(GOOD, outcome="unreachable", ratio=math.nan)
    assert Row.of_json(GOOD.as_json()) == GOOD
    assert math.isnan(Row.of_json(lost.as_json()).ratio)


def test_the_table_has_a_row_for_each_run():
    lines = markdown([summary("optimistic", rows()), summary("ringed goals", [])]).splitlines()
    assert lines[2] == "| optimistic | 5 | 5 / 5 | 0 | 0 | 0 | 3 / 3 / 3 | 1.02 / 1.02 / 1.02 | 0 | 0 |"
    assert lines[3] == "| ringed goals | 0 | 0 / 0 | 0 | 0 | 0 | - | - | 0 | 0 |"
