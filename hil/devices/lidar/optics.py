"""Receiver model from true ranges to measured values: noise, codes, echoes, intensity, sector and clusters."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hil.devices.lidar.light import EDGE_M, Light, Surface
from hil.devices.lidar.profile import Profile
from hil.devices.lidar.turns import BEAMS
from protocol import scip

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]
NO_RETURN, TOO_NEAR, INTERFERENCE, LAST_CODE = 1, 2, 3, 22
SHORT_LIMIT = 4095  # largest value in two characters


class Optics:
    """Converter of ranges (1081,), m, inf = nothing there, to values in mm or codes.

    rng: generator of the noise
    light_rng: generator of the light effects
    """

    def __init__(self, profile: Profile, rng: np.random.Generator, light_rng: np.random.Generator) -> None:
        self._profile, self._rng = profile, rng
        self.light = Light(profile, light_rng)
        self.clash_ratio = 0.0  # share of the beams that meet another sensor's light

    @property
    def dropout_ratio(self) -> float:
        """Share of the beams that return nothing."""
        return self.light.dropout_ratio

    @dropout_ratio.setter
    def dropout_ratio(self, ratio: float) -> None:
        self.light.dropout_ratio = ratio

    def measure(self, ranges_m: F64, surface: Surface | None = None) -> I32:
        """Values of one turn, (1081, echoes): nearest echo first, scip.MISSING for no echo.

        surface: surfaces that the beams met, if the owner of the rays knows them.
        """
        light = self.light
        lost = light.lost(ranges_m, surface)
        ranges_m = light.mixed(ranges_m)
        if self._profile.echoes == 1:
            seen_m = light.outliers(ranges_m if lost is None else np.where(lost, np.inf, ranges_m))
            at, speck_m = light.specks()
            if len(at):
                seen_m = seen_m.copy()
                seen_m[at] = np.minimum(seen_m[at], speck_m)
            return self._measured(seen_m)[:, None]
        found = echoes(ranges_m)
        if lost is not None:
            found[lost] = (np.inf, np.nan, np.nan)
        found[:, 0] = light.outliers(found[:, 0])
        at, speck_m = light.specks()
        found[at, 2] = speck_m
        return _ranges_first(np.sort(self._measured(found.ravel()).reshape(BEAMS, 3), axis=1))

    def values(self, asked: scip.ScanRequest, measured: I32) -> I32:
        """Values to send: (beams, channels), for a request of several echoes (beams, echoes, channels)."""
        values = self._arranged(measured, asked)
        if asked.kind.echoes == 1:
            values = values[:, 0]
        if asked.kind.characters == 2:
            values = np.minimum(values, SHORT_LIMIT)
        return np.stack((values, brightness(values)), axis=-1) if asked.kind.intensity else values[..., None]

    def _measured(self, ranges_m: F64) -> I32:
        """Value in mm or code of each range; NaN, no echo, becomes scip.MISSING."""
        profile, count = self._profile, len(ranges_m)
        sigma_m = np.where(ranges_m > 10.0, profile.noise_far_m, profile.noise_near_m)
        noisy_m = ranges_m + self._rng.standard_normal(count) * sigma_m
        seen = ranges_m <= profile.far_m
        values = np.full(count, NO_RETURN, np.int32)
        values[seen] = np.rint(noisy_m[seen] * 1e3).astype(np.int32)
        values[ranges_m < profile.near_m] = TOO_NEAR
        if self.clash_ratio:
            values[self._rng.random(count) < self.clash_ratio] = INTERFERENCE
        np.maximum(values, NO_RETURN, out=values)
        values[np.isnan(ranges_m)] = scip.MISSING
        return values

    def _arranged(self, values: I32, asked: scip.ScanRequest) -> I32:
        """Rows of the requested sector. Of each cluster the row with the smallest range, or code if all are codes."""
        values, width = values[asked.first : asked.last + 1], asked.cluster
        if width <= 1:
            return values
        if self._profile.quirks.cluster_floor and len(values) >= width:
            values = values[: len(values) // width * width]
        order = np.where(values[:, 0] > LAST_CODE, values[:, 0], values[:, 0] + (1 << 20))
        starts = range(0, len(values), width)
        return values[[start + int(np.argmin(order[start : start + width])) for start in starts]]


def brightness(values: I32) -> I32:
    """Intensity that falls with the range; 0 for codes."""
    return np.where(values > TOO_NEAR, 20_000 / (1 + values / 1000), 0).astype(np.int32)


def echoes(ranges_m: F64) -> F64:
    """Up to three ranges a beam, (n, 3), NaN = none: a beam just behind an edge also meets the surface before it."""
    padded = np.concatenate((ranges_m[:1], ranges_m, ranges_m[-1:]))
    found = np.full((len(ranges_m), 3), np.nan)
    found[:, 0] = ranges_m
    for column, beside in ((1, padded[:-2]), (2, padded[2:])):
        nearer = beside < ranges_m - EDGE_M
        if column == 2:
            nearer &= ~(np.abs(beside - found[:, 1]) < EDGE_M)
        found[nearer, column] = beside[nearer]
    found[np.isinf(ranges_m) & ~np.isnan(found[:, 1:]).all(axis=1), 0] = np.nan  # the only echo is the nearer surface
    return found


def _ranges_first(values: I32) -> I32:
    """Rows sorted upwards, with scip.MISSING moved to the end and codes dropped if there is a range."""
    ranks = np.where(values == scip.MISSING, 2, np.where(values > LAST_CODE, 0, 1))
    order = np.argsort(ranks, axis=1, kind="stable")
    made = np.take_along_axis(values, order, axis=1)
    made[:, 1:][made[:, 1:] <= LAST_CODE] = scip.MISSING
    return made
