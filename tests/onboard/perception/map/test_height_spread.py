"""The spread of a cell's heights is that of its hits, on a mountain as at the origin."""

import numpy as np
import pytest

from onboard.perception.map import ldem
from onboard.perception.map.height_spread import height_std_m


def of_heights(heights_m):
    """A map of one cell with these hits, as sums."""
    made = ldem.empty(ldem.lattice_grid(0, 0, 1, 1, 0.1))
    z = np.asarray(heights_m, np.float64)
    made.n[...], made.sum_z[...], made.sum_z2[...] = len(z), z.sum(), (z * z).sum()
    return float(height_std_m(made)[0, 0])


@pytest.mark.parametrize("above_m", [0.0, -12.0, 3000.0])
def test_the_spread_is_numpys_to_a_tenth_of_a_millimetre_at_any_height(above_m):
    heights = above_m + np.random.default_rng(9).normal(0.0, 0.02, 500)
    assert of_heights(heights) == pytest.approx(heights.std(), abs=1e-4)


def test_equal_heights_have_no_spread_and_no_square_root_of_less_than_nothing():
    for z in (0.1, 0.3, 77.7, 3000.1):
        assert 0.0 <= of_heights([z] * 7) < 3e-8 * z + 1e-12


def test_one_hit_or_none_has_no_spread():
    assert np.isnan(of_heights([0.3])) and np.isnan(of_heights([]))
    assert of_heights([0.3, 0.5]) == pytest.approx(0.1)
