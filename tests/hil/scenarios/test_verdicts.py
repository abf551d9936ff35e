"""A promise is kept or broken by what the run shows, and each verdict says what was found."""

from dataclasses import replace

import pytest

from hil.scenarios.verdicts import Expect, Facts, FirstDifference, expect_of, judge
from hil.world.contacts import Contact
from onboard.config import ConfigError
from onboard.records import Event

ARRIVED = Event(9, "info", "ARRIVED", "0.05 m from the goal")
STUCK = Event(5, "warning", "FAULT", "WHEEL_STUCK: a wheel does not turn (wheel 2)")
WELL = Facts(to_goal_m=0.1, speed_mps=0.0, events=(ARRIVED,), contacts=())


def broken(expect, facts):
    return [verdict.promise for verdict in judge(expect, facts) if not verdict.holds]


def test_a_rover_that_stands_at_its_goal_and_says_so_keeps_the_plain_promise():
    assert broken(Expect(), WELL) == []


@pytest.mark.parametrize(
    ("change", "promise"),
    [
        ({"to_goal_m": 0.31}, "ends at the goal"),
        ({"speed_mps": 0.02}, "ends at the goal"),
        ({"events": ()}, "ends at the goal"),
        ({"contacts": (Contact(3.0, 4.0, 1, 0.1, 0.5, 0.0),)}, "touches 0 times at most"),
        ({"error": "onboard ended with 70"}, "no process dies unasked"),
        ({"events": (STUCK, ARRIVED)}, "raises nothing else"),
    ],
)
def test_each_part_of_the_promise_can_be_broken_alone(change, promise):
    assert broken(Expect(), replace(WELL, **change)) == [promise]


def test_a_row_that_must_be_raised_is_missed_and_one_that_may_be_is_not():
    assert broken(Expect(raises=("WHEEL_STUCK",)), WELL) == ["raises WHEEL_STUCK"]
    assert broken(Expect(raises=("WHEEL_STUCK",)), replace(WELL, events=(STUCK, ARRIVED))) == []
    assert broken(Expect(may_raise=("WHEEL_STUCK",)), replace(WELL, events=(STUCK, ARRIVED))) == []


def test_a_rover_that_stands_anywhere_has_stopped_and_one_that_rolls_has_not():
    assert broken(Expect(ends="stopped"), replace(WELL, to_goal_m=4.0, events=())) == []
    assert broken(Expect(ends="stopped"), replace(WELL, speed_mps=0.1)) == ["ends stopped"]


def test_the_end_must_be_told_in_the_words_asked_for():
    failed = replace(WELL, events=(Event(9, "error", "FAILED", "no way leads there"),))
    assert broken(Expect(ends="stopped", says="no way"), failed) == []
    assert broken(Expect(ends="stopped", says="no way"), WELL) == ["says 'no way'"]


@pytest.mark.parametrize(
    ("seen", "holds"),
    [
        (FirstDifference("x", 5.0, 5.4, "plant"), True),
        (FirstDifference("x", 5.0, 6.1, "plant"), False),
        (FirstDifference("x", 5.0, -1.0, ""), False),
        (FirstDifference("x", 5.0, 4.9, "plant"), False),
    ],
)
def test_an_injection_must_show_after_its_time_and_soon(seen, holds):
    assert (broken(Expect(seen_within_s=1.0), replace(WELL, seen=(seen,))) == []) is holds


@pytest.mark.parametrize(
    ("tree", "complaint"),
    [
        ({"raises": ["WHEEL_STUK"]}, "'WHEEL_STUK' is no row of the fault table; did you mean WHEEL_STUCK"),
        ({"raises": "WHEEL_STUCK"}, "should be a list"),
        ({"end": "goal"}, "unknown key `expect.end`; did you mean `expect.ends`"),
        ({"ends": "gaol"}, "should be one of goal, stopped, anyhow; did you mean 'goal'"),
        (3, "should be a table"),
    ],
)
def test_what_is_wrong_in_a_promise_is_named(tree, complaint):
    with pytest.raises(ConfigError, match=complaint):
        expect_of(tree, "s.toml")
