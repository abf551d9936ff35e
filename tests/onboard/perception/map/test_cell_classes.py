"""Each class by a hand-made case, the de-biased bounds under noise, and all of it against the slow twin."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard import config
from onboard.perception.map import ldem as maps
from onboard.perception.map.cell_classes import SPREAD, classify
from onboard.planning.local.poses import Freedom, pose_freedom
from onboard.records import CellClass, Cloud, Grid, Ldem, Pose
from tests.oracles import cells as oracles

MAPPING = config.Mapping_()
LAW = settings(max_examples=15, deadline=None, derandomize=True)


def strip(heights_m: list[float | None], rays_m: list[float | None]) -> Ldem:
    """One row of cells: a height makes one exact hit, a ray height a crossing; None is neither."""
    ldem = maps.empty(Grid(0.05, 0.05, 0.1, 1, len(heights_m)))
    for i, (height, ray) in enumerate(zip(heights_m, rays_m)):
        if height is not None:
            ldem.n[0, i] = 1
            ldem.sum_z[0, i] = ldem.z_hi[0, i] = ldem.z_lo[0, i] = height
        if ray is not None:
            ldem.z_ray[0, i] = ray
    return ldem


def classes(ldem: Ldem) -> list[CellClass]:
    return [CellClass(kind) for kind in classify(ldem, MAPPING).cell_class[0]]


def test_a_cell_with_a_hit_is_hit_without_is_outside_or_occluded() -> None:
    ldem = strip([0.0, None, None, None], [None, 0.5, None, None])
    assert classes(ldem) == [CellClass.HIT, CellClass.OCCLUDED, CellClass.OUTSIDE, CellClass.OUTSIDE]
    surface = classify(ldem, MAPPING)
    assert np.isnan(surface.z_mean[0, 1:]).all() and np.isnan(surface.z_top[0, 1:]).all()


@pytest.mark.parametrize(
    ("ray", "kind"),
    [
        (0.0, CellClass.FILLED),
        (-0.019, CellClass.FILLED),
        (0.079, CellClass.FILLED),
        (0.081, CellClass.OCCLUDED),
        (-0.021, CellClass.OCCLUDED),
        (-0.059, CellClass.OCCLUDED),
        (-0.061, CellClass.HOLE),
    ],
)
def test_a_gap_is_filled_by_a_beam_close_over_it_a_hole_by_one_under_it(ray: float, kind: CellClass) -> None:
    assert classes(strip([0.0, None, 0.0], [None, ray, None]))[1] == kind


def test_two_missing_cells_are_filled_linearly_three_are_not() -> None:
    ldem = strip([0.0, None, None, 0.09], [None, 0.03, 0.06, None])
    np.testing.assert_allclose(classify(ldem, MAPPING).z_mean[0], [0.0, 0.03, 0.06, 0.09], atol=1e-6)
    assert classes(ldem) == [CellClass.HIT, CellClass.FILLED, CellClass.FILLED, CellClass.HIT]
    three = strip([0.0, None, None, None, 0.0], [None, 0.0, 0.0, 0.0, None])
    assert CellClass.FILLED not in classes(three)


@pytest.mark.parametrize(("rise", "kind"), [(0.115, CellClass.FILLED), (0.117, CellClass.OCCLUDED)])
def test_a_gap_between_hits_more_than_0_116_m_apart_in_height_is_not_filled(rise: float, kind: CellClass) -> None:
    assert classes(strip([0.0, None, rise], [None, rise / 2, None]))[1] == kind


@pytest.mark.parametrize("direction", [(0, 1), (1, 0), (1, 1), (1, -1)])
def test_rows_columns_and_diagonals_fill(direction: tuple[int, int]) -> None:
    ldem = maps.empty(Grid(0.05, 0.05, 0.1, 3, 3))
    for sign in (-1, 1):
        at = (1 + sign * direction[0], 1 + sign * direction[1])
        ldem.n[at], ldem.sum_z[at], ldem.z_hi[at], ldem.z_lo[at] = 1, 0.2, 0.2, 0.2
    ldem.z_ray[1, 1] = 0.2
    surface = classify(ldem, MAPPING)
    assert surface.cell_class[1, 1] == CellClass.FILLED and surface.z_mean[1, 1] == pytest.approx(0.2)


def test_the_surface_of_a_proved_hole_is_the_lowest_ray() -> None:
    surface = classify(strip([0.0, None, 0.0], [None, -0.1, None]), MAPPING)
    assert surface.z_bot[0, 1] == surface.z_top[0, 1] == np.float32(-0.1)


def test_assumed_ground_stands_until_a_hit_replaces_it() -> None:
    ldem = strip([None, 0.3, None], [None, None, 0.5])
    ldem = dataclasses.replace(ldem, assumed_z=np.full((1, 3), 0.1, np.float32))
    assert classes(ldem) == [CellClass.ASSUMED, CellClass.HIT, CellClass.ASSUMED]
    np.testing.assert_allclose(classify(ldem, MAPPING).z_mean[0], [0.1, 0.3, 0.1])


def test_bounds_take_out_what_noise_makes_of_n_hits_but_keep_a_true_edge() -> None:
    ldem = strip([0.0], [None])
    ldem.n[0, 0], ldem.sum_z[0, 0], ldem.sum_sigma[0, 0] = 100, 0.0, 100 * 0.02
    ldem.z_hi[0, 0], ldem.z_lo[0, 0] = 0.03, -0.25
    surface = classify(ldem, MAPPING)
    assert surface.z_top[0, 0] == 0.0
    assert surface.z_bot[0, 0] == pytest.approx(-0.25 + 0.02 * SPREAD[100])


@pytest.mark.parametrize("n", [2, 3, 5, 7, 8, 12, 30, 100, 400])
def test_the_spread_is_that_of_the_bounds_of_n_normal_deviates_less_one_sigma_of_theirs(n: int) -> None:
    drawn = np.sort(np.random.default_rng(n).standard_normal((20_000, n)), axis=1)
    bound = drawn[:, -2 if n >= maps.ROBUST_HITS else -1]
    assert SPREAD[n] == pytest.approx(bound.mean() - bound.std(), abs=0.06)


def test_a_single_hit_may_stand_a_sigma_higher_than_it_reads() -> None:
    ldem = strip([0.0], [None])
    ldem.sum_sigma[0, 0] = 0.02
    surface = classify(ldem, MAPPING)
    assert (surface.z_top[0, 0], surface.z_bot[0, 0]) == pytest.approx((0.02, -0.02))


def test_a_beam_deep_through_a_hit_cell_lowers_its_bottom() -> None:
    surface = classify(strip([0.0], [-0.3]), MAPPING)
    assert surface.z_bot[0, 0] == pytest.approx(-0.28) and surface.z_top[0, 0] == 0.0


@LAW
@given(st.integers(0, 10_000), st.integers(0, 3))
def test_classes_and_heights_equal_the_slow_twin(seed: int, fill_cells: int) -> None:
    rng = np.random.default_rng(seed)
    ldem = maps.empty(Grid(0.05, 0.05, 0.1, 12, 14))
    n = np.where(rng.random((12, 14)) < 0.45, rng.integers(1, 9, (12, 14)), 0).astype(np.int32)
    mean = rng.normal(0, 0.04, n.shape)
    ldem = dataclasses.replace(
        ldem,
        n=n,
        sum_z=n * mean,
        z_hi=np.where(n > 0, mean + rng.exponential(0.04, n.shape), np.nan).astype(np.float32),
        z_lo=np.where(n > 0, mean - rng.exponential(0.04, n.shape), np.nan).astype(np.float32),
        sum_sigma=(n * 0.01).astype(np.float32),
        z_ray=np.where(rng.random(n.shape) < 0.7, rng.normal(0, 0.06, n.shape), np.inf).astype(np.float32),
        assumed_z=np.where(rng.random(n.shape) < 0.3, 0.01, np.nan).astype(np.float32),
    )
    surface = classify(ldem, dataclasses.replace(MAPPING, fill_cells=fill_cells))
    kinds, mean_z, top, bottom = oracles.classify(ldem, fill_cells)
    np.testing.assert_array_equal(surface.cell_class, kinds)
    for got, want in ((surface.z_mean, mean_z), (surface.z_top, top), (surface.z_bot, bottom)):
        np.testing.assert_allclose(got, want, atol=1e-6)


def scan_of(ground: np.ndarray, cell_m: float, noise_m: float, seed: int) -> Cloud:
    """Beams of one sweep onto a height field (square, centred, cells of cell_m), found by marching 1 cm at a time."""
    tilt, azimuth = np.meshgrid(
        np.radians(np.arange(60, 8, -0.7)), np.radians(np.arange(-65, 65.1, 0.5)), indexing="ij"
    )
    way = np.stack([np.cos(azimuth) * np.cos(tilt), np.sin(azimuth), -np.cos(azimuth) * np.sin(tilt)], -1).reshape(
        -1, 3
    )
    origin, half = np.array([0.3, 0.0, 0.7]), len(ground) * cell_m / 2
    length, hit = np.full(len(way), 4.0), np.zeros(len(way), bool)
    for r in np.arange(0.4, 4.0, 0.01):
        at = origin + way * r
        j, i = (np.clip(np.floor((at[:, k] + half) / cell_m).astype(int), 0, len(ground) - 1) for k in (1, 0))
        new = ~hit & (at[:, 2] <= ground[j, i])
        length[new], hit = r - 0.005, hit | new
    length += np.where(hit, np.random.default_rng(seed).normal(0, noise_m, len(way)), 0.0)
    return Cloud(origin, (origin + way * length[:, None]).astype(np.float32), hit, sigma_range_m=0.02)


def test_flat_ground_seen_with_20_mm_noise_blocks_no_pose_and_frees_those_near_the_rover() -> None:
    ldem = maps.assume_disc(maps.empty(maps.grid_around(0, 0, 7, 0.1)), Pose(0, 0), 0.9)
    ldem = maps.insert(ldem, scan_of(np.zeros((160, 160)), 0.05, noise_m=0.02, seed=3), 0, 5.0)
    surface = classify(ldem, MAPPING)
    freedom = pose_freedom(surface, config.Rover(), config.Planning())
    assert (freedom == Freedom.BLOCKED).sum() == 0
    ahead = [surface.grid.cell(x / 10, 0.0) for x in range(0, 22)]
    assert all((freedom[0, j, i] == Freedom.FREE) for j, i in ahead)


def test_a_hole_0_3_m_wide_and_0_25_m_deep_at_1_5_m_blocks_the_poses_that_would_put_a_wheel_in() -> None:
    ground = np.zeros((160, 160))
    ground[77:83, 107:113] = -0.25  # x 1.35..1.65 m, y -0.15..0.15 m
    ldem = maps.assume_disc(maps.empty(maps.grid_around(0, 0, 7, 0.1)), Pose(0, 0), 0.9)
    surface = classify(maps.insert(ldem, scan_of(ground, 0.05, 0.01, seed=4), 0, 5.0), MAPPING)
    freedom = pose_freedom(surface, config.Rover(), config.Planning())
    j, i = surface.grid.cell(1.5, 0.05)
    assert surface.z_bot[j - 1 : j + 1, i - 1 : i + 2].min() < -0.1
    wheel_in = [(j - 2, i - 4), (j + 2, i - 4)]  # a front wheel on the hole's middle
    assert all(freedom[0, row, column] == Freedom.BLOCKED for row, column in wheel_in)
