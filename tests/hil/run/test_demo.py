"""What the summary says of ticks and link."""

import numpy as np
import pytest

from hil.link.impairment import load_profile
from hil.run.demo import UNENDED, link_note, outcome, replans, tick_wall_ms


def test_every_tick_is_in_the_histogram_even_beyond_its_edges():
    row = tick_wall_ms([(0.01, 0.5), (0.5, 0.6), (0.5, 5000.0)])["histogram"]
    assert len(row["edges_ms"]) == 41
    assert (row["edges_ms"][0], row["edges_ms"][-1]) == (0.1, 1000.0)
    assert sum(row["plant_and_devices"]) == sum(row["until_onboard_answered"]) == 3
    assert (row["plant_and_devices"][0], row["until_onboard_answered"][-1]) == (1, 1)


def test_a_run_without_ticks_has_an_empty_histogram():
    assert sum(tick_wall_ms([])["histogram"]["plant_and_devices"]) == 0


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("ets8-b", "256 kbit/s both ways, 0.3 s one way, 5 % loss: geostationary, middle (assumption)"),
        (
            "moon",
            "64 kbit/s to the ground, 16 kbit/s to the rover, 1.28 s one way, 1 % loss: mean distance of the Moon",
        ),
        ("lan", "100000 kbit/s both ways, 0.001 s one way: a cable"),
    ],
)
def test_a_link_profile_is_told_in_numbers(name, text):
    assert link_note(load_profile(name)) == text


def test_a_global_path_counts_as_replanned_when_it_leaves_the_one_before_by_more_than_a_metre():
    first = np.array([[0.0, 0.0], [10.0, 0.0], [20.0, 0.0]])
    rest = np.array([[6.0, 0.9], [10.0, 0.0], [20.0, 0.0]])  # begins where the rover stands, near the path
    other = np.array([[12.0, -3.0], [20.0, 0.0]])
    assert replans([first, rest]) == 0
    assert replans([first, rest, other]) == 1
    assert replans([first]) == 0


GOTO = ("MODE", "STANDBY -> AUTONOMOUS: goal 5.00 0.50")


@pytest.mark.parametrize(("events", "told"), [
    ([GOTO], UNENDED),
    ([GOTO, ("ARRIVED", "0.01 m from the goal"), ("MODE", "AUTONOMOUS -> STANDBY: 0.01 m from the goal")],
     "arrived: 0.01 m from the goal"),
    ([GOTO, ("FAILED", "no way"), ("MODE", "AUTONOMOUS -> STANDBY: no way")], "failed: no way"),
    ([GOTO, ("FAULT", "NODE_FOREIGN: ..."), ("MODE", "AUTONOMOUS -> SAFE: NODE_FOREIGN")], "SAFE: NODE_FOREIGN"),
    ([GOTO, ("MODE", "AUTONOMOUS -> SAFE: NODE_FOREIGN"), ("MODE", "SAFE -> STANDBY: operator"), GOTO], UNENDED),
])  # fmt: skip
def test_a_mission_ends_at_its_goal_in_failure_or_in_another_mode(events, told):
    assert outcome(events) == told
