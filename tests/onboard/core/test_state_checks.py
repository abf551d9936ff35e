"""Check bytes of the state: a replay that differs names the item."""

import struct

import pytest

from onboard.record import state_checks

STATE = {"executive": (1.0, 2.0), "localisation": (0.1, -0.5, 3e-9), "fences": ()}


def test_the_same_state_has_no_difference():
    assert state_checks.first_difference(state_checks.encode(STATE), dict(STATE)) == ""


@pytest.mark.parametrize("other", [0.10000000000000002, 0.2, -0.1, float("nan")])
def test_the_first_item_that_differs_is_named_with_its_part(other):
    words = state_checks.first_difference(state_checks.encode(STATE), STATE | {"localisation": (other, -0.5, 4e-9)})
    assert "localisation[0]" in words and repr(other) in words


def test_a_part_of_another_length_is_named():
    words = state_checks.first_difference(state_checks.encode(STATE), STATE | {"fences": (1.0, 2.0)})
    assert "fences" in words and "0 items" in words and "2" in words


def test_a_state_of_other_parts_is_told_apart():
    assert "3 parts" in state_checks.first_difference(state_checks.encode(STATE), {"executive": (1.0, 2.0)})


def test_a_record_without_checks_names_nothing():
    assert state_checks.first_difference(b"", STATE) == ""
    assert state_checks.encode({}) == b""


def test_a_cut_off_message_is_refused():
    with pytest.raises((IndexError, struct.error)):
        state_checks.first_difference(state_checks.encode(STATE)[:8], STATE)


def test_one_byte_for_each_item():
    counts, checks = state_checks.read(state_checks.encode(STATE))
    assert counts == [2, 3, 0] and len(checks) == 5
