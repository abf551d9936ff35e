"""Eq. 28 and Algorithm 2 as printed: what they reward, and climbs that never end."""

import numpy as np
import pytest

from docs.as_printed.next_position import (
    LARGE,
    NEIGHBOURS,
    Mended,
    algorithm_2,
    eq_27,
    eq_28,
    obs_of_algorithm_2,
    obs_of_the_text,
)
from docs.as_printed.visibility import Fan, algorithm_1
from docs.as_printed.visibility import Mended as MendedVisibility
from onboard.planning.local.distance_transform import cost_to_go
from onboard.planning.sensing.gain import Eyes
from onboard.planning.sensing.next_position import Criterion, Question, choose
from onboard.records import Grid

ALL = Mended(compares_with_current=True, tries_every_seed=True, keeps_the_better=True)
ROW, COLUMN = np.mgrid[0:40, 0:40].astype(float)
CONE = 1.0 - 0.01 * np.hypot(ROW - 25, COLUMN - 12)
FREE = np.ones((40, 40), bool)
GOAL_M = np.array([3.9, 2.0, 0.0])
NODES_M = np.stack([0.1 * COLUMN, 0.1 * ROW, 0 * COLUMN], axis=-1)


def best(score):
    return tuple(int(k) for k in np.unravel_index(np.argmax(score), score.shape))


def flown(length, z_mean):
    """The place that flies for costs-to-go (rows, columns) in whatever unit, over heights."""
    grid = Grid(0.05, 0.05, 0.1, 40, 40)
    question = Question(grid, z_mean.astype(np.float32), FREE, length.astype(np.float32), (3.9, 2.0))
    return choose(question, Eyes(range_m=1.5, beams=90), Criterion()).best.cell


def maxima(score):
    """Nodes that no neighbour exceeds."""
    padded = np.pad(score, 1, constant_values=-np.inf)
    around = [padded[1 + b : 41 + b, 1 + a : 41 + a] for b, a in NEIGHBOURS]
    return score >= np.max(around, axis=0)


@pytest.fixture(scope="module")
def hills():
    """Smooth random hills: four waves each way."""
    rng = np.random.default_rng(2)
    waves = rng.normal(size=(4, 4, 2)) / (1 + np.arange(4)[:, None, None] + np.arange(4)[None, :, None])
    along, across = ROW / 40 * 2 * np.pi, COLUMN / 40 * 2 * np.pi
    parts = [
        w[0] * np.cos(a * along + b * across) + w[1] * np.sin(a * along - b * across)
        for a, row in enumerate(waves)
        for b, w in enumerate(row)
    ]
    return np.sum(parts, axis=0)


def test_eq_28_rewards_distance_where_the_correction_rewards_nearness():
    vis, length = np.full((40, 40), 0.5), eq_27(NODES_M, GOAL_M)
    assert length[best(eq_28(vis, length, 0 * vis, (1.0, 0.5)))] == length.max()
    assert length[flown(length, 0 * length)] == length.min()


def test_eq_28_mixes_metres_with_a_ratio_so_the_unit_decides():
    vis, length = CONE, eq_27(NODES_M, GOAL_M)
    in_metres = best(eq_28(vis, length, 0 * vis, (1.0, 0.2)))
    in_kilometres = best(eq_28(vis, length / 1000, 0 * vis, (1.0, 0.2)))
    assert in_metres != in_kilometres == best(vis)
    bumpy = 0.05 * np.sin(ROW) * np.cos(1.7 * COLUMN)
    assert flown(length, bumpy) == flown(1000 * length, bumpy)


def test_the_text_of_eq_28_sends_the_rover_into_an_obstacle_and_algorithm_2_says_the_opposite():
    obstacle = np.hypot(ROW - 8, COLUMN - 30) < 3
    by_text = eq_28(CONE, 0 * CONE, obs_of_the_text(obstacle), (1.0, 0.5))
    by_algorithm = eq_28(CONE, 0 * CONE, obs_of_algorithm_2(obstacle), (1.0, 0.5))
    assert obstacle[best(by_text)] and by_text.max() > LARGE
    assert best(by_algorithm) == best(CONE) == (25, 12)


