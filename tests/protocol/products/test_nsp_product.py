"""The explanation product: exact, small, and never anything but itself or a clear error."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol import WireError
from protocol.products.nsp import MOST_PLACES, MOST_TEXT_BYTES, Candidate, Explanation, decode_nsp, encode_nsp

number = st.floats(allow_nan=False, allow_infinity=True)
cell = st.integers(-(2**31), 2**31 - 1)
count = st.integers(0, 2**32 - 1)
word = st.text(max_size=60)
places = st.builds(Candidate, cell, cell, *[number] * 9)
explanations = st.builds(
    Explanation,
    st.integers(0, 0xFFFF),
    st.tuples(number, number, number),
    st.tuples(number, number),
    st.tuples(number, number, number),
    number,
    st.tuples(number, number),
    word,
    word,
    word,
    word,
    count,
    count,
    st.lists(places, max_size=6).map(tuple),
    st.dictionaries(word, count, max_size=4),
)
CHOSEN = Explanation(
    2, (1.0, 2.0, 0.5), (12.0, 3.0), (4.0, 2.5, 0.7), 3.2, (1.0, 0.5), "explore", "drive", "R10", "the way shrinks",
    34163, 40000, tuple(Candidate(n, 2 * n, 0.1 * n, 0.2, 0.3, 0.9 - 0.1 * n, 1.0, -0.1 - 0.1 * n, 0.6, 50.0, 8.0)
                        for n in range(6)), {"not free": 5000, "no way to the goal": 800, "near an earlier stop": 37},
)  # fmt: skip


@given(explanations)
@settings(max_examples=100, deadline=None, derandomize=True)
def test_every_number_text_and_count_comes_back_exactly(told):
    assert decode_nsp(encode_nsp(told)) == told


def test_a_choice_with_five_alternatives_fits_one_datagram():
    assert len(encode_nsp(CHOSEN)) <= 1060


def test_a_number_that_is_none_comes_back_as_none():
    back = decode_nsp(encode_nsp(CHOSEN._replace(way_m=math.nan)))
    assert math.isnan(back.way_m)


@pytest.mark.parametrize("wrong", [
    {"places": CHOSEN.places[:1] * (MOST_PLACES + 1)}, {"reason": "é" * MOST_TEXT_BYTES}, {"rejected": {"r" * 256: 1}},
])  # fmt: skip
def test_more_than_fits_is_our_own_error(wrong):
    with pytest.raises(ValueError, match=r"at most|more than"):
        encode_nsp(CHOSEN._replace(**wrong))


@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.data())
def test_damaged_bytes_are_a_wire_error_or_an_explanation_never_anything_else(data):
    whole = bytearray(encode_nsp(CHOSEN))
    at = data.draw(st.integers(0, len(whole) - 1))
    whole[at] ^= data.draw(st.integers(1, 255))
    cut = data.draw(st.integers(0, len(whole)))
    for bad in (bytes(whole), bytes(whole[:cut]), bytes(whole) + b"x"):
        try:
            decode_nsp(bad)
        except WireError as error:
            assert error.kind == "product"


@given(st.binary(max_size=300))
@settings(max_examples=100, deadline=None, derandomize=True)
def test_any_bytes_are_a_clear_error(noise):
    with pytest.raises(WireError):
        decode_nsp(noise)
