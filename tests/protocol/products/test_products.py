"""The map product: sizes, errors, bits."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol import WireError
from protocol.products import LdemProduct, MapGrid, decode_ldem, encode_ldem


def terrain(size: int = 200, sigma_m: float = 0.25, seed: int = 1) -> np.ndarray:
    """Fractal ground (Hurst 0.8) with 60 rocks: what natural terrain is taken to be."""
    generator = np.random.default_rng(seed)
    k = np.hypot(*np.meshgrid(np.fft.fftfreq(size), np.fft.fftfreq(size), indexing="ij"))
    k[0, 0] = np.inf
    z = np.real(np.fft.ifft2(np.fft.fft2(generator.standard_normal((size, size))) * k**-1.8))
    z *= sigma_m / np.sqrt(np.mean(k**-3.6))  # sigma of all such grounds, so each is as rough as the next
    y, x = np.mgrid[:size, :size] * 0.1
    for cx, cy, u in generator.uniform([0, 0, 0.04], [20, 20, 1], (60, 3)):
        r = 0.08 / np.sqrt(u)  # radii 0.08 to 0.4 m, the small ones most frequent
        inside = r**2 - (x - cx) ** 2 - (y - cy) ** 2
        top = z[int(cy * 10) % size, int(cx * 10) % size] + np.sqrt(np.maximum(0, inside)) - 0.2 * r
        z = np.where(inside > 0, np.maximum(z, top), z)
    return z.astype(np.float32)


def product(heights: np.ndarray, sets: np.ndarray | None = None) -> LdemProduct:
    rows, columns = heights.shape
    return LdemProduct(
        MapGrid(-9.95, -4.95, 0.1, rows, columns), heights, np.zeros(heights.shape, np.uint8) if sets is None else sets
    )


def off_m(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.nanmax(np.abs(a.astype(np.float64) - b.astype(np.float64))))


def test_200_by_200_of_natural_terrain_take_at_most_26_kb_at_1_mm():
    heights = terrain()
    sets = np.where(heights > 0.3, 2, 3).astype(np.uint8)
    data = encode_ldem(product(heights, sets))
    back = decode_ldem(data)
    assert len(data) <= 26_000
    assert off_m(back.heights_m, heights) <= 0.001
    assert np.array_equal(back.node_sets, sets)
    assert back.grid == MapGrid(-9.95, -4.95, 0.1, 200, 200)


def test_a_map_with_a_third_of_its_cells_unknown_takes_less_and_keeps_them_unknown():
    heights = terrain()
    y, x = np.mgrid[:200, :200] - 100
    hidden = (np.sin(7 * np.arctan2(y, x)) > 0.4) & (np.hypot(x, y) > 20)
    heights[hidden] = np.nan
    data = encode_ldem(product(heights))
    back = decode_ldem(data)
    assert len(data) < 19_500
    assert np.array_equal(np.isnan(back.heights_m), hidden)
    assert off_m(back.heights_m, heights) <= 0.001


def test_encoding_what_was_decoded_gives_the_same_heights_to_the_bit():
    once = decode_ldem(encode_ldem(product(terrain(60))))
    twice = decode_ldem(encode_ldem(once))
    assert off_m(once.heights_m, twice.heights_m) <= 1e-6


@settings(max_examples=40, deadline=None, derandomize=True)
@given(st.integers(1, 12), st.integers(1, 12), st.floats(0, 1), st.integers(0, 2**16), st.sampled_from([0.01, 5, 3000]))
def test_any_shape_mask_and_roughness_comes_back_within_half_a_step(rows, columns, share, seed, sigma_m):
    generator = np.random.default_rng(seed)
    heights = generator.normal(0, sigma_m, (rows, columns)).astype(np.float32)
    heights[generator.random((rows, columns)) < share] = np.nan
    sets = generator.integers(0, 4, (rows, columns)).astype(np.uint8)
    back = decode_ldem(encode_ldem(product(heights, sets)))
    assert np.array_equal(np.isnan(back.heights_m), np.isnan(heights))
    assert np.array_equal(back.node_sets, sets)
    if np.isfinite(heights).any():
        assert off_m(back.heights_m, heights) <= 0.000996 + sigma_m * 1e-6


def test_a_map_without_any_height_is_a_map():
    back = decode_ldem(encode_ldem(product(np.full((5, 7), np.nan, np.float32))))
    assert np.isnan(back.heights_m).all() and back.heights_m.shape == (5, 7)


def test_wrong_shapes_are_our_own_error():
    with pytest.raises(ValueError, match="for a grid of"):
        encode_ldem(product(terrain(20))._replace(node_sets=np.zeros((3, 3), np.uint8)))


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.data())
def test_damaged_bytes_are_a_wire_error_or_a_map_of_the_same_shape_never_anything_else(data):
    whole = bytearray(encode_ldem(product(terrain(16))))
    at = data.draw(st.integers(0, len(whole) - 1))
    whole[at] ^= data.draw(st.integers(1, 255))
    cut = data.draw(st.integers(0, len(whole)))
    for bad in (bytes(whole), bytes(whole[:cut])):
        try:
            decode_ldem(bad)
        except WireError as error:
            assert error.kind == "product"
