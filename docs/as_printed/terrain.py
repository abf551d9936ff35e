"""Fractal ground by Eq. 14 to 20 as printed; `hil` has the corrected version."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.records import F64

C128 = NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class Mended:
    """Corrected faults; none: as printed.

    signed: frequencies above N / 2 count as negative.
    per_area: Eq. 15 divides by the map's area (N Delta)^2, so the exponent of Eq. 20 is H + 2 instead of H + 3/2.
    """

    signed: bool = False
    per_area: bool = False


AS_PRINTED = Mended()


def eq_15(heights_m: F64, cell_m: float, mended: Mended = AS_PRINTED) -> F64:
    """Power spectral density of a square map (N, N), over the frequencies in the order of the transform."""
    side_m = len(heights_m) * cell_m
    transform = np.fft.fft2(heights_m) * cell_m**2
    return np.asarray(np.abs(transform) ** 2 / (side_m**2 if mended.per_area else side_m))


def eq_20(size: int, cell_m: float, hurst: float, sigma: float, mended: Mended = AS_PRINTED) -> F64:
    """Amplitude |F| of each frequency, (N, N), row v, column u. The printed infinity at u = v = 0 is set to 0."""
    hat = np.fft.fftfreq(size, 1 / size) if mended.signed else np.arange(size, dtype=np.float64)
    squares = hat[:, None] ** 2 + hat[None, :] ** 2
    squares[0, 0] = np.inf
    exponent = hurst + (2.0 if mended.per_area else 1.5)
    return np.asarray(sigma * (size * cell_m) ** exponent / squares ** ((hurst + 1) / 2))


def eq_17(amplitude: F64, cell_m: float, rng: np.random.Generator) -> C128:
    """Heights (N, N) of random waves with these amplitudes; complex, because nothing in Eq. 20 makes them real.

    The random factors have unit power and obey Eq. 19 themselves.
    """
    size = len(amplitude)
    factors = np.fft.fft2(rng.standard_normal((size, size))) / size
    return np.asarray(np.fft.ifft2(amplitude * factors) / cell_m**2)
