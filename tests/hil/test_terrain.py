"""Fractal ground has the spectrum it was asked for; rocks have their law; all heights are one triangulation."""

import math

import numpy as np
import pytest

from hil.terrain import (
    block_mean,
    fractal_heights,
    rock_diameters,
    rock_top,
    scatter_rocks,
    slopes_deg,
    soil_height,
)
from onboard.records import Grid

SEEDS = range(40)


def spectrum(size, cell_m, hurst, sigma):
    """Hurst exponent and sigma from the mean power over rings, by a straight line in logarithms (mean of 40 maps)."""
    u = np.fft.fftfreq(size, 1 / size)
    radius = np.hypot(u[:, None], u[None, :])
    power = np.zeros((size, size))
    for seed in SEEDS:
        z = fractal_heights(size, cell_m, hurst, sigma, np.random.default_rng(seed))
        power += np.abs(np.fft.fft2(z) / size**2) ** 2 / len(SEEDS)
    band = (radius >= 4) & (radius <= size / 2 - 1)
    ratio = power[band] * (radius[band] / (size * cell_m)) ** (2 * hurst + 2) * (size * cell_m) ** 2
    rings = np.round(radius[band]).astype(int)
    mean = np.bincount(rings, ratio)[4:] / np.bincount(rings)[4:]
    slope, _ = np.polyfit(np.log(np.arange(4, 4 + len(mean))), np.log(mean), 1, w=np.sqrt(np.bincount(rings)[4:]))
    return hurst - slope / 2, math.sqrt(ratio.mean())


@pytest.mark.parametrize("hurst", [0.6, 0.8])
def test_spectrum_returns_hurst_and_sigma_within_1_percent(hurst):
    found, sigma = spectrum(128, 0.1, hurst, 0.02)
    assert found == pytest.approx(hurst, rel=0.01)
    assert sigma == pytest.approx(0.02, rel=0.01)


@pytest.mark.parametrize(("size", "cell_m"), [(64, 0.1), (128, 0.05), (128, 0.4)])
def test_sigma_does_not_depend_on_size_or_cell(size, cell_m):
    assert spectrum(size, cell_m, 0.8, 0.02)[1] == pytest.approx(0.02, rel=0.01)


def test_structure_function_grows_with_the_power_2_hurst():
    lags, hurst, total = np.array([2, 3, 4, 6, 8]), 0.7, np.zeros(5)
    for seed in range(20):
        z = fractal_heights(512, 0.05, hurst, 0.02, np.random.default_rng(seed))
        total += [np.mean((np.roll(z, lag, 1) - z) ** 2) for lag in lags]
    slope = np.polyfit(np.log(lags), np.log(total), 1)[0]
    assert slope == pytest.approx(2 * hurst, abs=0.1)


def test_same_seed_same_bits_and_mean_zero():
    maps = [fractal_heights(64, 0.1, 0.8, 1.0, np.random.default_rng(3)) for _ in range(2)]
    assert maps[0].tobytes() == maps[1].tobytes() and abs(maps[0].mean()) < 1e-12


def test_waves_over_the_longest_are_left_out():
    power = np.abs(np.fft.rfft2(fractal_heights(64, 0.5, 0.8, 1.0, np.random.default_rng(3), longest_m=8.0)))
    assert power[:3, :3].max() < 1e-9 < power[5, 5]


def test_slope_of_a_plane_is_its_angle():
    z = np.tan(np.radians(7.0)) * 0.1 * np.arange(9)[None, :] * np.ones((5, 1))
    np.testing.assert_allclose(slopes_deg(z, 0.1), 7.0)


def test_soil_height_is_the_triangle_cut_from_right_to_upper():
    grid = Grid(0.5, 0.5, 1.0, 2, 2)
    z = np.array([[0, 0], [0, 1]], np.float32)
    x, y = np.array([0.75, 1.0, 1.25, 1.5, 9.0]), np.array([0.75, 1.0, 1.25, 1.5, 9.0])
    np.testing.assert_allclose(soil_height(grid, z, x, y), [0, 0, 0.5, 1, 1])


def test_block_mean_of_a_block():
    np.testing.assert_allclose(block_mean(np.arange(16.0).reshape(4, 4), 2), [[2.5, 4.5], [10.5, 12.5]])


def test_rocks_follow_the_power_law_and_fill_their_share():
    sizes = np.concatenate([rock_diameters(400, 0.035, np.random.default_rng(seed)) for seed in range(20)])
    assert sizes.min() >= 0.15 and sizes.max() <= 1.2
    assert np.pi / 4 * (sizes**2).sum() / 8000 == pytest.approx(0.035, rel=0.03)
    assert (sizes > 0.3).sum() / (sizes > 0.15).sum() == pytest.approx(0.25, rel=0.12)  # N(> D) ~ D^-2


@pytest.fixture(scope="module")
def rocks():
    grid = Grid(-9.975, -9.975, 0.05, 400, 400)
    return scatter_rocks(grid, np.zeros((400, 400), np.float32), 0.04, ((0, 0, 1.2),), np.random.default_rng(4))


def test_rocks_are_closed_outward_polyhedra_half_buried(rocks):
    for rock in rocks:
        edges = np.sort(np.concatenate([rock.triangles[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))]), axis=1)
        assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
        a, b, c = (rock.vertices_m[rock.triangles[:, k]] for k in range(3))
        assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6 > 0  # the volume
        assert rock.vertices_m[:, 2].min() < 0 < rock.height_m < 0.7 * rock.diameter_m


def test_rocks_do_not_overlap_and_keep_clear(rocks):
    x, y, d = (np.array([getattr(r, k) for r in rocks]) for k in ("x_m", "y_m", "diameter_m"))
    gap = np.hypot(x[:, None] - x, y[:, None] - y) - (d[:, None] + d) / 2 + 100 * np.eye(len(d))
    assert gap.min() > 0 and (np.hypot(x, y) - d / 2).min() > 1.2


def test_rock_top_is_its_height_over_the_peak_and_nothing_beside(rocks):
    rock = rocks[0]
    peak = rock.vertices_m[rock.vertices_m[:, 2].argmax()]
    top = rock_top(rock, np.array([peak[0], peak[0] + 2]), np.array([peak[1], peak[1]]))
    assert top[0] == pytest.approx(peak[2], abs=1e-6) and top[1] == -np.inf
