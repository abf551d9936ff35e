"""The product of height deviations: within its error, unknown stays unknown, damage is a WireError."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from protocol import WireError
from protocol.products import MapGrid
from protocol.products.height_std import HeightStd, decode_height_std, encode_height_std

DEVIATIONS = hnp.arrays(
    np.float32,
    st.tuples(st.integers(1, 9), st.integers(1, 9)),
    elements=st.one_of(st.just(np.nan), st.floats(0.0, 40.0, width=32)),
)


def product_of(std_m):
    return HeightStd(MapGrid(-3.0, 4.5, 0.1, *std_m.shape), std_m)


@settings(deadline=None, max_examples=100)
@given(DEVIATIONS)
def test_a_deviation_comes_back_within_a_quarter_octave_and_none_stays_none(std_m):
    back = decode_height_std(encode_height_std(product_of(std_m)))
    known = np.isfinite(std_m)
    assert back.grid == product_of(std_m).grid
    assert np.array_equal(np.isfinite(back.std_m), known)
    ratio = back.std_m[known] / np.maximum(std_m[known], 1e-3)
    assert np.all(np.abs(np.log2(ratio)) <= 0.25 + 1e-5)


def test_damage_is_a_wire_error_never_another():
    whole = encode_height_std(product_of(np.random.default_rng(1).uniform(0, 1, (20, 20)).astype(np.float32)))
    for end in range(len(whole)):
        with pytest.raises(WireError):
            decode_height_std(whole[:end])
    rng = np.random.default_rng(2)
    for _ in range(300):
        broken = bytearray(whole)
        broken[rng.integers(len(whole))] ^= int(rng.integers(1, 256))
        try:
            back = decode_height_std(bytes(broken))
        except WireError:
            continue
        assert back.std_m.shape == (back.grid.rows, back.grid.columns)


@pytest.mark.parametrize("cell_m", [0.0, -0.1, math.nan, math.inf])
def test_a_grid_without_a_size_of_cell_is_refused(cell_m):
    data = bytearray(encode_height_std(product_of(np.ones((2, 2), np.float32))))
    data[24:32] = np.float64(cell_m).tobytes()
    with pytest.raises(WireError):
        decode_height_std(bytes(data))


def test_a_shape_that_is_not_the_grids_is_refused():
    with pytest.raises(ValueError, match="for a grid of"):
        encode_height_std(HeightStd(MapGrid(0.0, 0.0, 0.1, 3, 3), np.ones((2, 3), np.float32)))
