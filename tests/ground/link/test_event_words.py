"""Texts of the rover as they are shown: the flight code's own sentences are those that the rules know."""

import pytest

from ground.link.event_words import event_words
from onboard.config import Mission
from onboard.planning.mission_rule import MissionState, Nearest, Situation, Stop, decide


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        (
            "R4 goal: the goal is reached over free poses: 4.93 m to 0.00 m from it",
            "R4 goal: path found, 4.93 m over free poses; it ends 0.00 m from the goal",
        ),
        ("0.01 m from the goal, no nearer pose is free", "arrived, 1 cm off"),
        ("1.20 m from the goal, no nearer pose is free", "arrived, 1.20 m off"),
        (
            "0.00 of the points lie where the target is: 0.2 needed (0.000 m)",
            "scan and map overlap in 0 % of the points; 20 % are needed (0.000 m)",
        ),
        ("survey: 1 steps", "survey: 1 step"),
        ("survey: 11 steps", "survey: 11 steps"),
        ("R5 drive: 7.88 m to the last free pose", "R5 drive: 7.88 m to the last free pose"),
    ],
)
def test_sentences_that_were_read_twice_are_shown_in_common_words(text, shown):
    assert event_words(text) == shown


def test_the_rules_know_the_sentences_that_the_flight_code_writes():
    at_goal = Situation(Stop(0.0, 0.0, 0.0), (0.0, 0.01), Nearest(2.0, 0.0, 4.0, 17))
    arrived, _ = decide(MissionState(number=3), at_goal, Mission())
    assert (arrived.kind, event_words(arrived.reason)) == ("arrived", "arrived, 1 cm off")
