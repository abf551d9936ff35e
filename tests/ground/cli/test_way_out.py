"""Refusals name what to do next; an unknown name is answered by the names most like it."""

import pytest

from ground.cli.operations.way_out import near_names, refusal_words, shorter, way_out
from protocol.tables import commands
from protocol.tables.commands import RefusedError, check_mode, named
from protocol.tables.modes import Mode
from protocol.tables.telemetry import BY_NAME


@pytest.mark.parametrize(("name", "mode", "first"), [
    ("turn", Mode.AUTONOMOUS, ["stop"]), ("goto", Mode.TELEOP, ["stop"]), ("goto", Mode.SAFE, ["resume"]),
    ("goto", Mode.ESTOP, ["reset"]), ("reset", Mode.STANDBY, ["emergency-stop"]),
])  # fmt: skip
def test_the_way_out_of_a_mode_is_the_fewest_commands(name, mode, first):
    assert way_out(name, mode) == first


@pytest.mark.parametrize("name", [row.name for row in commands.TABLE])
@pytest.mark.parametrize("mode", list(Mode))
def test_no_way_out_moves_the_rover_and_each_step_is_allowed_where_it_is_given(name, mode):
    steps = way_out(name, mode)
    rows = {row.typed: row for row in commands.TABLE}
    assert not any(rows[step].moves for step in steps)
    if steps:
        assert mode in rows[steps[0]].modes


def test_a_refusal_as_the_rover_words_it_names_the_mode_and_the_next_command():
    with pytest.raises(RefusedError) as caught:
        check_mode("turn", Mode.AUTONOMOUS)
    words = refusal_words("turn", str(caught.value))
    assert "AUTONOMOUS" in words and "`ground stop` first" in words and len(words) < 100


def test_a_refusal_of_another_kind_is_passed_on():
    assert refusal_words("goto", "keep-out 3") == "goto was refused: keep-out 3"


@pytest.mark.parametrize(("name", "likely"), [
    ("volts", "voltage_v"), ("VOLTAGE", "voltage_v"), ("sigma_ya", "sigma_yaw_rad"),
])  # fmt: skip
def test_an_item_that_is_none_is_answered_by_those_like_it(name, likely):
    assert f"`{likely}`" in near_names(name, BY_NAME)


def test_a_name_like_none_is_answered_in_one_short_line():
    with pytest.raises(RefusedError) as caught:
        named("qqqqqq", [f"name_{k}" for k in range(100)], "item")
    assert len(shorter(str(caught.value))) < 100 and "there are 100" in shorter(str(caught.value))
    assert shorter("`x` = 3 should be 1 to 2") == "`x` = 3 should be 1 to 2"
