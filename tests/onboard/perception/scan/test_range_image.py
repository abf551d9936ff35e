"""The filter of the range image, against a slow twin, and what it keeps and takes out."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.kernel_calls import range_filter
from onboard.perception.scan.range_image import witnessed

SIGMA_M = 0.02
WAYS = ((0, 1), (1, -1), (1, 0), (1, 1))
LAW = settings(max_examples=50, deadline=None)


def twin(ranges_m, seen, tolerance_m):
    """Return by return."""
    kept = np.zeros(seen.shape, bool)

    def at(k, i):
        inside = 0 <= k < seen.shape[0] and 0 <= i < seen.shape[1]
        return ranges_m[k, i] if inside and seen[k, i] else np.float32(math.nan)

    for k, i in np.argwhere(seen):
        for dk, di in WAYS:
            one, other = at(k + dk, i + di), at(k - dk, i - di)
            for near in (one, other, np.float32(0.5) * (one + other)):
                kept[k, i] |= bool(abs(ranges_m[k, i] - near) <= np.float32(tolerance_m))
    return kept


@LAW
@given(st.integers(0, 10_000), st.integers(1, 7), st.integers(1, 40))
def test_the_kernel_keeps_what_the_slow_twin_keeps(seed, lines, beams):
    rng = np.random.default_rng(seed)
    ranges_m = rng.choice([2.0, 2.05, 2.1, 2.2, 2.4, 3.0], (lines, beams)).astype(np.float32)
    seen = rng.random((lines, beams)) < 0.7
    got = range_filter.keep_witnessed(ranges_m, seen, 0.085)
    np.testing.assert_array_equal(got, twin(ranges_m, seen, 0.085))


def flat(lines=60, beams=200, height_m=0.7):
    """Level ground as a sweep sees it: from 30 degrees down to 4."""
    down = np.radians(np.linspace(30, 4, lines))[:, None]
    phi = np.radians((np.arange(beams) - beams / 2) * 0.25)
    return (height_m / (np.sin(down) * np.cos(phi))).astype(np.float32)


def test_level_ground_is_kept_whole_with_noise_up_to_8_m():
    ranges_m = flat()
    noisy = ranges_m + np.random.default_rng(1).normal(0, SIGMA_M, ranges_m.shape).astype(np.float32)
    near = ranges_m <= 8.0
    assert near.sum() > 9_000
    assert (witnessed(noisy, np.ones(near.shape, bool), SIGMA_M)[near]).mean() > 0.9995


@pytest.mark.parametrize("off_m", [-0.5, -0.3, 0.3, 0.5])
def test_a_single_wrong_range_is_taken_out_and_its_neighbours_stay(off_m):
    ranges_m = flat()
    ranges_m[20, 100] += off_m
    kept = witnessed(ranges_m, np.ones(ranges_m.shape, bool), SIGMA_M)
    assert not kept[20, 100] and kept.sum() == kept.size - 1


def test_a_small_rock_is_its_own_witness():
    ranges_m = flat()
    ranges_m[20, 100:102] -= 0.4
    assert witnessed(ranges_m, np.ones(ranges_m.shape, bool), SIGMA_M).all()


def test_a_mixed_pixel_at_an_edge_is_taken_out_and_the_edge_stays():
    ranges_m = np.full((5, 40), 5.0, np.float32)
    ranges_m[:, :20] = 3.0
    ranges_m[2, 20] = 4.1
    kept = witnessed(ranges_m, np.ones(ranges_m.shape, bool), SIGMA_M)
    assert np.argwhere(~kept).tolist() == [[2, 20]]


def test_a_lost_beam_is_no_witness():
    ranges_m, seen = np.full((1, 5), 3.0, np.float32), np.array([[True, False, True, True, False]])
    assert witnessed(ranges_m, seen, SIGMA_M).tolist() == [[False, False, True, True, False]]


def test_a_scanner_said_to_be_without_noise_still_sees_rough_ground():
    ranges_m = np.full((3, 50), 3.0, np.float32) + np.linspace(0, 1, 50, dtype=np.float32)
    assert witnessed(ranges_m, np.ones(ranges_m.shape, bool), 0.0).all()


def test_the_door_names_what_is_wrong():
    good = np.ones((2, 3), np.float32)
    with pytest.raises(ValueError, match=r"seen: expected bool \(2, 3\)"):
        range_filter.keep_witnessed(good, np.ones((2, 2), bool), 0.1)
    with pytest.raises(ValueError, match="tolerance_m: expected a finite number"):
        range_filter.keep_witnessed(good, np.ones((2, 3), bool), math.nan)
