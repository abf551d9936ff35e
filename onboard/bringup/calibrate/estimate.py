"""Estimate of the calibrated values with their sigmas, and of the directions that the drive could not observe."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from onboard.bringup.calibrate.evidence import Evidence
from onboard.bringup.calibrate.model import CALIBRATED, GRIP, Model, believed
from onboard.config import Rover
from onboard.records import F64, Bool

ODD_SIGMAS = 5.0  # a scan farther off the rest was aligned to the wrong rocks
SEEN_RATIO = 0.5  # a direction is observed if the drive alone has a sigma smaller than this share of the configured one


class Value(NamedTuple):
    """Calibrated value of one key of `rover`.

    key: name of the key.
    before: configured value.
    after: estimate.
    sigma: 1 sigma.
    observed: True if the drive, not the configuration, determines it.
    """

    key: str
    before: float
    after: float
    sigma: float
    observed: bool


@dataclass(frozen=True, slots=True)
class Estimate:
    """Result of a calibration.

    values: all keys of CALIBRATED.
    unobserved: directions that keep the configured values, in words.
    misfit: rms of all residuals over their sigmas, about 1 or below if the model is valid.
    grip: weight of the sideways residual of a wheel against the lengthwise one.
    pairs: number of aligned scan pairs in the estimate.
    odd_pairs: number of pairs left out.
    """

    values: tuple[Value, ...]
    unobserved: tuple[str, ...]
    misfit: float
    grip: float
    pairs: int
    odd_pairs: int

    def applied(self, rover: Rover) -> Rover:
        """The rover's configuration with the estimated values."""
        return replace(rover, **{value.key: value.after for value in self.values})


def estimate(evidence: Evidence, before: Rover) -> Estimate:
    """Least squares over all evidence (scipy.optimize.least_squares), starting from the configuration.

    The fit is repeated without the scan pairs that are far off the rest, worst first.
    """
    model, odd_pairs = Model(evidence, before), 0
    found = _fitted(model, model.start())
    while (odd := _odd(model.scans(found.x))).any():
        odd_pairs += int(odd.sum())
        model = Model(replace(model.evidence, pairs=model.evidence.pairs.without(odd)), before)
        found = _fitted(model, found.x)
    measured = len(found.fun) - len(model.belief(found.x))
    misfit = float(np.sqrt((found.fun[:measured] ** 2).mean()))
    scale = max(1.0, misfit)
    spread = np.linalg.inv(found.jac.T @ found.jac)[:GRIP, :GRIP]
    blind = _blind(found.jac[:measured], found.jac[measured:], scale)
    sigmas = scale * np.sqrt(spread.diagonal())
    seen = 1.0 - (blind**2).sum(axis=1)  # share of each configured value that the drive replaces
    values = tuple(
        Value(key, float(then), float(now), float(sigma), bool(share > 1.0 - SEEN_RATIO**2))
        for key, then, now, sigma, share in zip(CALIBRATED, believed(before), found.x, sigmas, seen)
    )
    return Estimate(
        values,
        tuple(_words(column) for column in blind.T),
        misfit,
        float(np.exp(found.x[GRIP])),
        len(model.evidence.pairs.i),
        odd_pairs,
    )


def _fitted(model: Model, start: F64) -> OptimizeResult:
    def residuals(unknowns: F64) -> F64:
        return np.concatenate([model.data(unknowns), model.belief(unknowns)])

    return least_squares(residuals, start, method="lm", x_scale="jac")


def _odd(off: F64) -> Bool:
    """Flags of the pairs that are off by too many sigmas and by at least half as much as the worst."""
    worst = np.abs(off).max(axis=1)
    odd: Bool = worst > max(ODD_SIGMAS, 0.5 * float(worst.max(initial=0.0)))
    return odd


def _blind(data: F64, belief: F64, scale: float) -> F64:
    """(values, k) directions, in units of the configured sigmas, that the data determine no better than SEEN_RATIO."""
    sigmas = np.array(list(CALIBRATED.values()))
    whole, others = data.T @ data, belief[GRIP:].T @ belief[GRIP:]
    information = whole + scale**2 * others  # of the other unknowns, the prior counts
    inner = information[:GRIP, :GRIP] - information[:GRIP, GRIP:] @ np.linalg.solve(
        information[GRIP:, GRIP:], information[GRIP:, :GRIP]
    )
    size, directions = np.linalg.eigh(inner * np.outer(sigmas, sigmas) / scale**2)
    blind: F64 = directions[:, size < 1.0 / SEEN_RATIO**2]
    return blind


def _words(direction: F64) -> str:
    """A direction by its main parts: `+ steer_1 - steer_2 ...`."""
    keys = [key.removesuffix("_m").removesuffix("_rad").removesuffix("_offset") for key in CALIBRATED]
    parts = [(weight, key) for weight, key in zip(direction, keys) if abs(weight) >= 0.3 * np.abs(direction).max()]
    sign = 1.0 if parts[0][0] > 0 else -1.0
    return " ".join(f"{'+' if sign * weight > 0 else '-'} {key}" for weight, key in parts).removeprefix("+ ")
