"""Eq. 15 to 25 as printed: ground whose roughness depends on the map's size, and slopes counted twice or below zero."""

import math

import numpy as np
import pytest

from docs.as_printed.global_path import Weights, eq_21, eq_22, eq_23_24, eq_25, projection
from docs.as_printed.terrain import Mended, eq_15, eq_17, eq_20
from hil.terrain.fractal import fractal_heights
from onboard.config import Planning
from onboard.planning import global_path
from onboard.records import Gdem, Grid

SIGNED, CORRECTED = Mended(signed=True), Mended(signed=True, per_area=True)
HURST = 0.8


def sigma_of(heights_m, cell_m, mended=CORRECTED):
    """The sigma of Eq. 14 in a map, its longest three waves left out."""
    size = len(heights_m)
    u = np.fft.fftfreq(size, cell_m)
    radius = np.hypot(u[:, None], u[None, :])
    band = (radius * size * cell_m >= 4) & (radius * 2 * cell_m < 1)
    return math.sqrt((eq_15(heights_m, cell_m, mended)[band] * radius[band] ** (2 * HURST + 2)).mean())


def plane(degrees, cell_m, size=101):
    x = np.arange(size) * cell_m * math.tan(math.radians(degrees))
    return np.tile(x, (size, 1)).astype(np.float32)


def test_sigma_comes_back_as_0_197_of_itself_from_256_cells_of_10_cm_as_printed_and_whole_as_corrected():
    printed = eq_17(eq_20(256, 0.1, HURST, 1.0, SIGNED), 0.1, np.random.default_rng(0)).real
    assert sigma_of(printed, 0.1) == pytest.approx(0.197, abs=0.001)
    assert sigma_of(fractal_heights(256, 0.1, HURST, 1.0, np.random.default_rng(0)), 0.1) == pytest.approx(1, abs=0.005)


@pytest.mark.parametrize("size", [64, 128, 512])
def test_sigma_as_printed_falls_with_the_root_of_the_maps_side(size):
    printed = eq_17(eq_20(size, 0.1, HURST, 1.0, SIGNED), 0.1, np.random.default_rng(0)).real
    assert sigma_of(printed, 0.1) == pytest.approx((size * 0.1) ** -0.5, rel=0.01)
    mended = eq_17(eq_20(size, 0.1, HURST, 1.0, CORRECTED), 0.1, np.random.default_rng(0)).real
    assert sigma_of(mended, 0.1) == pytest.approx(1.0, rel=0.01)


def test_eq_15_as_printed_measures_twice_the_sigma_on_a_map_four_times_as_wide():
    small, wide = (fractal_heights(256, cell, HURST, 0.02, np.random.default_rng(3)) for cell in (0.1, 0.4))
    assert sigma_of(wide, 0.4, SIGNED) / sigma_of(small, 0.1, SIGNED) == pytest.approx(2.0, abs=1e-6)
    assert sigma_of(wide, 0.4) / sigma_of(small, 0.1) == pytest.approx(1.0, abs=1e-6)


def test_frequencies_0_to_n_minus_1_are_not_hermitian_half_the_map_is_imaginary():
    z = eq_17(eq_20(256, 0.1, HURST, 1.0), 0.1, np.random.default_rng(0))
    assert z.imag.std() / z.real.std() == pytest.approx(1.0, abs=0.001)
    signed = eq_17(eq_20(256, 0.1, HURST, 1.0, SIGNED), 0.1, np.random.default_rng(0))
    assert np.abs(signed.imag).max() < 1e-12 * signed.real.std()


def test_frequencies_0_to_n_minus_1_leave_ridges_one_way_only():
    amplitude = eq_20(256, 0.1, HURST, 1.0)
    assert (amplitude[1, 1] / amplitude[1, 255]) ** 2 == pytest.approx(1.3e8, rel=0.02)  # crests at -45 and at +45
    signed = eq_20(256, 0.1, HURST, 1.0, SIGNED)
    assert signed[1, 1] == signed[1, 255]


def test_eq_21_counts_15_degrees_of_smooth_slope_as_5_8_cm_of_roughness():
    fine = plane(15, 0.01)
    assert eq_21(projection(fine, 0.01, (50, 50))) == pytest.approx(0.058, abs=0.0001)
    assert 0.75 * math.tan(math.radians(15)) / math.sqrt(12) == pytest.approx(0.058, abs=0.0001)
    ours = global_path.layers(Gdem(Grid(0.005, 0.005, 0.01, 101, 101), fine))
    assert ours.roughness_m.max() < 1e-6


def test_on_the_orbiters_map_the_region_is_one_node_so_roughness_and_inclination_are_always_0():
    heights = np.random.default_rng(0).normal(0, 3, (30, 30)).astype(np.float32)
    regions = [projection(heights, 10.0, (j, i)) for j in range(30) for i in range(30)]
    assert all(region.shape == (1, 1) for region in regions)
    assert max(eq_21(region) for region in regions) == 0.0
    assert {eq_23_24(region, 10.0) for region in regions} == {(0.0, 0.0)}
    ours = global_path.layers(Gdem(Grid(5.0, 5.0, 10.0, 30, 30), heights))
    assert ours.roughness_m.min() > 0.3


def test_inclinations_depend_on_the_heading_but_a_node_has_one_pair_of_them():
    slope = plane(15, 0.05)
    east = np.degrees(eq_23_24(projection(slope, 0.05, (50, 50)), 0.05))
    north = np.degrees(eq_23_24(projection(np.rot90(slope), 0.05, (50, 50)), 0.05))  # the same ground, turned
    np.testing.assert_allclose(east, (0, -15), atol=1e-3)
    np.testing.assert_allclose(north, (-15, 0), atol=1e-3)


def test_signed_inclinations_make_a_climb_pay_a_negative_price():
    weights = Weights(1.0, 1.0, theta_x=2 / math.radians(20), theta_y=2 / math.radians(20))
    up = eq_23_24(projection(plane(15, 0.05), 0.05, (50, 50)), 0.05)
    way = eq_22(np.zeros(3), np.array([1.0, 0.0, math.tan(math.radians(15))]))
    price = eq_25(0.0, way, up, weights)
    assert price == pytest.approx(1 / math.cos(math.radians(15)) - 2 * 15 / 20, abs=1e-3)
    assert price < -0.4  # Dijkstra's algorithm needs prices of at least 0, and to and fro over the slope pays for ever


def test_corrected_edges_never_cost_less_than_their_length():
    heights = np.random.default_rng(1).normal(0, 0.4, (20, 20)).astype(np.float32)
    costs = global_path.edge_costs(Gdem(Grid(5.0, 5.0, 10.0, 20, 20), heights), Planning(weight_pitch=50.0))
    assert costs[np.isfinite(costs)].min() >= 10.0
