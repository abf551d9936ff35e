"""Ground made from a recipe is what the recipe says."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from hil.terrain.craters import CraterLaw
from hil.terrain.mesh import block_mean, slopes_deg
from hil.terrain.recipe import Course, Recipe, compose
from hil.terrain.rock_sizes import Golombek, PowerLaw

BARE = Recipe(hurst=0.8, median_slope_deg=5.0)


def field(recipe, seed=3, course=None):
    return compose(recipe, course or Course(), np.random.default_rng(seed), seed)


def test_median_slope_is_the_one_asked_for():
    made = field(BARE)
    assert np.median(slopes_deg(made.soil_z, 0.05)) == pytest.approx(5.0, abs=0.01)
    assert made.stats["median_slope_deg"] == pytest.approx(5.0, abs=0.01)


def test_sigma_scales_the_soil():
    low, high = (field(Recipe(hurst=0.7, sigma=sigma)).soil_z.astype(float) for sigma in (0.01, 0.02))
    np.testing.assert_allclose(high, 2 * low, atol=1e-6)


def test_craters_lie_on_the_same_soil_and_the_orbiter_sees_them():
    bare, cratered = field(BARE), field(Recipe(0.8, median_slope_deg=5.0, craters=CraterLaw()))
    added = cratered.soil_z.astype(float) - bare.soil_z
    seen = cratered.gdem.heights_m - bare.gdem.heights_m
    assert np.ptp(added) > 0.2 and added[cratered.grid.cell(0.0, 0.0)] == 0
    grid, gdem = cratered.grid, cratered.gdem.grid
    skip = round((math.ceil((grid.y0_m - 0.025) / 2) * 2 - (grid.y0_m - 0.025)) / 0.05)
    left = round((math.ceil((grid.x0_m - 0.025) / 2) * 2 - (grid.x0_m - 0.025)) / 0.05)
    coarse = block_mean(added[skip:, left:], 40)
    j, i = gdem.cell(grid.x0_m - 0.025 + left * 0.05 + 1, grid.y0_m - 0.025 + skip * 0.05 + 1)
    np.testing.assert_allclose(seen[j : j + len(coarse), i : i + coarse.shape[1]], coarse, atol=1e-5)


@pytest.mark.parametrize(("rocks", "expected"), [(None, 0.0), (PowerLaw(0.04), 0.04), (Golombek(0.1), 0.059)])
def test_rocks_cover_what_their_law_says(rocks, expected):
    made = field(Recipe(0.8, median_slope_deg=5.0, rocks=rocks))
    assert made.stats["rock_area_ratio"] == pytest.approx(expected, rel=0.04)


def test_same_generator_same_bytes():
    recipe = Recipe(0.8, sigma=0.01, craters=CraterLaw(), rocks=Golombek(0.05))
    first, second, other = field(recipe), field(recipe), field(recipe, seed=4)
    assert first.soil_z.tobytes() == second.soil_z.tobytes() != other.soil_z.tobytes()
    assert [r.vertices_m.tobytes() for r in first.rocks] == [r.vertices_m.tobytes() for r in second.rocks]


def test_course_lays_start_and_goal():
    made = field(BARE, course=Course(south_m=8.0, bearing_rad=0.3))
    assert math.hypot(*made.goal_m) == pytest.approx(15.0) and made.start.yaw_rad == 0.3
    assert made.grid.y0_m - 0.025 == pytest.approx(-8.0) and made.soil_z[made.grid.cell(0.0, 0.0)] == 0


@pytest.mark.parametrize("wrong", [{}, {"sigma": 0.01, "median_slope_deg": 5.0}, {"hurst": 1.2, "sigma": 0.01}])
def test_a_recipe_that_is_none_is_refused(wrong):
    with pytest.raises(ValueError, match="found"):
        Recipe(**({"hurst": 0.8} | wrong))


def test_the_example_of_the_page_runs():
    page = (Path(__file__).parents[3] / "docs" / "terrain.md").read_text()
    example = re.search(r"```python\n(.*?)```", page, re.DOTALL).group(1)
    names = {}
    exec(example, names)
    assert names["field"].soil_z.shape == (400, 400) and len(names["field"].rocks) > 50
