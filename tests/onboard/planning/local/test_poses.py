"""Which poses are free, blocked or unknown, what is connected, and the node sets."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard import config
from onboard.planning.local import pose_field, poses
from onboard.planning.local.poses import Freedom
from onboard.records import CellClass, Grid, NodeSet, Surface
from tests.oracles import cells as oracles

ROVER, PLANNING = config.Rover(), config.Planning()
LAW = settings(max_examples=8, deadline=None, derandomize=True)
SIZE, MIDDLE = 31, 15


def ground(z: np.ndarray) -> Surface:
    """All cells hit, exact heights."""
    heights = z.astype(np.float32)
    kinds = np.full(z.shape, CellClass.HIT, np.uint8)
    grid = Grid(0.05, 0.05, 0.1, *z.shape)
    return Surface(grid, kinds, heights, heights, heights, np.full(z.shape, np.inf, np.float32))


def unseen(surface: Surface, where: tuple, z_ray: float = math.inf) -> Surface:
    """The same with some cells unknown, crossed by a beam at z_ray."""
    kinds, rays = surface.cell_class.copy(), surface.z_ray.copy()
    kinds[where] = CellClass.OUTSIDE if math.isinf(z_ray) else CellClass.OCCLUDED
    rays[where] = z_ray
    layers = []
    for layer in (surface.z_mean, surface.z_top, surface.z_bot):
        layers.append(layer.copy())
        layers[-1][where] = np.nan
    return Surface(surface.grid, kinds, *layers, rays)


def freedom_of(surface: Surface) -> np.ndarray:
    return poses.pose_freedom(surface, ROVER, PLANNING)


def test_flat_known_ground_is_free_but_for_the_border_where_the_rover_would_reach_out() -> None:
    freedom = freedom_of(ground(np.full((SIZE, SIZE), 3.0)))
    assert freedom.dtype == np.uint8 and freedom.shape == (8, SIZE, SIZE)
    assert (freedom[:, 6:-6, 6:-6] == Freedom.FREE).all()
    assert (freedom[:, :2] == Freedom.UNKNOWN).all() and not (freedom == Freedom.BLOCKED).any()


def test_a_rock_of_0_12_m_blocks_under_wheel_and_belly_not_beside() -> None:
    z = np.zeros((SIZE, SIZE))
    z[MIDDLE, MIDDLE] = 0.12
    freedom = freedom_of(ground(z))
    assert freedom[0, MIDDLE - 2, MIDDLE - 4] == Freedom.BLOCKED  # under the front left wheel
    assert freedom[0, MIDDLE, MIDDLE] == Freedom.BLOCKED  # under the belly: higher than 0.10
    assert freedom[0, MIDDLE - 4, MIDDLE] == Freedom.FREE  # 0.4 m beside
    assert freedom[4, MIDDLE, MIDDLE - 4] == Freedom.FREE


def test_a_rock_of_0_09_m_is_straddled_but_not_climbed() -> None:
    z = np.zeros((SIZE, SIZE))
    z[MIDDLE, MIDDLE] = 0.09
    freedom = freedom_of(ground(z))
    assert freedom[0, MIDDLE, MIDDLE] == Freedom.FREE
    assert freedom[0, MIDDLE - 2, MIDDLE - 4] == Freedom.BLOCKED


def test_a_tall_boulder_beside_does_not_block_though_it_bends_the_fitted_plane() -> None:
    z = np.zeros((SIZE, SIZE))
    z[MIDDLE + 4 : MIDDLE + 8, MIDDLE - 4 : MIDDLE + 5] = 1.0
    freedom = freedom_of(ground(z))
    assert freedom[0, MIDDLE, MIDDLE] == Freedom.FREE
    assert freedom[0, MIDDLE + 1, MIDDLE] == Freedom.BLOCKED  # the wheel's neighbour cell is the boulder


def test_seeing_more_of_a_wall_takes_no_free_pose_away() -> None:
    z = np.zeros((SIZE, SIZE))
    z[MIDDLE + 4 :] = 0.6
    face = unseen(ground(z), np.nonzero(np.arange(SIZE)[:, None] > np.full((SIZE, SIZE), MIDDLE + 4)), 0.5)
    before, after = (poses.pose_freedom(seen, ROVER, PLANNING, tyres=False) for seen in (face, ground(z)))
    assert (before[0, MIDDLE, 6:-6] == Freedom.FREE).all()
    assert (after[before == Freedom.FREE] == Freedom.FREE).all()


def test_a_roll_of_26_degrees_from_the_wheels_blocks() -> None:
    z = np.zeros((SIZE, SIZE))
    z[MIDDLE + 2 :] = 0.4 * math.tan(math.radians(26))
    rough = dataclasses.replace(PLANNING, step_m=1.0, slope_limit_rad=math.radians(50), under_belly_m=1.0)
    assert poses.pose_freedom(ground(z), ROVER, rough)[0, MIDDLE, MIDDLE] == Freedom.BLOCKED
    steady = dataclasses.replace(rough, tilt_limit_rad=math.radians(27))
    assert poses.pose_freedom(ground(z), ROVER, steady)[0, MIDDLE, MIDDLE] == Freedom.FREE


@pytest.mark.parametrize(("slope_deg", "expected"), [(19, Freedom.FREE), (21, Freedom.BLOCKED), (-21, Freedom.BLOCKED)])
def test_slopes_up_to_20_degrees_are_free(slope_deg: float, expected: Freedom) -> None:
    j, i = np.mgrid[:SIZE, :SIZE] * 0.1
    for direction in (0.0, 0.4, math.pi / 2):
        z = math.tan(math.radians(slope_deg)) * (i * math.cos(direction) + j * math.sin(direction))
        assert (freedom_of(ground(z))[:, MIDDLE, MIDDLE] == expected).all()


def test_unknown_cells_under_a_wheel_make_a_pose_unknown_under_the_belly_a_low_ray_vouches() -> None:
    flat = ground(np.zeros((SIZE, SIZE)))
    assert freedom_of(unseen(flat, (MIDDLE + 2, MIDDLE + 4), 0.0))[0, MIDDLE, MIDDLE] == Freedom.UNKNOWN
    assert freedom_of(unseen(flat, (MIDDLE, MIDDLE), 0.09))[0, MIDDLE, MIDDLE] == Freedom.FREE
    assert freedom_of(unseen(flat, (MIDDLE, MIDDLE), 0.11))[0, MIDDLE, MIDDLE] == Freedom.UNKNOWN
    assert freedom_of(unseen(flat, (MIDDLE, MIDDLE)))[0, MIDDLE, MIDDLE] == Freedom.UNKNOWN


def test_a_rock_diagonal_to_a_wheels_cell_blocks() -> None:
    z = np.zeros((SIZE, SIZE))
    z[MIDDLE + 3, MIDDLE + 5] = 0.12  # the front left wheel's cell is (+2, +4)
    assert freedom_of(ground(z))[0, MIDDLE, MIDDLE] == Freedom.BLOCKED


def test_an_unknown_cell_beside_the_body_makes_a_pose_unknown_unless_a_low_ray_vouches() -> None:
    """A pose stands for the whole of its cell: 0.475 m ahead of its centre the body ends, 0.525 m ahead it may be."""
    flat, beside = ground(np.zeros((SIZE, SIZE))), (MIDDLE, MIDDLE + 5)
    assert freedom_of(unseen(flat, beside))[0, MIDDLE, MIDDLE] == Freedom.UNKNOWN
    assert freedom_of(unseen(flat, beside, 0.05))[0, MIDDLE, MIDDLE] == Freedom.FREE
    assert freedom_of(unseen(flat, (MIDDLE, MIDDLE + 6)))[0, MIDDLE, MIDDLE] == Freedom.FREE
    rock = np.zeros((SIZE, SIZE))
    rock[beside] = 0.12
    assert freedom_of(ground(rock))[0, MIDDLE, MIDDLE] == Freedom.FREE  # what is known beside it is no wall


@pytest.mark.parametrize("seed", [0, 1])
def test_pose_freedom_equals_the_slow_twin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shape = (16, 17)
    z = rng.normal(0, 0.01, shape) + np.arange(17) * rng.uniform(-0.03, 0.03)
    z[rng.integers(16), rng.integers(17)] += 0.15
    made = ground(z)
    made = dataclasses.replace(made, z_top=made.z_top + np.float32(0.005))
    made = unseen(made, np.nonzero(rng.random(shape) < 0.03), 0.05)
    made = unseen(made, np.nonzero(rng.random(shape) < 0.003))
    want = oracles.pose_freedom(made, ROVER, PLANNING)
    assert set(np.unique(want)) == set(Freedom)
    np.testing.assert_array_equal(poses.pose_freedom(made, ROVER, PLANNING, tyres=False), want)
    with_tyres = freedom_of(made)
    assert (with_tyres[with_tyres != want] == Freedom.BLOCKED).all()


def test_a_stone_stands_out_of_a_slope_and_of_level_ground_and_the_slope_itself_does_not() -> None:
    for slope_m in (0.0, 0.035):
        z = np.arange(17) * slope_m + np.zeros((16, 17))
        assert not poses.tall(ground(z), 0.06).any()
        z[8, 9] += 0.09
        assert np.argwhere(poses.tall(ground(z), 0.06)).tolist() == [[8, 9]]


def test_the_rim_of_a_hole_does_not_stand_out_and_a_rock_beside_it_does() -> None:
    z = np.zeros((31, 31))
    z[12:16, 12:17] = -0.25
    assert not poses.tall(ground(z), 0.06).any()
    z[15, 18] += 0.09
    z[6, 6] += 0.09
    assert np.argwhere(poses.tall(ground(z), 0.06)).tolist() == [[6, 6], [15, 18]]


def test_a_rock_in_a_bowl_and_rocks_around_a_gap_stand_out() -> None:
    away = np.hypot(*np.mgrid[-15:16, -15:16])
    bowl = 0.10 * np.minimum(away / 4, 1.0)
    bowl[15, 15] += 0.09
    assert poses.tall(ground(bowl), 0.06)[15, 15]
    gap = np.zeros((31, 31))
    gap[15, [12, 18]] = gap[[12, 18], 15] = 0.09
    assert poses.tall(ground(gap), 0.06).sum() == 4


def test_only_narrow_holes_with_known_rims_on_all_sides_are_filled() -> None:
    away = np.hypot(*np.mgrid[-15:16, -15:16])
    hole, wide = (np.where(away <= radius, -0.2, 0.0) for radius in (3.0, 6.0))
    assert (poses.filled(hole, 0.1) == 0.0).all()
    assert poses.filled(wide, 0.1)[15, 15] == -0.2
    ditch, dark = hole.copy(), hole.copy()
    ditch[:, 15], dark[:12] = -0.2, np.nan
    assert poses.filled(ditch, 0.1)[15, 15] == -0.2
    assert poses.filled(dark, 0.1)[13, 15] == -0.2 and poses.filled(hole[15:], 0.1)[0, 15] == -0.2


def test_no_free_pose_lets_a_tyre_touch_the_middle_of_what_stands_out_wherever_in_its_cell_the_rover_is() -> None:
    z = np.zeros((31, 31))
    z[15, 15] += 0.09
    made = ground(z)
    freedom, stone = freedom_of(made), np.array(made.grid.centre(15, 15))
    rng = np.random.default_rng(4)
    free = np.argwhere(freedom == Freedom.FREE)
    for o, j, i in free[rng.integers(len(free), size=2000)]:
        x, y = np.array(made.grid.centre(int(j), int(i))) + rng.uniform(-0.05, 0.05, 2)
        c, s = math.cos(o * math.pi / 8), math.sin(o * math.pi / 8)
        ahead, left = np.array([[c, s], [-s, c]]) @ (stone - (x, y))
        along, across = abs(ahead) - ROVER.half_wheelbase_m, abs(left) - ROVER.half_track_m
        assert abs(along) > ROVER.wheel_radius_m or abs(across) > ROVER.wheel_width_m / 2


@pytest.mark.parametrize("o", range(8))
def test_steered_cells_are_those_within_the_margin_of_a_tyre_that_steers_anyhow(o: int) -> None:
    cells, rng, cell_m, margin_m = set(poses.steered_cells(o, ROVER, 0.1, 0.05)), np.random.default_rng(o), 0.1, 0.05
    c, s = math.cos(o * math.pi / 8), math.sin(o * math.pi / 8)
    reached = set()
    for _ in range(20_000):
        ahead = rng.choice((-1, 1)) * ROVER.half_wheelbase_m
        left = rng.choice((-1, 1)) * ROVER.half_track_m
        steer, along, across = rng.uniform(-math.pi, math.pi), *(rng.choice((-1, 1), 2) * (ROVER.wheel_radius_m, 0.05))
        x, y = rng.uniform(-cell_m / 2, cell_m / 2, 2)  # base_link in its cell
        x += c * ahead - s * left + math.cos(steer) * along - math.sin(steer) * across
        y += s * ahead + c * left + math.sin(steer) * along + math.cos(steer) * across
        reached.add((round(y / cell_m), round(x / cell_m)))
    corner = math.hypot(ROVER.wheel_radius_m, ROVER.wheel_width_m / 2)
    centres = [
        (
            c * a * ROVER.half_wheelbase_m - s * b * ROVER.half_track_m,
            s * a * ROVER.half_wheelbase_m + c * b * ROVER.half_track_m,
        )
        for a in (-1, 1)
        for b in (-1, 1)
    ]
    middles = {
        (j, i)
        for j, i in reached
        if min(math.hypot(i * cell_m - x, j * cell_m - y) for x, y in centres) <= corner + margin_m
    }
    assert middles <= cells
    assert all(
        min(math.hypot(i * cell_m - x, j * cell_m - y) for x, y in centres) <= corner + margin_m + 0.0708
        for j, i in cells
    )


def test_driven_poses_stay_free() -> None:
    freedom = np.zeros((8, 5, 5), np.uint8)
    marked = poses.trail(freedom, np.array([[1, 2, 3], [4, 4, 7], [9, 0, 0]]))
    assert marked[3, 1, 2] == marked[7, 4, 4] == Freedom.FREE and marked.sum() == 2 * Freedom.FREE
    assert freedom.sum() == 0


def test_closeness_is_the_weight_beside_a_blocked_pose_and_0_from_half_a_metre_on() -> None:
    freedom = np.full((8, 15, 15), Freedom.FREE, np.uint8)
    freedom[2, 7, 7] = Freedom.BLOCKED
    freedom[2, 7, 0] = Freedom.UNKNOWN
    ratio = poses.closeness(freedom, dataclasses.replace(PLANNING, closeness_weight=0.5, touching_ratio=0.0), 0.1)
    assert ratio.dtype == np.float32 and ratio[[0, 1, 3, 4, 5, 6, 7]].max() == 0
    np.testing.assert_allclose(ratio[2, 7, 8:14], 0.5 * np.array([1, 0.8, 0.6, 0.4, 0.2, 0]), atol=1e-6)
    assert ratio[2, 7, 0] == 0


@LAW
@given(st.integers(0, 10_000))
def test_reachable_is_where_the_free_only_field_from_the_pose_is_finite(seed: int) -> None:
    rng = np.random.default_rng(seed)
    freedom = rng.choice(np.array([0, 1, 2], np.uint8), (8, 6, 7), p=(0.5, 0.1, 0.4))
    j, i, o = (int(rng.integers(0, n)) for n in (6, 7, 8))
    cost = pose_field.cost_to_go(freedom, np.array([[j, i, o]]), PLANNING, 0.1, optimistic=False)
    np.testing.assert_array_equal(poses.reachable(freedom, j, i, o), np.isfinite(cost))


@LAW
@given(st.integers(0, 10_000))
def test_node_sets_are_disjoint_and_their_union_is_the_grid(seed: int) -> None:
    rng = np.random.default_rng(seed)
    made = ground(np.zeros((9, 9)))
    made = unseen(made, np.nonzero(rng.random((9, 9)) < 0.2), 0.5)
    made = unseen(made, np.nonzero(rng.random((9, 9)) < 0.2))
    freedom = rng.integers(0, 3, (8, 9, 9)).astype(np.uint8)
    mask = rng.random(freedom.shape) < 0.2
    sets = poses.node_sets(made, freedom, mask)
    members = [sets == one for one in NodeSet]
    assert (np.sum(members, axis=0) == 1).all()
    free = ((freedom == Freedom.FREE) & mask).any(axis=0)
    np.testing.assert_array_equal(sets == NodeSet.FREE, free)
    known = made.cell_class >= CellClass.HIT
    np.testing.assert_array_equal(sets == NodeSet.OBSTACLE, known & ~free)
    np.testing.assert_array_equal(sets == NodeSet.OUTSIDE, (made.cell_class == CellClass.OUTSIDE) & ~free)


def test_orientation_is_the_nearest_of_8_modulo_180_degrees() -> None:
    assert [poses.orientation(math.radians(a)) for a in (0, 22.5, 90, 168, 170, 180, -22.5, -90)] == [
        0,
        1,
        4,
        7,
        0,
        0,
        7,
        4,
    ]
    assert poses.pose_index(Grid(0.05, 0.05, 0.1, 9, 9), 0.31, 0.18, math.pi) == (1, 3, 0)


def test_a_pose_beside_a_blocked_one_in_place_or_orientation_costs_more() -> None:
    freedom = np.full((8, 9, 9), Freedom.FREE, np.uint8)
    freedom[0, 4, 4] = Freedom.BLOCKED
    ratio = poses.closeness(freedom, dataclasses.replace(PLANNING, closeness_weight=0.0, touching_ratio=5.0), 0.1)
    assert ratio[0, 3:6, 3:6].min() == 5.0
    assert ratio[1, 4, 4] == ratio[7, 4, 4] == 5.0
    assert ratio[2, 4, 4] == ratio[0, 4, 6] == ratio[1, 4, 5] == 0.0


@settings(max_examples=20, deadline=None, derandomize=True)
@given(st.integers(0, 2**31 - 1))
def test_clearance_is_the_distance_to_the_nearest_blocked_cell_of_the_same_orientation(seed: int) -> None:
    rng = np.random.default_rng(seed)
    freedom = np.where(rng.random((8, 20, 24)) < 0.03, Freedom.BLOCKED, Freedom.FREE).astype(np.uint8)
    some = np.column_stack([rng.integers(-2, 22, 30), rng.integers(-2, 26, 30), rng.integers(0, 8, 30)])
    found = poses.clearance_m(freedom, some, 0.1)
    for (j, i, o), clear_m in zip(some.tolist(), found.tolist()):
        blocked = np.argwhere(freedom[o] == Freedom.BLOCKED)
        away = (np.hypot(*(blocked - (j, i)).T) - 1.0) * 0.1
        assert clear_m == pytest.approx(np.clip(away.min(initial=np.inf), 0.0, poses.CLOSE_M))
