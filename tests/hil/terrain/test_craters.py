"""A crater has Pike's depth and rim, is whole at the rim and fades with the cube of the distance."""

import math

import numpy as np
import pytest

from hil.terrain.craters import REACH, Crater, CraterLaw, crater_relief, depth_m, draw_craters, profile_m, rim_height_m
from onboard.records import Grid

DIAMETERS = [0.5, 2.0, 6.0, 1000.0]


def grid_of(cell_m, count):
    """A grid round the origin with a centre on it."""
    side = (count - 1) / 2 * cell_m
    return Grid(-side, -side, cell_m, count, count)


def test_a_crater_of_one_kilometre_has_pikes_figures():
    assert (depth_m(1000.0), rim_height_m(1000.0)) == pytest.approx((196.0, 36.0))
    assert depth_m(5.0) / 5.0 == pytest.approx(0.186, abs=0.001)
    assert rim_height_m(5.0) / 5.0 == pytest.approx(0.0334, abs=0.0001)


@pytest.mark.parametrize("diameter_m", DIAMETERS)
def test_floor_lies_its_depth_under_a_rim_that_is_highest_and_whole(diameter_m):
    radius = diameter_m / 2
    inside, at, outside = profile_m(diameter_m, np.array([1 - 1e-9, 1.0, 1 + 1e-9]) * radius)
    assert inside == pytest.approx(at, rel=1e-6) and outside == pytest.approx(at, rel=1e-6)
    heights = profile_m(diameter_m, np.linspace(0, 3 * radius, 3001))
    assert heights.argmax() == 1000 and heights[1000] == pytest.approx(rim_height_m(diameter_m))
    assert heights[1000] - heights[0] == pytest.approx(depth_m(diameter_m)) and heights.argmin() == 0


@pytest.mark.parametrize("diameter_m", DIAMETERS)
def test_ejecta_thin_out_with_the_cube_of_the_distance_until_a_thousandth_is_left(diameter_m):
    rim = rim_height_m(diameter_m)
    found = profile_m(diameter_m, np.array([1.0, 2.0, 4.0, 8.0, REACH, 2 * REACH]) * diameter_m / 2)
    np.testing.assert_allclose(found / rim, [1, 1 / 8, 1 / 64, 1 / 512, 0, 0])
    assert profile_m(diameter_m, np.array([REACH * diameter_m / 2 * (1 - 1e-9)]))[0] <= 0.00101 * rim


def test_what_lies_around_is_what_was_dug_out_within_a_tenth():
    """Below the old ground a bowl is missing; rim and ejecta hold 2 pi h R^2 (1 - 1 / reach) beyond the rim."""
    diameter, cell = 4.0, 0.025
    grid = grid_of(cell, 2 * 800 + 1)
    z = crater_relief(grid, (Crater(0.0, 0.0, diameter),))
    x = grid.x0_m + np.arange(grid.columns) * cell
    beyond = np.hypot(x, x[:, None]) >= diameter / 2
    raised, bowl = z[beyond].sum() * cell**2, (rim_height_m(diameter) - z[~beyond]).sum() * cell**2
    assert raised == pytest.approx(2 * math.pi * rim_height_m(diameter) * 4.0 * (1 - 1 / REACH), rel=2e-3)
    assert bowl == pytest.approx(math.pi / 8 * diameter**2 * depth_m(diameter), rel=2e-3)
    assert z.sum() == pytest.approx(0.0, abs=0.1 * -z[z < 0].sum())


def test_wear_takes_its_share_of_depth_and_rim():
    distance = np.linspace(0, 9, 50)
    np.testing.assert_allclose(profile_m(3.0, distance, wear=0.7), 0.3 * profile_m(3.0, distance))
    assert not profile_m(3.0, distance, wear=1.0).any()


def test_the_same_place_is_as_high_on_every_grid_that_has_it():
    craters = (Crater(0.3, -0.2, 2.0), Crater(-1.1, 0.9, 1.3, 0.5))
    coarse, fine = crater_relief(grid_of(0.3, 21), craters), crater_relief(grid_of(0.1, 61), craters)
    np.testing.assert_allclose(fine[::3, ::3], coarse, atol=1e-12)


def test_relief_is_the_sum_of_all_profiles_also_of_those_beside_the_grid():
    craters = (Crater(0.0, 0.0, 1.0), Crater(0.4, 0.1, 0.6, 0.2), Crater(5.0, -4.0, 3.0), Crater(90.0, 0.0, 2.0))
    grid = grid_of(0.1, 41)
    x, y = np.meshgrid(*[-2.0 + 0.1 * np.arange(41)] * 2)
    plain = sum(profile_m(c.diameter_m, np.hypot(x - c.x_m, y - c.y_m), c.wear) for c in craters)
    np.testing.assert_allclose(crater_relief(grid, craters), plain, atol=1e-12)


@pytest.mark.parametrize("law", [CraterLaw(), CraterLaw(per_m2=0.2, slope=2.8, smallest_m=0.5, largest_m=10.0)])
def test_numbers_follow_the_power_law(law):
    area = 2500.0
    sizes = np.concatenate([law.diameters_m(area, np.random.default_rng(seed)) for seed in range(20)])
    for diameter in (law.smallest_m, 1.5, 3.0):
        expected = law.per_m2 * (diameter**-law.slope - law.largest_m**-law.slope) * 20 * area
        assert (sizes >= diameter).sum() == pytest.approx(expected, rel=0.02)
    assert law.smallest_m <= sizes.min() and sizes.max() <= law.largest_m


def test_craters_are_drawn_by_the_seed_all_over_the_grid_and_beside_it():
    grid, law = Grid(-9.9, -9.9, 0.2, 100, 100), CraterLaw(largest_m=3.0, most_worn=0.5)
    first, second, other = (draw_craters(grid, law, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert first == second != other
    x, y, wear = (np.array([getattr(c, k) for c in first]) for k in ("x_m", "y_m", "wear"))
    assert -13 <= x.min() < -10 and 10 < x.max() <= 13 and -13 <= y.min() < -10 and 10 < y.max() <= 13
    assert 0 <= wear.min() < 0.1 and 0.4 < wear.max() <= 0.5


@pytest.mark.parametrize("wrong", [{"per_m2": 0.0}, {"slope": -1.0}, {"most_worn": 1.5}, {"smallest_m": 7.0}])
def test_a_law_out_of_range_is_refused(wrong):
    with pytest.raises(ValueError, match="should be"):
        CraterLaw(**wrong)
