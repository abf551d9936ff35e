"""Algorithm 2, fixed: it climbs to a top from every seed, ends, and looks at few nodes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.planning.sensing.hill_climb import climb, draw_seeds

EVERYWHERE = np.ones((9, 9), bool)
Y, X = np.mgrid[0:9, 0:9]
CONE = -np.hypot(Y - 6.0, X - 2.0)


def of(field):
    """The score that reads a field, and the list of cells it was asked for."""
    asked = []

    def score(cells):
        asked.extend(map(tuple, cells.tolist()))
        return field[cells[:, 0], cells[:, 1]]

    return score, asked


@pytest.mark.parametrize("seed", [(0, 0), (8, 8), (0, 8), (6, 2)])
def test_one_hill_is_climbed_to_its_top_from_anywhere(seed):
    found = climb(of(CONE)[0], EVERYWHERE, (seed,))
    assert found.cell == (6, 2)
    assert found.score == 0.0


def test_the_path_goes_to_the_steepest_neighbour_and_nothing_else_is_looked_at():
    score, asked = of(CONE)
    found = climb(score, EVERYWHERE, ((8, 2),))
    block = {(j, i) for j in range(5, 9) for i in range(1, 4)}  # around (8, 2), (7, 2) and (6, 2)
    assert set(asked) == set(found.evaluated) == block


def test_every_seed_is_climbed_and_the_highest_top_wins():
    two = np.maximum(-np.hypot(Y - 1.0, X - 1.0), 1.0 - np.hypot(Y - 7.0, X - 7.0))
    found = climb(of(two)[0], EVERYWHERE, ((0, 0), (8, 8)))
    assert found.tops == ((1, 1), (7, 7))
    assert (found.cell, found.score) == ((7, 7), 1.0)


def test_it_never_steps_to_a_worse_neighbour():
    found = climb(of(-CONE)[0], EVERYWHERE, ((0, 8),))  # a pit: the corner is the highest place
    assert found.cell == (0, 8)


def test_level_ground_is_a_top_everywhere():
    found = climb(of(np.zeros((9, 9)))[0], EVERYWHERE, ((4, 4), (2, 3)))
    assert found.tops == ((4, 4), (2, 3))
    assert found.cell == (2, 3)


def test_it_walks_on_candidates_only():
    gap = EVERYWHERE.copy()
    gap[4] = False
    score, asked = of(CONE)
    assert climb(score, gap, ((0, 2),)).cell == (3, 2)
    assert all(gap[cell] for cell in asked)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 12), st.integers(1, 12), st.integers(1, 6))
def test_on_any_field_every_top_is_a_local_maximum_above_its_seed(number, rows, columns, levels):
    rng = np.random.default_rng(number)
    field = rng.integers(0, levels, (rows, columns)).astype(float)
    candidates = rng.random((rows, columns)) < 0.7
    candidates[0, 0] = True
    seeds = draw_seeds(candidates, rng)
    score, asked = of(field)
    found = climb(score, candidates, seeds)
    assert len(asked) == len(set(asked)) == len(found.evaluated), "each node is scored once"
    for seed, top in zip(seeds, found.tops, strict=True):
        around = np.s_[max(top[0] - 1, 0) : top[0] + 2, max(top[1] - 1, 0) : top[1] + 2]
        assert field[top] >= field[seed]
        assert field[top] >= field[around][candidates[around]].max()
    assert found.score == max(field[top] for top in found.tops)


def test_seeds_are_candidates_and_those_of_the_generator():
    candidates = X > 5
    drawn = draw_seeds(candidates, np.random.default_rng(3), 40)
    assert len(drawn) == 40
    assert all(candidates[cell] for cell in drawn)
    assert drawn == draw_seeds(candidates, np.random.default_rng(3), 40)
    assert len(set(drawn)) > 10
    assert draw_seeds(np.zeros((3, 3), bool), np.random.default_rng(0)) == ()


@pytest.mark.parametrize("seeds", [(), ((0, 9),), ((-1, 0),), ((4, 4),)])
def test_seeds_that_are_no_candidates_are_refused(seeds):
    with pytest.raises(ValueError, match="seeds: expected cells of candidates"):
        climb(of(CONE)[0], EVERYWHERE & (X != 4), seeds)
