"""The kernels of the searches against their slow twins, in every build that this machine runs."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.kernel_calls import distance, pose_field, sight
from onboard.kernel_calls.progress import CancelledError, Progress
from onboard.native import variant
from onboard.planning.local.pose_field import moves_m
from onboard.records import Grid
from tests.oracles import search as oracles

LAW = settings(max_examples=40, deadline=None, derandomize=True)
CELL_M = 0.1


def ground(seed: int, share: float = 0.7) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Free cells, goals (some of them not free), closeness; sizes from 1 x 1 on."""
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(1, 26, 2))
    return rng.random(shape) < share, rng.random(shape) < 0.02, rng.uniform(0, 30, shape).astype(np.float32)


def serpentine(side: int) -> np.ndarray:
    free = np.ones((side, side), bool)
    for wall, j in enumerate(range(1, side, 2)):
        free[j] = False
        free[j, 0 if wall % 2 else -1] = True
    return free


def corner(free: np.ndarray) -> np.ndarray:
    goals = np.zeros_like(free)
    goals[0, 0] = True
    return goals


@LAW
@given(st.integers(0, 10_000), st.booleans(), st.sampled_from([0.4, 0.7, 0.95]))
def test_the_field_equals_a_heap_on_random_ground(seed: int, soft: bool, share: float) -> None:
    free, goals, closeness = ground(seed, share)
    ratio = closeness if soft else None
    want = oracles.distance(free, goals, CELL_M, ratio)
    np.testing.assert_allclose(distance.cost_to_go(free, goals, CELL_M, ratio), want, rtol=1e-6)


def test_the_field_is_exact_to_the_end_of_a_serpentine_of_two_million_cells() -> None:
    """Round the end of a wall it is two diagonal steps; between two such ends side - 3 straight ones."""
    side = 2000
    free = serpentine(side)
    turns = side // 2 - 1
    want = 2 * (side - 2) + (turns - 1) * (side - 3) + turns * 2 * math.sqrt(2.0)
    assert distance.cost_to_go(free, corner(free), 1.0)[side - 2, 0] == pytest.approx(want, rel=1e-9)


@LAW
@given(st.integers(0, 10_000), st.booleans())
def test_every_reachable_cell_has_a_strictly_lower_neighbour_or_is_a_goal(seed: int, soft: bool) -> None:
    free, goals, closeness = ground(seed)
    cost = distance.cost_to_go(free, goals, CELL_M, closeness if soft else None)
    assert np.isinf(cost[~free]).all()
    for j, i in np.argwhere(np.isfinite(cost)):
        if not goals[j, i]:
            assert min(cost[at] for at in oracles.steps(free, j, i)) < cost[j, i]
        else:
            assert cost[j, i] == 0.0


@pytest.mark.parametrize("turned", range(4))
def test_no_step_leads_between_two_obstacles(turned: int) -> None:
    free = np.rot90(np.array([[1, 0, 0], [0, 1, 1], [0, 1, 1]], bool), turned).copy()
    goals = np.rot90(corner(np.ones((3, 3), bool)), turned).copy()
    assert np.isfinite(distance.cost_to_go(free, goals, 1.0)).sum() == 1
    free |= np.rot90(np.array([[0, 1, 0], [0, 0, 0], [0, 0, 0]], bool), turned)
    assert np.rot90(distance.cost_to_go(free, goals, 1.0), -turned)[1, 1] == pytest.approx(math.sqrt(2.0), rel=1e-12)


@pytest.mark.parametrize("shape", [(0, 0), (0, 5), (5, 0), (1, 1), (4, 7)])
def test_without_a_free_cell_or_any_cell_there_is_no_way(shape: tuple[int, int]) -> None:
    cost = distance.cost_to_go(np.zeros(shape, bool), np.ones(shape, bool), CELL_M)
    assert cost.shape == shape and np.isinf(cost).all()


def test_closeness_of_obstacles_is_not_read() -> None:
    free, closeness = np.array([[True, True, False]]), np.array([[0.0, 1.0, np.nan]], np.float32)
    np.testing.assert_allclose(distance.cost_to_go(free, corner(free), 0.1, closeness), [[0.0, 0.15, np.inf]])


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"free": np.ones((4, 4), np.uint8)}, r"free: expected bool \(any, any\), given uint8 \(4, 4\)"),
        ({"free": np.ones((4, 8), bool)[:, ::2]}, "free: expected contiguous"),
        ({"free": np.ones((4, 4), bool, order="F")[:, :3]}, "free: expected contiguous"),
        ({"free": np.ones((1, 30_001), bool)}, "free: expected at most 30000 rows and columns"),
        ({"goals": np.ones((4, 5), bool)}, r"goals: expected bool \(4, 4\), given bool \(4, 5\)"),
        ({"cell_m": 0.0}, "cell_m: expected a finite length above 0, given 0"),
        ({"cell_m": math.nan}, "cell_m: expected a finite length above 0, given nan"),
        ({"closeness": np.zeros((4, 4))}, "closeness: expected float32"),
        ({"closeness": np.full((4, 4), np.nan, np.float32)}, "closeness: expected ratios of 0 to 100000"),
        ({"closeness": np.full((4, 4), np.inf, np.float32)}, "closeness: expected ratios of 0 to 100000"),
        ({"closeness": np.full((4, 4), -0.1, np.float32)}, "closeness: expected ratios of 0 to 100000"),
        ({"progress": Progress(done=np.zeros(2, np.int64))}, r"progress.done: expected int64 \(1\)"),
        ({"progress": Progress(stop=np.zeros(1, bool))}, r"progress.stop: expected uint8 \(1\)"),
    ],
)
def test_the_door_of_the_distance_transform_names_what_is_wrong(changed: dict, words: str) -> None:
    good = {"free": np.ones((4, 4), bool), "goals": np.eye(4, dtype=bool), "cell_m": 0.1}
    distance.cost_to_go(**good)
    with pytest.raises(ValueError, match=words):
        distance.cost_to_go(**{**good, **changed})


