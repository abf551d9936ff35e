"""The native kernels against their slow twins, and the door that checks what goes in."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.kernel_calls import pose_field as door
from onboard.kernel_calls import raster
from onboard.planning.local import pose_field
from onboard.records import Cloud, Grid
from tests.oracles import cells as oracles

GRID = Grid(x0_m=-0.55, y0_m=-0.75, cell_m=0.1, rows=16, columns=12)
LAW = settings(max_examples=15, deadline=None, derandomize=True)


def cloud(origin: tuple[float, float, float], ends: list, hit: list | None = None) -> Cloud:
    flags = np.ones(len(ends), bool) if hit is None else np.array(hit, bool)
    return Cloud(np.array(origin, float), np.array(ends, np.float32).reshape(-1, 3), flags, sigma_range_m=0.02)


@LAW
@given(st.integers(0, 10_000), st.booleans())
def test_rasterise_equals_beams_cut_with_every_cell(seed: int, origin_on_grid: bool) -> None:
    rng = np.random.default_rng(seed)
    origin = rng.uniform([-0.5, -0.7, 0.2], [0.5, 0.7, 0.9]) + (0.0 if origin_on_grid else np.array([1.5, -2.0, 0.0]))
    made = Cloud(origin, rng.uniform([-1, -1, -0.2], [1, 1, 1.2], (25, 3)).astype(np.float32), rng.random(25) < 0.6)
    got, want = raster.rasterise(GRID, made), oracles.rasterise(GRID, made)
    for name, layer in want.items():
        np.testing.assert_allclose(getattr(got, name), layer, rtol=1e-5, atol=1e-6, err_msg=name)


def test_a_beam_along_one_row_keeps_the_height_at_the_far_side_of_each_cell() -> None:
    got = raster.rasterise(GRID, cloud((-0.45, 0.05, 0.9), [(0.45, 0.05, 0.0)]))
    j, first = GRID.cell(-0.45, 0.05)
    np.testing.assert_allclose(got.z_ray[j, first : first + 9], np.arange(0.85, 0.0, -0.1), atol=1e-6)
    assert got.z_ray[j, first + 9] == np.inf  # the hit's own cell
    assert got.n.sum() == 1
    assert np.isinf(np.delete(got.z_ray, j, axis=0)).all()


def test_a_rising_beam_keeps_the_height_where_it_enters() -> None:
    got = raster.rasterise(GRID, cloud((-0.45, 0.05, 0.0), [(0.45, 0.05, 0.9)], hit=[False]))
    j, first = GRID.cell(-0.45, 0.05)
    np.testing.assert_allclose(got.z_ray[j, first + 1 : first + 10], np.arange(0.05, 0.9, 0.1), atol=1e-6)
    assert got.n.sum() == 0


def test_beams_through_corners_along_borders_straight_down_and_broken_stay_on_the_grid() -> None:
    ends = [
        (0.55, 0.55, 0.0),
        (0.0, 0.5, 0.0),
        (0.0, 0.0, 0.0),
        (np.nan, 0.0, 0.0),
        (0.1, np.inf, 0.0),
        (9e30, 1e30, 0),
    ]
    got = raster.rasterise(GRID, cloud((0.0, 0.0, 0.7), ends))
    assert got.n.sum() == 3
    assert np.isfinite(got.sum_z).all()


@LAW
@given(st.integers(0, 10_000))
def test_every_hit_on_the_grid_is_counted_once(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ends = rng.uniform([-0.6, -0.8, 0], [0.6, 0.8, 0.1], (500, 3)).astype(np.float32)
    assert raster.rasterise(GRID, Cloud(np.array([0.0, 0.0, 0.7]), ends, np.ones(500, bool))).n.sum() == 500


@pytest.mark.parametrize(
    ("broken", "words"),
    [
        (
            Cloud(np.zeros(3), np.zeros((4, 3)), np.ones(4, bool)),
            r"cloud.ends_m: expected float32 \(any, 3\), given float64",
        ),
        (Cloud(np.zeros(3), np.zeros((4, 2), np.float32), np.ones(4, bool)), r"cloud.ends_m.*given float32 \(4, 2\)"),
        (Cloud(np.zeros(3), np.zeros((4, 3), np.float32), np.ones(5, bool)), r"cloud.hit: expected bool \(4\)"),
        (Cloud(np.zeros(3), np.zeros((8, 3), np.float32)[::2], np.ones(4, bool)), "contiguous"),
        (Cloud(np.full(3, np.nan), np.zeros((4, 3), np.float32), np.ones(4, bool)), "origin_m: expected finite"),
        (Cloud([0, 0, 0], np.zeros((4, 3), np.float32), np.ones(4, bool)), "expected an array"),
    ],
)
def test_the_door_of_rasterise_names_what_is_wrong(broken: Cloud, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        raster.rasterise(GRID, broken)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        (
            {"freedom": np.zeros((7, 3, 3), np.uint8)},
            r"freedom: expected uint8 \(8, any, any\), given uint8 \(7, 3, 3\)",
        ),
        ({"seeds": (np.array([72]), np.zeros(1, np.float32))}, "seeds: expected 0 to 71, given 72"),
        ({"seeds": (np.array([4]), np.zeros(2, np.float32))}, r"seed costs: expected float32 \(1\)"),
        ({"seeds": (np.array([4]), np.full(1, np.nan, np.float32))}, "seed costs: expected finite costs >= 0"),
        ({"turn_m": 0.0}, "prices above 0"),
        ({"closeness": np.full((8, 3, 3), -1, np.float32)}, "closeness: expected finite ratios >= 0"),
        ({"closeness": np.zeros((8, 3, 4), np.float32)}, "closeness: expected float32"),
    ],
)
def test_the_door_of_the_pose_field_names_what_is_wrong(changed: dict, words: str) -> None:
    good = {
        "freedom": np.full((8, 3, 3), 2, np.uint8),
        "least_freedom": 2,
        "seeds": (np.array([4]), np.zeros(1, np.float32)),
        "moves_m": pose_field.moves_m(0.1),
        "turn_m": 0.08,
        "closeness": None,
    }
    door.cost_to_go(**good)
    with pytest.raises(ValueError, match=words):
        door.cost_to_go(**{**good, **changed})
