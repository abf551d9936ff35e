"""Fractal ground has the spectrum it was asked for, whatever the size of the map and of its cells."""

import math

import numpy as np
import pytest
from scipy import fft

from hil.terrain.fractal import fractal_heights
from onboard.native import each, elementary

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


@pytest.mark.parametrize("hurst", [0.3, 0.6, 0.8, 0.9])
def test_spectrum_returns_hurst_and_sigma_within_1_percent(hurst):
    found, sigma = spectrum(256, 0.1, hurst, 0.02)
    assert found == pytest.approx(hurst, rel=0.01)
    assert sigma == pytest.approx(0.02, rel=0.01)


@pytest.mark.parametrize(("size", "cell_m"), [(64, 0.1), (127, 0.1), (128, 0.05), (128, 0.4), (256, 0.4)])
def test_sigma_does_not_depend_on_size_or_cell(size, cell_m):
    assert spectrum(size, cell_m, 0.8, 0.02)[1] == pytest.approx(0.02, rel=0.01)


def structure(size, hurst, lags):
    """Mean square of the height differences along x at these lags, of 10 maps with cell 1 and sigma 1."""
    maps = [fractal_heights(size, 1.0, hurst, 1.0, np.random.default_rng(seed)) for seed in range(10)]
    return np.array([np.mean([np.mean((np.roll(z, lag, 1) - z) ** 2) for z in maps]) for lag in lags])


@pytest.mark.parametrize(("hurst", "lags"), [(0.5, (8, 12, 16, 24, 32)), (0.7, (2, 3, 4, 6, 8))])
def test_height_differences_grow_with_the_power_2_hurst(hurst, lags):
    """At lags where neither the grid nor the period, which no endless fBm has, bends the law by 1 %."""
    slope, _ = np.polyfit(np.log(lags), np.log(structure(1024, hurst, lags)), 1)
    assert slope == pytest.approx(2 * hurst, rel=0.02)


@pytest.mark.parametrize("hurst", [0.3, 0.5, 0.8])
def test_height_differences_are_those_of_the_spectrum(hurst):
    """Their mean square is the sum over all waves of 2 S (1 - cos(2 pi u lag))."""
    u, lags = np.fft.fftfreq(256, 1 / 256), np.array([1, 2, 4, 8])
    radius = np.hypot(u[:, None], u)
    radius[0, 0] = np.inf
    power = ((256**hurst / radius ** (hurst + 1)) ** 2).sum(axis=0)
    expected = [(2 * power * (1 - np.cos(2 * np.pi * u * lag / 256))).sum() for lag in lags]
    np.testing.assert_allclose(structure(256, hurst, lags), expected, rtol=0.02)


@pytest.mark.parametrize("size", [1, 2, 3, 7, 48, 64, 300])
@pytest.mark.parametrize("longest_m", [math.inf, 5.0])
def test_mirrored_quarter_gives_the_bits_of_the_whole_spectrum(size, longest_m):
    """The demo's fields are judged by what is driven on them: making them faster must not change a bit."""
    noise = fft.rfft2(np.random.default_rng(5).standard_normal((size, size)))
    u = np.minimum(np.arange(size), size - np.arange(size)) ** 2.0
    squares = u[:, None] + u[: size // 2 + 1]
    squares[squares <= (size * 0.1 / longest_m) ** 2] = np.inf
    level = size * 0.02 * elementary.exp(0.8 * elementary.log(size * 0.1))
    whole = noise * level * each.exp(-(0.8 + 1) / 2 * each.log(squares))
    plain = fft.irfft(fft.ifft(whole, axis=0), n=size, axis=1)
    found = fractal_heights(size, 0.1, 0.8, 0.02, np.random.default_rng(5), longest_m)
    np.testing.assert_array_equal(found, plain)


def test_same_seed_same_bits_and_mean_zero():
    maps = [fractal_heights(64, 0.1, 0.8, 1.0, np.random.default_rng(3)) for _ in range(2)]
    assert maps[0].tobytes() == maps[1].tobytes() and abs(maps[0].mean()) < 1e-12


def test_waves_over_the_longest_are_left_out():
    power = np.abs(np.fft.rfft2(fractal_heights(64, 0.5, 0.8, 1.0, np.random.default_rng(3), longest_m=8.0)))
    assert power[:3, :3].max() < 1e-9 < power[5, 5]
