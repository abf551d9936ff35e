"""Cost-to-go over poses against scipy's Dijkstra on the same edges, and the descent along it."""

from __future__ import annotations

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csgraph

from onboard import config
from onboard.planning.local import pose_field
from tests.oracles import cells as oracles

PLANNING = config.Planning()
CELL_M = 0.1
LAW = settings(max_examples=12, deadline=None, derandomize=True)


def field(seed: int, shape: tuple[int, int] = (7, 9)) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Random freedom, three seeds, random closeness."""
    rng = np.random.default_rng(seed)
    freedom = rng.choice(np.array([0, 1, 2], np.uint8), (8, *shape), p=(0.3, 0.2, 0.5))
    seeds = np.stack([rng.integers(0, shape[0], 3), rng.integers(0, shape[1], 3), rng.integers(0, 8, 3)], axis=1)
    return freedom, seeds, rng.uniform(0, 2, (8, *shape)).astype(np.float32)


def by_scipy(
    freedom: np.ndarray, seeds: np.ndarray, least: int, turn_m: float, closeness: np.ndarray | None
) -> np.ndarray:
    passable = freedom >= least
    graph = oracles.pose_graph(passable, CELL_M, turn_m, closeness)
    starts = [np.ravel_multi_index((o, j, i), freedom.shape) for j, i, o in seeds if passable[o, j, i]]
    if not starts:
        return np.full(freedom.shape, np.inf)
    cost = csgraph.dijkstra(graph, indices=starts, min_only=True).reshape(freedom.shape)
    return np.where(passable, cost, np.inf)


@LAW
@given(st.integers(0, 10_000), st.booleans(), st.booleans(), st.sampled_from([0.08, 0.02, 0.7]))
def test_cost_to_go_equals_dijkstra_on_the_same_edges(seed: int, optimistic: bool, soft: bool, turn_m: float) -> None:
    freedom, seeds, closeness = field(seed)
    planning = dataclasses.replace(PLANNING, turn_cost_m=turn_m)
    got = pose_field.cost_to_go(freedom, seeds, planning, CELL_M, optimistic, closeness if soft else None)
    want = by_scipy(freedom, seeds, 1 if optimistic else 2, turn_m, closeness if soft else None)
    np.testing.assert_allclose(got, want, rtol=1e-5)


@LAW
@given(st.integers(0, 10_000), st.booleans())
def test_descent_follows_edges_and_pays_exactly_the_cost(seed: int, soft: bool) -> None:
    freedom, seeds, closeness = field(seed)
    ratio = closeness if soft else None
    cost = pose_field.cost_to_go(freedom, seeds, PLANNING, CELL_M, True, ratio)
    if not np.isfinite(cost).any():
        return
    o, j, i = np.unravel_index(np.where(np.isfinite(cost), cost, -1).argmax(), cost.shape)
    way = pose_field.descend(cost, (j, i, o), PLANNING, CELL_M, ratio)
    graph = oracles.pose_graph(freedom >= 1, CELL_M, PLANNING.turn_cost_m, ratio)
    flat = [np.ravel_multi_index((o, j, i), freedom.shape) for j, i, o in way]
    prices = [graph[a, b] for a, b in pairwise(flat)]
    assert all(price > 0 for price in prices)
    assert sum(prices) == pytest.approx(float(cost[o, j, i]), rel=1e-4, abs=1e-6)
    assert tuple(way[0]) == (j, i, o) and way[-1].tolist() in seeds.tolist()


def test_straight_costs_its_length_crab_up_to_1_44_times_and_a_quarter_turn_four_steps() -> None:
    freedom = np.full((8, 11, 11), 2, np.uint8)
    cost = pose_field.cost_to_go(freedom, np.array([[5, 5, 0]]), PLANNING, CELL_M, False)
    assert cost[0, 5, 10] == pytest.approx(0.5)
    assert cost[0, 6, 5] == pytest.approx(0.144)
    assert cost[0, 6, 6] == pytest.approx(0.1 * 2**0.5 * 1.2)
    assert cost[4, 5, 5] == pytest.approx(4 * 0.08)
    assert cost[7, 5, 5] == pytest.approx(0.08)  # orientation wraps: 157.5 degrees is next to 0


def test_optimistic_passes_unknown_poses_at_the_same_price_free_only_does_not() -> None:
    freedom = np.full((8, 3, 9), 2, np.uint8)
    freedom[:, :, 4] = 1
    seeds = np.array([[1, 8, 0]])
    assert pose_field.cost_to_go(freedom, seeds, PLANNING, CELL_M, True)[0, 1, 0] == pytest.approx(0.8)
    assert pose_field.cost_to_go(freedom, seeds, PLANNING, CELL_M, False)[0, 1, 0] == np.inf


def test_a_seed_of_orientation_minus_one_stands_for_all_eight() -> None:
    freedom = np.full((8, 3, 3), 2, np.uint8)
    cost = pose_field.cost_to_go(freedom, np.array([[1, 1, -1]]), PLANNING, CELL_M, False)
    assert (cost[:, 1, 1] == 0).all()


@LAW
@given(st.integers(0, 10_000), st.floats(-3, 30))
def test_a_seed_counts_with_what_is_left_to_go_from_it(seed: int, least_m: float) -> None:
    freedom, seeds, _ = field(seed, (12, 14))
    left_m = np.array([0.0, 0.4, 25.0]) + least_m
    cost = pose_field.cost_to_go(freedom, seeds, PLANNING, CELL_M, True, seed_costs_m=left_m)
    alone = [pose_field.cost_to_go(freedom, row[None], PLANNING, CELL_M, True) + m for row, m in zip(seeds, left_m)]
    np.testing.assert_allclose(cost, np.min(alone, axis=0), rtol=1e-4, atol=1e-5)
    for o, j, i in np.argwhere(np.isfinite(cost))[::40]:
        end = pose_field.descend(cost, (j, i, o), PLANNING, CELL_M)[-1].tolist()
        assert end in seeds.tolist()


@pytest.mark.parametrize("soft", [False, True])
def test_prices_hold_to_a_millionth_on_ways_of_hundreds_of_edges_to_seeds_far_apart_in_cost(soft: bool) -> None:
    """The kernel counts in units of 2^-21 of a turn, 512 turns at a time: 2.6 m here."""
    planning, freedom = dataclasses.replace(PLANNING, turn_cost_m=0.005), np.full((8, 25, 21), 2, np.uint8)
    for wall, j in enumerate(range(1, 25, 2)):
        freedom[:, j] = 0
        freedom[:, j, 0 if wall % 2 else -1] = 2
    freedom[:, 21] = 0  # two rows at the end by themselves
    rng = np.random.default_rng(2)
    ratio = rng.uniform(0, 2, freedom.shape).astype(np.float32) if soft else None
    seeds, left_m = np.array([[0, 0, 0], [0, 20, 1], [24, 20, 5]]), np.array([0.0, 0.7, 400.0])
    cost = pose_field.cost_to_go(freedom, seeds, planning, CELL_M, False, ratio, left_m)
    alone = [by_scipy(freedom, row[None], 2, 0.005, ratio) + m for row, m in zip(seeds, left_m)]
    want = np.min(alone, axis=0)
    assert want[np.isfinite(want)].max() > 402 and want[:, 20].min() > 18
    np.testing.assert_allclose(cost, want, rtol=1e-6)


def test_no_way_and_seeds_off_the_grid_are_refused() -> None:
    freedom = np.full((8, 3, 3), 2, np.uint8)
    freedom[:, :, 1] = 0
    cost = pose_field.cost_to_go(freedom, np.array([[1, 1, 0], [1, 2, 0]]), PLANNING, CELL_M, True)
    assert np.isinf(cost[:, :, :2]).all() and np.isfinite(cost[:, :, 2]).all()
    with pytest.raises(ValueError, match="no way leads from pose"):
        pose_field.descend(cost, (1, 0, 0), PLANNING, CELL_M)
    with pytest.raises(ValueError, match=r"seeds: expected \(j, i, o\) in 3 rows"):
        pose_field.cost_to_go(freedom, np.array([[1, 3, 0]]), PLANNING, CELL_M, True)


def test_turns_without_a_price_still_end() -> None:
    planning = dataclasses.replace(PLANNING, turn_cost_m=0.0)
    freedom = np.full((8, 9, 9), 2, np.uint8)
    cost = pose_field.cost_to_go(freedom, np.array([[0, 0, 3]]), planning, CELL_M, False)
    assert pose_field.descend(cost, (8, 8, 7), planning, CELL_M)[-1].tolist() == [0, 0, 3]


def test_two_runs_give_the_same_bits() -> None:
    freedom, seeds, closeness = field(7, (40, 40))
    runs = [pose_field.cost_to_go(freedom, seeds, PLANNING, CELL_M, True, closeness) for _ in range(2)]
    assert runs[0].tobytes() == runs[1].tobytes()
