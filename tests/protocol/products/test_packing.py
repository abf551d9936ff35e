"""Rules common to all codecs: sizes are known before anything is allocated, predictions are undone exactly."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol import WireError
from protocol.products.packing import compress, expand, pack_integers, unpack_integers
from protocol.products.prediction import integers, mean_of_three, median_edge, residuals

TERABYTE = 1 << 40


def frame_that_claims(size: int) -> bytes:
    """A zstandard frame's magic and a head that names a content size of 8 bytes (RFC 8878, 3.1.1.1), then nothing."""
    return bytes.fromhex("28b52ffd") + bytes([0b1110_0000]) + size.to_bytes(8, "little") + bytes(3)


def test_a_part_that_claims_a_terabyte_is_refused_before_it_is_allocated():
    with pytest.raises(WireError, match="instead of 8"):
        expand(frame_that_claims(TERABYTE), 8)


@pytest.mark.parametrize(
    "data", [b"", b"cheese", frame_that_claims(8), compress(b"seven B"), compress(b"too long")[:-1]]
)
def test_a_part_of_another_size_or_none_at_all_is_a_wire_error(data):
    with pytest.raises(WireError) as caught:
        expand(data, 8)
    assert caught.value.kind == "product"


@given(st.lists(st.integers(-(2**61), 2**61), max_size=40))
@settings(max_examples=100, deadline=None, derandomize=True)
def test_integers_of_any_size_come_back(values):
    packed = pack_integers(np.array(values, np.int64))
    assert unpack_integers(packed, len(values)).tolist() == values


@given(st.binary(max_size=60), st.integers(0, 50))
@settings(max_examples=100, deadline=None, derandomize=True)
def test_bytes_that_are_no_integers_are_a_wire_error(noise, count):
    with pytest.raises(WireError):
        unpack_integers(b"\x09" + noise, count)
    with pytest.raises(WireError):
        unpack_integers(b"", count)


@pytest.mark.parametrize("predict", [median_edge, mean_of_three])
@given(st.integers(1, 9), st.integers(1, 9), st.floats(0, 1), st.integers(0, 2**16))
@settings(max_examples=60, deadline=None, derandomize=True)
def test_a_prediction_is_undone_exactly_whatever_is_known(predict, rows, columns, share, seed):
    generator = np.random.default_rng(seed)
    known = generator.random((rows, columns)) >= share
    quanta = generator.integers(-(2**30), 2**30, (rows, columns))
    left = residuals(quanta, known, predict)
    assert not left[~known].any()
    assert np.array_equal(integers(left, known, predict)[known], quanta[known])
