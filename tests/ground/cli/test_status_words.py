"""The status in five lines: names, units, degrees, and no number for what is not known."""

import math

import pytest

from ground.cli.operations.show import measured
from ground.cli.operations.status_words import status_lines
from ground.cli.verbs.history import argument_words
from ground.cli.verbs.run_verb import _as_typed
from protocol.tables.modes import Mode, Phase
from protocol.tables.telemetry import TABLE

LINK = {"heard_s_ago": 0.42, "rtt_s": 0.5, "contact": "no windows", "versions": "alike"}
DEAF = {"heard_s_ago": None, "rtt_s": None, "contact": "no windows", "versions": "not known"}
ITEMS = dict.fromkeys(row.name for row in TABLE) | {
    "mode": float(Mode.AUTONOMOUS), "phase": float(Phase.DRIVING), "stop": 3.0, "faults": 0.0, "x_m": 3.0, "y_m": 4.5,
    "yaw_rad": math.pi / 2, "roll_rad": 0.1, "pitch_rad": -0.2, "sigma_position_m": 0.05, "goal_x_m": 8.0,
    "goal_y_m": 3.0, "goal_distance_m": 5.22, "voltage_v": 25.25, "charge_ratio": 0.87, "current_a": 3.5,
}  # fmt: skip


def test_five_lines_say_what_it_does_where_it_is_and_how_it_is():
    rover, place, goal, power, link = status_lines(ITEMS, LINK)
    assert "AUTONOMOUS" in rover and "driving" in rover and "stop 3" in rover and "faults none" in rover
    assert "x 3.00 m, y 4.50 m, heading 90°" in place and "roll 6°" in place and "pitch -11°" in place
    assert "5.22 m away" in goal and "25.2 V, 87 % left" in power and "heard 0.4 s ago" in link


def test_a_small_angle_has_no_sign():
    assert "-0" not in status_lines(ITEMS | {"roll_rad": -0.001, "yaw_rad": -0.001, "pitch_rad": -0.002}, LINK)[1]


def test_nothing_heard_is_five_lines_without_a_digit():
    lines = status_lines(dict.fromkeys(ITEMS), DEAF)
    assert len(lines) == 5 and not any(sign.isdigit() for line in lines for sign in line)


def test_a_value_out_of_its_limits_adds_a_line_that_names_it_with_its_unit():
    *_, last = status_lines(ITEMS | {"voltage_v": 20.0}, LINK)
    assert "outside" in last and "voltage_v 20 V" in last


def test_an_active_fault_is_named():
    assert "WHEEL_STUCK" in status_lines(ITEMS | {"faults": float(1 << _number("WHEEL_STUCK"))}, LINK)[0]


def test_versions_that_differ_are_said():
    assert "differs" in status_lines(ITEMS, LINK | {"versions": "the dictionary differs"})[4]


def _number(name):
    from protocol.tables.faults import BY_NAME

    return BY_NAME[name].number


@pytest.mark.parametrize(("value", "unit", "words"), [
    (math.pi, "rad", "180°"), (math.pi / 180, "rad/s", "1°/s"),
    (25.2, "V", "25.2 V"), (0.5, "1", "0.5"), (7.0, "", "7"),
])  # fmt: skip
def test_numbers_have_their_units_and_angles_are_degrees(value, unit, words):
    assert measured(value, unit) == words


def test_a_request_is_listed_in_the_degrees_that_were_typed():
    assert argument_words("turn", {"heading_rad": math.radians(3.14)}) == "3.14°"
    assert argument_words("goto", {"x_m": 3.0, "y_m": 1.0, "heading_rad": math.pi / 2}) == "3 1 90°"
    assert argument_words("of a later version", {"x_rad": 1.0}) == "1"


def test_an_error_names_an_angle_as_the_help_does():
    assert _as_typed("`heading_rad` = 400 degrees") == "`heading_deg` = 400 degrees"