def test_vis_rates_places_that_show_nothing_new_above_all_that_do():
    z, unknown_from, fan = np.zeros((60, 60), np.float32), 40, Fan(1.5, 0.1, 90)  # flat, as far as anyone knows
    z[:, 26:40] = np.random.default_rng(0).uniform(0.0, 0.1, (60, 14))
    corrected = MendedVisibility(ray_advances=True, flat_is_seen=True, mast_m=0.7, plan_steps=True)
    vis = np.array([[algorithm_1(z, (j, i), fan, corrected).vis for i in range(0, 40, 3)] for j in range(0, 60, 6)])
    shows_new = np.arange(0, 40, 3) + 15 >= unknown_from
    score = eq_28(vis, 0 * vis, 0 * vis, (1.0, 0.5))
    assert score[:, shows_new].max() < score[:, ~shows_new].max() == 1.0


def test_a_climb_as_printed_walks_to_and_fro_over_the_peak_and_never_ends():
    found = algorithm_2(CONE, FREE, np.array([[35, 30]]), step_limit=10_000)
    assert found.endless and found.node is None
    last = {tuple(node) for node in found.climbs[0][-100:].tolist()}
    assert (25, 12) in last and len(last) == 2
    ended = algorithm_2(CONE, FREE, np.array([[35, 30]]), Mended(compares_with_current=True))
    assert not ended.endless and len(ended.climbs[0]) < 30


def test_a_climb_as_printed_ends_at_once_where_the_neighbour_looked_at_last_is_the_best():
    rising = 0.01 * (ROW + COLUMN)
    assert algorithm_2(rising, FREE, np.array([[5, 5]])).node == (6, 6)
    assert algorithm_2(rising, FREE, np.array([[5, 5]]), ALL).node == (39, 39)


def test_of_200_climbs_as_printed_121_never_end_and_2_end_on_a_maximum_by_luck(hills):
    starts = np.random.default_rng(3).integers(0, 40, (200, 1, 2))
    found = [algorithm_2(hills, FREE, start) for start in starts]
    endless = sum(f.endless for f in found)
    on_top = sum(not f.endless and bool(maxima(hills)[f.node]) for f in found)
    assert (endless, on_top) == (121, 2)
    assert all(maxima(hills)[algorithm_2(hills, FREE, start, ALL).node] for start in starts)


def test_return_leaves_at_the_first_seed(hills):
    starts = np.random.default_rng(4).integers(0, 40, (5, 2))
    first = algorithm_2(hills, FREE, starts, Mended(compares_with_current=True, keeps_the_better=True))
    every = algorithm_2(hills, FREE, starts, ALL)
    assert len(first.climbs) == 1 and len(every.climbs) == 5
    assert hills[every.node] > hills[first.node]


def test_the_result_is_the_worse_neighbour_of_the_place_that_was_best(hills):
    starts = np.random.default_rng(4).integers(0, 40, (1, 2))
    worse = algorithm_2(hills, FREE, starts, Mended(compares_with_current=True))
    better = algorithm_2(hills, FREE, starts, ALL)
    assert tuple(worse.climbs[0][-1]) == better.node
    assert hills[worse.node] < hills[better.node]


def test_no_reachability_a_climb_leaves_chi_free_and_crosses_a_wall():
    free = FREE.copy()
    free[:, 20] = False
    score = eq_28(CONE, 0 * CONE, 0 * CONE, (1.0, 0.0))
    found = algorithm_2(score, free, np.array([[25, 35]]), ALL)
    assert any(not free[tuple(node)] for node in found.climbs[0])
    assert found.node == (25, 12)  # beyond the wall


def test_a_start_outside_chi_free_is_refused():
    with pytest.raises(ValueError, match=r"starts: expected nodes of chi_free, given \(1, 2\)"):
        algorithm_2(CONE, ~FREE, np.array([[1, 2]]))


def test_every_node_has_a_different_cost_is_false():
    goal = np.zeros((40, 40), bool)
    goal[20, 20] = True
    cost = cost_to_go(FREE, goal, 0.1)
    assert len(np.unique(np.round(cost, 6))) == 231  # of 1600: 8-fold symmetry about the goal
    lower = np.pad(cost, 1, constant_values=np.inf)
    around = np.min([lower[1 + b : 41 + b, 1 + a : 41 + a] for b, a in NEIGHBOURS], axis=0)
    assert (around < cost)[~goal].all()  # what the descent needs, and what is true
