"""Eq. 27 and 28, corrected: the choice is the optimum of an exhaustive search."""

import math
from dataclasses import replace

import numpy as np
import pytest

from onboard.config import Mission
from onboard.planning import next_position as nsp
from onboard.planning import visibility
from onboard.records import Grid
from tests import oracles_visibility

GRID = Grid(0.05, 0.05, 0.1, 48, 48)
EYES = nsp.Eyes(range_m=1.5, beams=90)
MISSION = Mission(candidate_stride=3)


def question(seed=0):
    rng = np.random.default_rng(seed)
    z = rng.normal(0, 0.15, (48, 48)).astype(np.float32)
    z[:, 38:] = np.nan
    free = rng.random((48, 48)) < 0.6
    free[:, 38:] = False
    j, i = np.mgrid[0:48, 0:48]
    cost = (0.1 * np.hypot(j - 24, i - 47)).astype(np.float32)
    cost[:6] = np.inf
    return nsp.Question(GRID, z, free, cost, (4.7, 2.4), ((1.0, 2.0),))


@pytest.mark.parametrize("seed", range(4))
def test_choice_is_the_exhaustive_optimum(seed):
    asked = question(seed)
    found = nsp.choose(asked, EYES, MISSION)
    table = visibility.beams(1.5, 0.1, 90)
    look = oracles_visibility.Look(visibility.scene(asked.z_mean), table, EYES.height_m)
    cells = [
        (j, i)
        for j in range(0, 48, 3)
        for i in range(0, 48, 3)
        if asked.free[j, i] and np.isfinite(asked.cost_m[j, i]) and math.dist(GRID.centre(j, i), (1.0, 2.0)) >= 0.5
    ]
    cost = np.array([asked.cost_m[c] for c in cells], dtype=float)
    best = None
    for cell, length in zip(cells, cost):
        vis = look.index(cell)
        score = 1.0 * vis - 0.5 * (length - cost.min()) / (cost.max() - cost.min())
        if best is None or score > best[0] + 1e-12:
            best = (score, cell)
    assert found.best.cell == best[1]
    assert found.best.score == pytest.approx(best[0], abs=1e-9)
    assert np.isfinite(found.score_map).sum() == len(cells)
    assert np.nanmax(found.score_map) == pytest.approx(best[0], abs=1e-6)


def test_alternatives_are_a_metre_apart_and_no_better():
    found = nsp.choose(question(), EYES, MISSION)
    places = [found.best, *found.alternatives]
    assert 1 <= len(found.alternatives) <= 5
    for n, a in enumerate(places):
        assert a.score <= found.best.score
        assert all(math.dist((a.x_m, a.y_m), (b.x_m, b.y_m)) >= 1.0 - 1e-6 for b in places[:n])


def test_rejections_are_counted_by_rule():
    asked = question()
    found = nsp.choose(asked, EYES, MISSION)
    lattice = 16 * 16
    assert sum(found.rejections.values()) + np.isfinite(found.score_map).sum() == lattice
    assert found.rejections["no way to the goal"] > 0
    assert found.rejections["near an earlier stop"] > 0


def test_heading_looks_at_the_unknown_else_at_the_goal():
    asked = replace(question(), z_mean=np.zeros((48, 48), np.float32), goal_m=(2.4, 40.0))
    found = nsp.choose(asked, EYES, MISSION)
    assert found.best.heading_rad == pytest.approx(math.pi / 2, abs=0.2)
    z = np.zeros((48, 48), np.float32)
    z[:, 30:] = np.nan
    only = np.zeros((48, 48), bool)
    only[24, 24] = True
    found = nsp.choose(replace(asked, z_mean=z, free=only), EYES, MISSION)
    assert abs(found.best.heading_rad) < math.radians(65)
    assert found.best.new_cells > 0


def test_equal_costs_make_no_distance_term():
    vis = np.array([0.2, 0.9])
    np.testing.assert_allclose(nsp.evaluate(vis, np.array([3.0, 3.0]), MISSION), vis)


def test_no_candidate_is_no_choice():
    asked = replace(question(), free=np.zeros((48, 48), bool))
    found = nsp.choose(asked, EYES, MISSION)
    assert found.best is None
    assert np.isnan(found.score_map).all()
