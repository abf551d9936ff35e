"""The kernels of the global planner against their slow twins, and what they answer to bad maps."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.config import Planning
from onboard.kernel_calls import global_field as door
from onboard.kernel_calls.progress import CancelledError, Progress
from onboard.native import variant
from onboard.planning import global_path
from onboard.records import Gdem, Grid
from tests.oracles import global_field as oracle

PLANNING = Planning()
LAW = settings(max_examples=20, deadline=None, derandomize=True)
SHAPES = st.tuples(st.integers(1, 23), st.integers(1, 23))


def rough_map(seed: int, shape: tuple[int, int], holes: float = 0.15, cell_m: float = 10.0) -> Gdem:
    """Heights about 1,500 m up, some of them missing; some edges are too steep."""
    rng = np.random.default_rng(seed)
    heights = (1500.0 + rng.normal(0, 0.25 * cell_m, shape)).astype(np.float32)
    heights[rng.random(shape) < holes] = np.nan
    return Gdem(Grid(cell_m / 2, cell_m / 2, cell_m, *shape), heights)


def by_heap(gdem: Gdem, goal_m: tuple[float, float], planning: Planning) -> np.ndarray:
    """The field on the same edges, from the nodes that the goal is joined to."""
    nodes, ways_m = global_path._joined(gdem, goal_m)
    seeds = {divmod(int(node), gdem.grid.columns): float(way) for node, way in zip(nodes, ways_m)}
    return oracle.cost_to_go(global_path.edge_costs(gdem, planning).astype(np.float64), seeds)


def test_a_goal_is_joined_to_its_eight_nearest_nodes() -> None:
    gdem = rough_map(1, (9, 9), holes=0.0)
    nodes, ways_m = global_path._joined(gdem, (41.0, 38.0))
    x, y = gdem.grid.centre(*np.divmod(np.arange(81), 9))
    away = np.hypot(x - 41.0, y - 38.0)
    assert set(nodes) == set(np.argsort(away)[:8])
    np.testing.assert_allclose(ways_m, away[nodes])


def solved(gdem: Gdem, node: tuple[int, int]) -> global_path.GlobalField:
    return global_path.solve(gdem, gdem.grid.centre(*node), PLANNING)


@LAW
@given(st.integers(0, 10_000), SHAPES)
def test_layers_equal_a_plane_fitted_at_each_node(seed: int, shape: tuple[int, int]) -> None:
    gdem = rough_map(seed, shape)
    rough, raw, slope_x, slope_y = oracle.layers(gdem.heights_m, gdem.grid.cell_m)
    fitted = global_path.layers(gdem)
    for got, want in zip((fitted.roughness_m, fitted.slope_x, fitted.slope_y), (rough, slope_x, slope_y)):
        np.testing.assert_allclose(got, want, rtol=1e-5, atol=2e-6)
    np.testing.assert_allclose(global_path.layers(gdem, True).roughness_m, raw, rtol=1e-5, atol=2e-6)


def test_the_raw_deviation_of_a_plane_is_its_slope_and_the_roughness_is_nothing() -> None:
    tangent = np.tan(np.deg2rad(15))
    plane = (np.arange(5) * 0.25 * tangent + np.zeros((4, 1))).astype(np.float32)
    gdem = Gdem(Grid(0.125, 0.125, 0.25, *plane.shape), plane)
    assert global_path.layers(gdem).roughness_m.max() < 1e-6
    raw = global_path.layers(gdem, raw_roughness=True).roughness_m
    np.testing.assert_allclose(raw, 0.25 * tangent * np.sqrt(2 / 3), rtol=1e-5)  # 5.5 cm of columns 0.25 m apart


@LAW
@given(st.integers(0, 10_000), SHAPES)
def test_edges_equal_the_law_written_out_for_each(seed: int, shape: tuple[int, int]) -> None:
    gdem = rough_map(seed, shape)
    want = oracle.edge_costs(gdem.heights_m, 10.0, PLANNING, global_path.ROUGHNESS_FLOOR_M)
    np.testing.assert_allclose(global_path.edge_costs(gdem, PLANNING), want, rtol=2e-6)


def test_the_way_back_over_an_edge_costs_the_same_to_the_last_bit() -> None:
    costs = global_path.edge_costs(rough_map(3, (14, 11)), PLANNING)
    for k, (dj, di) in enumerate(global_path.NEIGHBOURS):
        for j, i in np.argwhere(np.isfinite(costs[k])):
            assert costs[(k + 4) % 8, j + dj, i + di] == costs[k, j, i]


@pytest.mark.parametrize(("degrees", "passable"), [(19.9, True), (20.1, False)])
def test_steeper_than_the_limit_is_impassable_along_and_across(degrees: float, passable: bool) -> None:
    slope = (np.arange(7) * 10.0 * np.tan(np.deg2rad(degrees)) + np.zeros((7, 1))).astype(np.float32)
    costs = global_path.edge_costs(Gdem(Grid(5.0, 5.0, 10.0, 7, 7), slope), PLANNING)
    assert np.isfinite(costs[::2, 3, 3]).all() == passable  # up, along and down the hill
    assert np.isfinite(costs[1::2, 3, 3]).all()  # aslant both tilts are smaller


@LAW
@given(st.integers(0, 10_000), SHAPES)
def test_the_field_equals_a_heap_dijkstra_on_the_same_edges(seed: int, shape: tuple[int, int]) -> None:
    gdem = rough_map(seed, shape)
    goal_m = tuple(np.random.default_rng(seed).uniform(0, 10.0 * np.array(shape[::-1])))
    got = global_path.solve(gdem, goal_m, PLANNING).cost_m
    np.testing.assert_allclose(got, by_heap(gdem, goal_m, PLANNING), rtol=1e-6)


@LAW
@given(st.integers(0, 10_000), SHAPES, st.sampled_from([0.01, 0.1, 100.0]))
def test_edges_as_dear_as_thousands_of_buckets_change_nothing(
    seed: int, shape: tuple[int, int], weight_length: float
) -> None:
    gdem = rough_map(seed, shape)
    dear = Planning(weight_roughness=100.0, weight_roll=100.0, weight_length=weight_length)
    goal_m = gdem.grid.centre(shape[0] // 2, shape[1] // 2)
    np.testing.assert_allclose(global_path.solve(gdem, goal_m, dear).cost_m, by_heap(gdem, goal_m, dear), rtol=1e-6)


def test_a_way_that_winds_through_the_whole_map_is_exact() -> None:
    heights = np.zeros((61, 60), np.float32)
    heights[1::4, 1:] = heights[3::4, :-1] = np.nan  # walls with a gap at alternating ends
    gdem = Gdem(Grid(5.0, 5.0, 10.0, 61, 60), heights)
    got = global_path.solve(gdem, (5.0, 5.0), PLANNING).cost_m
    want = by_heap(gdem, (5.0, 5.0), PLANNING)
    assert want[60, 59] > 16_000.0
    np.testing.assert_allclose(got, want, rtol=1e-6)


@LAW
@given(st.integers(0, 10_000), SHAPES)
def test_every_reachable_node_has_a_strictly_lower_next_one_on_the_way_to_the_goal(
    seed: int, shape: tuple[int, int]
) -> None:
    gdem = rough_map(seed, shape)
    field = solved(gdem, (shape[0] // 2, shape[1] // 2))
    costs, following = field.cost_m.ravel(), field.next_node.ravel()
    nodes = np.arange(costs.size)
    assert np.array_equal(following == -1, np.isinf(costs))
    moves = (following != -1) & (following != nodes)
    assert (costs[following[moves]] < costs[moves]).all()
    steps = np.abs(np.array(np.divmod(following[moves], shape[1])) - np.divmod(nodes[moves], shape[1]))
    assert steps.max(initial=0) <= 1
    edges = global_path.edge_costs(gdem, PLANNING)
    for node in nodes[moves]:
        (j, i), (b, a) = divmod(node, shape[1]), divmod(following[node], shape[1])
        price = edges[global_path.NEIGHBOURS.index((b - j, a - i)), j, i]
        assert costs[node] == pytest.approx(costs[following[node]] + price, rel=1e-6)


@pytest.mark.parametrize("name", variant.available())
@pytest.mark.parametrize("shape", [(1, 1), (3, 300), (61, 67), (128, 129)])
def test_every_variant_gives_the_bits_of_the_baseline(
    name: str, shape: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    gdem, made = rough_map(7, shape), []
    for build in ("baseline", name):
        monkeypatch.setattr(door, "kernels", variant.load(build))
        ground = global_path.layers(gdem)
        field = solved(gdem, (shape[0] // 2, shape[1] // 2))
        edges = global_path.edge_costs(gdem, PLANNING)
        made.append([a.tobytes() for a in (ground.roughness_m, ground.slope_x, edges, field.cost_m, field.next_node)])
    assert made[0] == made[1]


def test_a_workspace_used_again_gives_the_same_bits() -> None:
    first, second = rough_map(1, (40, 30)), rough_map(2, (40, 30), holes=0.0)
    work = door.workspace(40, 30)
    wanted = global_path.solve(first, (155.0, 205.0), PLANNING)
    for gdem in (first, second, first):
        got = global_path.solve(gdem, (155.0, 205.0), PLANNING, work)
    np.testing.assert_array_equal(got.cost_m, wanted.cost_m)
    np.testing.assert_array_equal(got.next_node, wanted.next_node)


# -- bad maps --------------------------------------------------------------------------------------------------


def test_an_empty_map_is_refused() -> None:
    for shape in ((0, 5), (5, 0)):
        empty = Gdem(Grid(5.0, 5.0, 10.0, *shape), np.zeros(shape, np.float32))
        with pytest.raises(ValueError, match=f"map: expected 1 to .* nodes, given {shape[0]} x {shape[1]}"):
            global_path.solve(empty, (5.0, 5.0), PLANNING)


@pytest.mark.parametrize("nothing", [np.nan, np.inf, -np.inf, 3e38])
def test_without_any_data_no_node_is_reached_and_the_path_is_empty(nothing: float) -> None:
    gdem = Gdem(Grid(5.0, 5.0, 10.0, 6, 7), np.full((6, 7), nothing, np.float32))
    field = solved(gdem, (3, 3))
    assert np.isinf(field.cost_m).all()
    assert len(global_path.path(field, (5.0, 5.0))) == 0


@pytest.mark.parametrize("value", [np.inf, -np.inf, -3.4e38])
def test_a_height_that_is_none_counts_as_a_node_without_data(value: float) -> None:
    gdem = rough_map(5, (20, 20), holes=0.0)
    broken, missing = gdem.heights_m.copy(), gdem.heights_m.copy()
    broken[4:7, 11], missing[4:7, 11] = value, np.nan
    for heights in (broken, missing):
        heights[15, 2] = np.nan
    got, want = (solved(replace(gdem, heights_m=heights), (10, 10)) for heights in (broken, missing))
    np.testing.assert_array_equal(got.cost_m, want.cost_m)


def test_a_goal_off_the_map_or_amid_missing_data_is_reached_from_nowhere() -> None:
    gdem = rough_map(6, (12, 12), holes=0.0)
    for goal in ((500.0, 55.0), (-20.0, -20.0), (1e12, 0.0)):
        field = global_path.solve(gdem, goal, PLANNING)
        assert np.isinf(field.cost_m).all() and (field.next_node == -1).all()
        assert len(global_path.path(field, (35.0, 35.0))) == 0
    heights = gdem.heights_m.copy()
    heights[3:9, 3:9] = np.nan
    field = solved(replace(gdem, heights_m=heights), (6, 6))
    assert len(global_path.path(field, (5.0, 5.0))) == 0


def test_a_start_amid_missing_data_has_no_path() -> None:
    gdem = Gdem(Grid(5.0, 5.0, 10.0, 12, 12), np.zeros((12, 12), np.float32))
    gdem.heights_m[3:9, 3:9] = np.nan
    field = solved(gdem, (0, 0))
    assert len(global_path.path(field, (60.0, 60.0))) == 0
    assert len(global_path.path(field, (105.0, 105.0))) > 2


@pytest.mark.parametrize(
    ("heights", "words"),
    [
        (np.zeros((6, 7)), r"heights_m: expected float32 \(6, 7\), given float64 \(6, 7\)"),
        (np.zeros((7, 6), np.float32), r"heights_m: expected float32 \(6, 7\), given float32 \(7, 6\)"),
        (np.zeros((7, 6), np.float32).T, "heights_m: expected contiguous rows"),
        ([[0.0]], "heights_m: expected an array"),
    ],
)
def test_wrong_heights_are_named(heights: np.ndarray, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        global_path.solve(Gdem(Grid(5.0, 5.0, 10.0, 6, 7), heights), (5.0, 5.0), PLANNING)


def test_wrong_numbers_are_named() -> None:
    gdem, work = rough_map(1, (5, 6)), door.workspace(5, 6)
    with pytest.raises(ValueError, match="goal_m: expected finite"):
        global_path.solve(gdem, (np.nan, 5.0), PLANNING)
    with pytest.raises(ValueError, match=r"heights_m: expected float32 \(6, 5\)"):
        global_path.solve(gdem, (5.0, 5.0), PLANNING, door.workspace(6, 5))
    with pytest.raises(ValueError, match=r"cell_m: expected .* m, given 0"):
        door.make_layers(gdem.heights_m, 0.0, False, work)
    with pytest.raises(ValueError, match="prices: expected 5 finite numbers"):
        door.make_edges(gdem.heights_m, 10.0, door.Prices(1.0, 0.05, -1.0, 1.0, 0.3), work)
    global_path.make_edges(gdem, PLANNING, work)
    with pytest.raises(ValueError, match="seeds: expected at most 30 of 0 to 29, given 30 to 30"):
        door.cost_to_go((np.array([30]), np.zeros(1)), work)
    with pytest.raises(ValueError, match="seed costs: expected finite costs >= 0, given nan"):
        door.cost_to_go((np.array([3]), np.array([np.nan])), work)
    with pytest.raises(ValueError, match=r"progress.stop: expected uint8 \(1\), given bool"):
        replace(work, progress=Progress(stop=np.zeros(1, bool)))


def test_without_edges_there_is_no_search() -> None:
    gdem, work = rough_map(1, (5, 6)), door.workspace(5, 6)
    seeds = np.array([3]), np.zeros(1)
    with pytest.raises(ValueError, match="work: expected edges made by make_edges, given none"):
        door.cost_to_go(seeds, work)
    global_path.make_edges(gdem, PLANNING, work)
    assert np.isfinite(door.cost_to_go(seeds, work)[0].flat[3])
    door.make_layers(gdem.heights_m, 10.0, False, work)  # in the room of the edges
    with pytest.raises(ValueError, match="given none"):
        door.cost_to_go(seeds, work)


# -- progress and cancelling -----------------------------------------------------------------------------------


def test_progress_ends_at_three_times_the_nodes_reached_or_not() -> None:
    gdem, work = rough_map(4, (31, 47), holes=0.4), door.workspace(31, 47)
    for _ in range(2):
        global_path.solve(gdem, (155.0, 155.0), PLANNING, work)
        assert work.progress.done[0] == door.STEPS * 31 * 47


def test_a_cancelled_plan_has_no_result_at_any_step() -> None:
    gdem, work = rough_map(4, (30, 30)), door.workspace(30, 30)
    global_path.make_edges(gdem, PLANNING, work)
    work.progress.cancel()
    steps = (
        lambda: door.cost_to_go((np.array([3]), np.zeros(1)), work),
        lambda: door.make_layers(gdem.heights_m, 10.0, False, work),
        lambda: door.make_edges(gdem.heights_m, 10.0, door.Prices(1.0, 0.05, 1.0, 1.0, 0.3), work),
        lambda: global_path.solve(gdem, (155.0, 155.0), PLANNING, work),
    )
    for step in steps:
        with pytest.raises(CancelledError):
            step()
    work.progress.stop[0] = 0
    assert np.isfinite(global_path.solve(gdem, (155.0, 155.0), PLANNING, work).cost_m).any()


def test_a_plan_is_watched_and_cancelled_from_another_thread_while_it_runs() -> None:
    gdem, work = rough_map(4, (1500, 1500), holes=0.0), door.workspace(1500, 1500)
    ended = []

    def plan() -> None:
        try:
            global_path.solve(gdem, (7505.0, 7505.0), PLANNING, work)
        except CancelledError as error:
            ended.append(str(error))

    planner = threading.Thread(target=plan)
    work.progress.done[0] = 0
    planner.start()
    while work.progress.done[0] == 0 and planner.is_alive():
        pass
    work.progress.cancel()
    planner.join()
    assert ended and 0 < work.progress.done[0] < door.STEPS * 1500 * 1500
