"""Fractal soil: fractional Brownian motion by spectral synthesis (section 6 of the chapter).

A surface in E = 2 dimensions whose height differences grow with distance to the power H, the Hurst exponent (0 rough to
1 smooth), has the fractal dimension D_f = 3 - H (Eq. 7, 8, 10) and the spectral density (Eq. 9, 11 to 14)

    S(u, v) = sigma^2 / (u^2 + v^2)^(H + 1),    u, v in waves per metre, sigma in m^(1 - H).

On a periodic grid of N x N heights `cell` apart, z = sum of c(u', v') exp(2 pi i (u' x' + v' y') / N) (Eq. 17) with
u' = u N cell (Eq. 18). Each coefficient stands for 1 / (N cell)^2 of the plane of u and v, so that

    E|c|^2 = S / (N cell)^2 = (sigma (N cell)^H / (u'^2 + v'^2)^((H + 1) / 2))^2    (Eq. 15, 16, 20 corrected).

The printed equations have two errors. Eq. 15 divides by N cell once, as for a line; Eq. 20 then has (N cell)^(H + 3/2)
where |F| = (N cell)^2 |c| needs H + 2, and sigma would depend on the size of the map. And u', v' run from 0 to N - 1,
which is not Hermitian (Eq. 19): they are signed here.
"""

from __future__ import annotations

import math

import numpy as np
from scipy import fft

from hil.own_functions import give_to
from onboard.native import each, elementary
from onboard.records import F64

STRIP = 64  # rows


def fractal_heights(
    size: int, cell_m: float, hurst: float, sigma: float, rng: np.random.Generator, longest_m: float = math.inf
) -> F64:
    """Periodic fBm map, (size, size) float64, mean 0 (Eq. 17, 20 corrected; see the module head).

    White noise is filtered: its spectrum is Hermitian, and the half spectrum's u = 0 and Nyquist columns keep their
    power. Waves longer than `longest_m` are omitted, for detail on top of a coarse elevation grid.
    """
    give_to("scipy.fft._pocketfft.pypocketfft")
    spectrum = fft.rfft2(rng.standard_normal((size, size)))
    half = size // 2 + 1
    longest = size * cell_m / longest_m
    law = _powers(np.square(np.arange(half, dtype=np.float64)), longest * longest, -(hurst + 1) / 2)  # mirrored below
    spectrum *= size * sigma * elementary.exp(hurst * elementary.log(size * cell_m))
    spectrum[:half] *= law
    spectrum[half:] *= law[size - half : 0 : -1]
    # axis by axis, in place: without the copy of irfft2
    return fft.irfft(fft.ifft(spectrum, axis=0, overwrite_x=True), n=size, axis=1)


def _powers(squares: F64, least: float, exponent: float) -> F64:
    """(squares[j] + squares[i]) ** exponent, (k, k), and 0 where the sum is `least` or less.

    One half mirrors the other: a power takes five times as long as a copy.
    """
    powers = squares[:, None] + squares
    powers[powers <= least] = np.inf
    for top in range(0, len(squares), STRIP):
        end = top + STRIP
        powers[top:end, top:] = each.exp(exponent * each.log(powers[top:end, top:]))
        powers[end:, top:end] = powers[top:end, end:].T
    return powers