def test_a_flag_stops_the_search_and_a_counter_ends_at_all_cells() -> None:
    free = np.ones((12, 17), bool)
    free[:, 5] = False
    seen = Progress()
    distance.cost_to_go(free, corner(free), CELL_M, progress=seen)
    assert seen.done[0] == free.size
    seen.cancel()
    with pytest.raises(CancelledError, match=f"after 0 of {free.size} cells"):
        distance.cost_to_go(free, corner(free), CELL_M, progress=seen)


@LAW
@given(st.integers(0, 10_000), st.booleans(), st.booleans())
def test_a_straight_drive_costs_what_its_stations_say(seed: int, soft: bool, one_piece: bool) -> None:
    rng = np.random.default_rng(seed)
    grid = Grid(-1.95, 0.25, CELL_M, *(int(n) for n in rng.integers(1, 40, 2)))
    shape = (8, grid.rows, grid.columns)
    free, near = rng.random(shape) < 0.97, rng.uniform(0, 5, shape).astype(np.float32)
    ends = rng.uniform([-2.1, 0.1], [2.1, 4.3], (30, 2, 2))
    ends[::3] = np.round(ends[::3] / 0.05) * 0.05  # on borders and centres of cells
    for a, b in ends:
        line = (tuple(a), tuple(a if rng.random() < 0.1 else b), int(rng.integers(8)))
        asked = (free, near if soft else None, grid, line, math.inf if one_piece else 0.05)
        assert sight.price_m(*asked) == pytest.approx(oracles.sight_price(*asked), rel=1e-12, abs=1e-15)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"free": np.ones((8, 4, 5), bool)}, r"free: expected bool \(any, 4, 4\)"),
        ({"closeness": np.zeros((8, 4, 4))}, "closeness: expected float32"),
        ({"line": ((0.0, math.nan), (1.0, 1.0), 0)}, "line: expected finite ends"),
        ({"line": ((0.0, 0.0), (1.0, 1.0), 8)}, "orientation: expected 0 to 7, given 8"),
        ({"spacing_m": 0.0}, "spacings above 0"),
    ],
)
def test_the_door_of_the_line_of_sight_names_what_is_wrong(changed: dict, words: str) -> None:
    good = {
        "free": np.ones((8, 4, 4), bool),
        "closeness": None,
        "grid": Grid(0.0, 0.0, CELL_M, 4, 4),
        "line": ((0.0, 0.0), (0.3, 0.2), 0),
        "spacing_m": 0.05,
    }
    assert sight.price_m(**good) == pytest.approx(math.hypot(0.3, 0.2))
    with pytest.raises(ValueError, match=words):
        sight.price_m(**{**good, **changed})


@pytest.mark.parametrize("name", variant.VARIANTS)
@pytest.mark.parametrize("soft", [False, True])
def test_every_build_gives_the_same_bits(name: str, soft: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    if name not in variant.available():
        pytest.skip(f"{name}: not built, or not for this machine")
    rng = np.random.default_rng(11)
    free, goals = rng.random((83, 91)) < 0.8, rng.random((83, 91)) < 0.001
    freedom = rng.integers(0, 3, (8, 41, 37)).astype(np.uint8)
    near = rng.uniform(0, 9, freedom.shape).astype(np.float32)
    seeds = (rng.integers(0, freedom.size, 9), rng.uniform(0, 2, 9).astype(np.float32))
    grid = Grid(0.0, 0.0, CELL_M, 41, 37)
    lines = [(tuple(a), tuple(b), 3) for a, b in rng.uniform(0, 3.6, (50, 2, 2))]

    def results() -> list[bytes]:
        ratio = rng_closeness if soft else None
        field = distance.cost_to_go(free, goals, CELL_M, ratio)
        poses = pose_field.cost_to_go(freedom, 1, seeds, moves_m(CELL_M), 0.08, near if soft else None)
        prices = [sight.price_m(freedom > 0, near if soft else None, grid, line, 0.05) for line in lines]
        assert np.isfinite(field).sum() > 1000 and np.isfinite(poses).sum() > 1000
        return [field.tobytes(), poses.tobytes(), np.array(prices).tobytes()]

    rng_closeness = rng.uniform(0, 9, free.shape).astype(np.float32)
    for door in (distance, pose_field, sight):
        monkeypatch.setattr(door, "kernels", variant.load("baseline"))
    want = results()
    for door in (distance, pose_field, sight):
        monkeypatch.setattr(door, "kernels", variant.load(name))
    assert results() == want


@pytest.mark.parametrize("name", variant.available())
def test_any_byte_but_zero_is_true(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(distance, "kernels", variant.load(name))
    odd = np.full((5, 7), 255, np.uint8).view(np.bool_)
    goals = np.zeros((5, 7), np.uint8)
    goals[2, 3] = 2
    want = distance.cost_to_go(np.ones((5, 7), bool), goals.astype(bool), CELL_M)
    assert np.array_equal(distance.cost_to_go(odd, goals.view(np.bool_), CELL_M), want)
