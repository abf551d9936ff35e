"""Steps of a sequence as lines."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol.tables import sequences
from protocol.tables.sequences import Condition, parse


def test_a_line_has_its_wait_its_condition_its_policy_and_its_command():
    step = parse("after 5 until voltage_v > 24 within 600 or safe goto 3 1 90")
    assert step[1:5] == (5.0, Condition("voltage_v", ">", 24.0, 600.0), "safe", "goto")
    assert step.arguments == {"x_m": 3.0, "y_m": 1.0, "heading_rad": pytest.approx(math.pi / 2)}


def test_what_is_left_out_is_no_wait_no_condition_and_stop():
    assert parse("scan") == ("scan", 0.0, None, "stop", "scan", {})
    assert parse("after 10").name == ""


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("", "an empty step"),
        ("or continue", "an empty step"),
        ("after soon scan", "`after soon` should be 0 to 86400 seconds"),
        ("until voltage > 24 within 5 scan", "unknown item `voltage`; did you mean `voltage_v`?"),
        ("until voltage_v > 24 scan", "should be `until ITEM < or <= or = or >= or > VALUE within SECONDS`"),
        ("until voltage_v ! 24 within 5 scan", "should be `until ITEM"),
        ("or retry scan", "unknown policy `retry`; known: stop, continue, safe"),
        ("gogo 1 2", "did you mean `goto`"),
        ("goto 1", "`y_m` is missing"),
        ("stop", "stop is not for a sequence"),
        ("reboot", "reboot is not for a sequence"),
        ("sequence run other", "sequence run is not for a sequence"),
        ("resume", "resume is refused in STANDBY: it needs SAFE"),
    ],
)
def test_a_bad_step_says_what_is_allowed(line, words):
    with pytest.raises(ValueError) as caught:
        parse(line)
    assert words in str(caught.value)


WORDS = ["after", "until", "or", "within", "5", "-1", "nan", ">", "=", "voltage_v", "stop", "continue", "goto", "scan"]


@given(st.lists(st.sampled_from(WORDS)))
@settings(max_examples=300, deadline=None, derandomize=True)
def test_any_words_are_a_step_or_a_refusal_and_nothing_else(words):
    try:
        step = parse(" ".join(words))
    except ValueError:
        return
    assert step.policy in sequences.POLICIES and 0.0 <= step.after_s <= sequences.LONGEST_S


def test_an_item_that_is_not_known_meets_no_condition():
    assert not any(Condition("x_m", compare, 0.0, 1.0).holds(math.nan) for compare in sequences.OPERATORS)
