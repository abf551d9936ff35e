"""The section of poses: what goes in comes out, damage is an error, and it fits behind a map's bytes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from protocol import WireError
from protocol.products import LdemProduct, MapGrid, decode_ldem, encode_ldem, poses_of, rounded
from protocol.products.pose_map import PoseMap, decode_poses, encode_poses

FREEDOM = hnp.arrays(np.uint8, st.tuples(st.just(8), st.integers(1, 9), st.integers(1, 9)), elements=st.integers(0, 2))
PLACES = st.lists(st.tuples(st.floats(-99, 99, width=32), st.floats(-99, 99, width=32)), max_size=3).map(tuple)
HEIGHTS = hnp.arrays(
    np.float32,
    st.tuples(st.integers(1, 7), st.integers(1, 7)),
    elements=st.one_of(st.just(np.nan), st.floats(-50, 50, width=32)),
)


@settings(deadline=None, max_examples=60)
@given(FREEDOM, PLACES, st.booleans())
def test_poses_come_back_to_the_bit(freedom, places, known):
    poses = PoseMap(freedom, (1.25, -3.5, 0.7), places, known, b"12345678")
    back = decode_poses(encode_poses(poses))
    assert np.array_equal(back.freedom, freedom)
    assert back[1:] == poses[1:]


@settings(deadline=None, max_examples=60)
@given(HEIGHTS)
def test_rounded_heights_are_those_that_a_product_brings(heights):
    rows, columns = heights.shape
    product = LdemProduct(MapGrid(0.0, 0.0, 0.1, rows, columns), heights, np.zeros(heights.shape, np.uint8))
    assert np.array_equal(decode_ldem(encode_ldem(product)).heights_m, rounded(heights), equal_nan=True)


def test_a_map_is_read_alike_with_and_without_the_section():
    heights = np.arange(12, dtype=np.float32).reshape(3, 4) / 7
    product = LdemProduct(MapGrid(0.0, 0.0, 0.1, 3, 4), heights, np.full((3, 4), 3, np.uint8))
    bare, section = encode_ldem(product), encode_poses(PoseMap(np.full((8, 3, 4), 2, np.uint8), (0.0, 0.0, 0.0)))
    assert np.array_equal(decode_ldem(bare + section).heights_m, decode_ldem(bare).heights_m)
    assert poses_of(bare) is None
    assert poses_of(bare + section).freedom.min() == 2


def test_damage_is_a_wire_error_never_another():
    whole = encode_poses(PoseMap(np.random.default_rng(1).integers(0, 3, (8, 20, 20)).astype(np.uint8), (0, 0, 0)))
    for end in range(len(whole)):
        with pytest.raises(WireError):
            decode_poses(whole[:end])
    rng = np.random.default_rng(2)
    for _ in range(300):
        broken = bytearray(whole)
        broken[rng.integers(len(whole))] ^= int(rng.integers(1, 256))
        try:
            decode_poses(bytes(broken))
        except WireError:
            continue


@pytest.mark.parametrize("freedom", [np.zeros((7, 2, 2), np.uint8), np.full((8, 2, 2), 3, np.uint8)])
def test_what_is_no_freedom_of_eight_orientations_is_refused(freedom):
    with pytest.raises(ValueError, match="8 layers of 0 to 2"):
        encode_poses(PoseMap(freedom, (0.0, 0.0, 0.0)))
