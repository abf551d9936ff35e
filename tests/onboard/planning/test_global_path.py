"""The way over the orbiter's map."""

import numpy as np
import pytest

from onboard.config import Planning
from onboard.planning import global_path
from onboard.records import Gdem, Grid

PLANNING = Planning()


def gdem(heights):
    heights = np.asarray(heights, dtype=np.float32)
    return Gdem(Grid(5.0, 5.0, 10.0, *heights.shape), heights)


def test_roughness_of_a_tilted_plane_is_zero_and_its_raw_deviation_is_not():
    j, i = np.mgrid[0:6, 0:7]
    plane = gdem(3000.0 + 2.0 * i + 1.0 * j)
    fitted = global_path.layers(plane)
    assert np.abs(fitted.roughness_m).max() < 1e-4
    np.testing.assert_allclose(fitted.slope_x, 0.2, atol=1e-5)
    np.testing.assert_allclose(fitted.slope_y, 0.1, atol=1e-5)
    raw = global_path.layers(plane, raw_roughness=True).roughness_m[2, 2]
    assert raw == pytest.approx(np.std([2.0 * a + b for a in (-1, 0, 1) for b in (-1, 0, 1)]), rel=1e-4)


def test_flat_ground_costs_its_octile_length():
    field = global_path.solve(gdem(np.zeros((12, 15))), (25.0, 35.0), PLANNING)
    j, i = np.mgrid[0:12, 0:15]
    a, b = np.abs(i - 2), np.abs(j - 3)
    octile = 10.0 * (np.maximum(a, b) + (np.sqrt(2) - 1) * np.minimum(a, b))
    assert np.all(field.cost_m <= octile + 1e-3)
    assert np.all(field.cost_m >= 10.0 * np.hypot(a, b) - 1e-3)


def test_cost_depends_on_heading_across_and_along_a_slope():
    i = np.mgrid[0:7, 0:7][1]
    only_roll = Planning(weight_pitch=0.0, weight_roughness=0.0)
    costs = global_path.edge_costs(gdem(2.0 * i), only_roll)
    angle = np.arctan(0.2)
    assert costs[0][3, 3] == pytest.approx(np.hypot(10, 2), rel=1e-5)  # straight up: no roll
    assert costs[2][3, 3] == pytest.approx(10 * (1 + 0.5 * angle / only_roll.slope_limit_rad), rel=1e-5)


def test_a_ridge_too_steep_is_gone_round_and_a_closed_one_is_reported():
    z = np.zeros((15, 21))
    z[:12, 10] = 20.0
    field = global_path.solve(gdem(z), (155.0, 25.0), PLANNING)
    way = global_path.path(field, (45.0, 25.0))
    assert way[:, 1].max() > 110.0
    assert global_path.value_at(field, 45.0, 25.0) > 200.0
    z[:, 10] = 20.0
    closed = global_path.solve(gdem(z), (155.0, 25.0), PLANNING)
    assert global_path.value_at(closed, 45.0, 25.0) == np.inf
    assert len(global_path.path(closed, (45.0, 25.0))) == 0


def test_cells_without_data_are_impassable():
    z = np.zeros((9, 9))
    z[:, 4] = np.nan
    field = global_path.solve(gdem(z), (75.0, 45.0), PLANNING)
    assert np.isinf(field.cost_m[:, :5]).all()
    assert np.isfinite(field.cost_m[:, 5:]).all()


def test_value_on_even_ground_is_continuous_and_zero_at_the_goal():
    field = global_path.solve(gdem(np.zeros((15, 15))), (71.0, 68.0), PLANNING)
    assert global_path.value_at(field, 71.0, 68.0) == pytest.approx(0.0, abs=1e-6)
    x = np.linspace(1.0, 145.0, 14401)
    values = global_path.values_at(field, np.column_stack([x, np.full_like(x, 33.0)]))
    assert np.abs(np.diff(values)).max() < 0.6
    assert np.all(values >= np.hypot(x - 71.0, 35.0) - 1e-3)
    assert np.all(values <= 1.09 * np.hypot(x - 71.0, 35.0) + 1e-3)


def test_value_outside_the_map_adds_the_straight_way_to_the_border():
    field = global_path.solve(gdem(np.zeros((10, 10))), (55.0, 55.0), PLANNING)
    at_border = global_path.value_at(field, 5.0, 55.0)
    assert global_path.value_at(field, -15.0, 55.0) == pytest.approx(at_border + 20.0, abs=1e-3)


def test_path_runs_from_start_to_goal_over_neighbours():
    rng = np.random.default_rng(5)
    field = global_path.solve(gdem(rng.normal(0, 0.5, (20, 20))), (171.0, 168.0), PLANNING)
    way = global_path.path(field, (12.0, 21.0))
    np.testing.assert_allclose(way[0], (12.0, 21.0))
    np.testing.assert_allclose(way[-1], (171.0, 168.0))
    assert np.hypot(*np.diff(way[1:-1], axis=0).T).max() < 14.2
