"""Size distributions of rocks: two laws, each a record with one main parameter.

PowerLaw     N(>= D) ~ D^-2 until the rocks cover a given share of the area.
Golombek     the share of the area under rocks of diameter >= D is F_k(D) = k exp(-q(k) D), q(k) = 1.79 + 0.152 / k,
             fitted to rocks at the Viking sites and on Earth (Golombek and Rapp, J. Geophys. Res. 102 (1997) 4117). The
             parameter k is the share under all rocks: about 0.07 at Viking 1 and 0.18 at Viking 2.
A rock's share of the area is its disc, pi / 4 D^2. Both laws are cut at a smallest and a largest diameter.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.special import expn

from hil.own_functions import give_to
from onboard.native import each, elementary
from onboard.records import F64

SMALLEST_M, LARGEST_M = 0.15, 1.2
FULL = 0.5  # above this, rocks that do not overlap find no more room


class RockLaw(Protocol):
    """Law of rock sizes."""

    def diameters_m(self, area_m2: float, rng: np.random.Generator) -> F64:
        """Diameters of the rocks on an area, largest first."""


@dataclass(frozen=True, slots=True)
class PowerLaw:
    """N(>= D) ~ D^-2. area_ratio: share of the area under all rocks."""

    area_ratio: float
    smallest_m: float = SMALLEST_M
    largest_m: float = LARGEST_M

    def __post_init__(self) -> None:
        check_sizes(self.smallest_m, self.largest_m)
        if not 0 <= self.area_ratio < FULL:
            raise ValueError(f"area_ratio should be 0 or more and under {FULL}, found {self.area_ratio}")

    def diameters_m(self, area_m2: float, rng: np.random.Generator) -> F64:
        """Diameters drawn until the rocks' discs fill the share, largest first.

        A rock that would overshoot the target is drawn again, so the few largest cannot spoil the ratio.
        """
        target, total, drawn = area_m2 * self.area_ratio, 0.0, []
        smallest, largest = (1.0 / (edge_m * edge_m) for edge_m in (self.smallest_m, self.largest_m))
        while total < target - math.pi / 4 * self.smallest_m * self.smallest_m:
            diameter = 1.0 / math.sqrt(smallest - rng.random() * (smallest - largest))
            disc = math.pi / 4 * diameter * diameter
            if total + disc <= target:
                drawn.append(diameter)
                total += disc
            elif total > 0.98 * target:
                break
        return np.sort(np.array(drawn))[::-1]


@dataclass(frozen=True, slots=True)
class Golombek:
    """F_k(D) = k exp(-q(k) D) between smallest_m and largest_m; the share of larger rocks is omitted."""

    k: float
    smallest_m: float = SMALLEST_M
    largest_m: float = LARGEST_M

    def __post_init__(self) -> None:
        check_sizes(self.smallest_m, self.largest_m)
        if not 0 < self.k < FULL:
            raise ValueError(f"k should be over 0 and under {FULL}, found {self.k}")

    @property
    def q_per_m(self) -> float:
        """q(k) = 1.79 + 0.152 / k."""
        return 1.79 + 0.152 / self.k

    def area_ratio(self, diameter_m: F64 | float) -> F64 | float:
        """F_k(D): share of the area under rocks of this diameter or larger, without an upper limit."""
        return self.k * each.exp(np.asarray(-self.q_per_m * diameter_m, np.float64))

    def number_per_m2(self, diameter_m: F64 | float) -> F64 | float:
        """Number of rocks of this diameter or larger on a square metre, without an upper limit.

        -dF / (pi / 4 D^2) integrated: 4 k q / pi * E2(q D) / D, where E2 is the exponential integral of order 2.
        """
        give_to("scipy.special._ufuncs")
        return 4 * self.k * self.q_per_m / math.pi * expn(2, self.q_per_m * diameter_m) / diameter_m

    def diameters_m(self, area_m2: float, rng: np.random.Generator) -> F64:
        """Diameters by the law, largest first, one from each of equally probable parts: each field follows the law."""
        logarithms = np.linspace(elementary.log(self.largest_m), elementary.log(self.smallest_m), 1000)
        ladder = each.exp(logarithms)  # 0.2 % a rung
        number = (self.number_per_m2(ladder) - self.number_per_m2(self.largest_m)) * area_m2
        ranks = even_shares(number[-1], rng) * number[-1]
        return each.exp(np.interp(ranks, number, logarithms))


def power(base: F64 | float, exponent: float) -> F64 | float:
    """Positive numbers to any power."""
    if isinstance(base, np.ndarray):
        return each.exp(exponent * each.log(base))
    return elementary.exp(exponent * elementary.log(base))


def even_shares(expected: float, rng: np.random.Generator) -> F64:
    """Stratified random numbers: n numbers of 0..1 in rising order, one in each of n equal parts.

    n is `expected`, randomly rounded. Any function of them has the mean that n independent numbers give, and a far
    smaller scatter.
    """
    count = math.floor(expected + rng.random())
    return (np.arange(count) + rng.random(count)) / max(count, 1)


def check_sizes(smallest_m: float, largest_m: float) -> None:
    """Raise ValueError unless 0 < smallest < largest."""
    if not 0 < smallest_m < largest_m < math.inf:
        raise ValueError(f"diameters should be 0 < smallest_m < largest_m, found {smallest_m} and {largest_m}")
