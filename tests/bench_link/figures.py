"""Figures of a row of `make bench-link`, with their limits and intervals."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.special import stdtrit

Told = Callable[[str], None]  # receives progress


@dataclass(frozen=True)
class Figure:
    """One figure of a promise.

    low, high: 95 % interval over the draws.
    worst: of all seeds, if known.
    limit: bound of value and worst.
    at_least: True: they must be at or above it; False: at or below.
    """

    row: str
    link: str
    what: str
    value: float
    low: float
    high: float
    worst: float
    limit: float
    at_least: bool
    unit: str
    count: int

    @property
    def holds(self) -> bool:
        """True if value and worst are on the right side of the limit."""
        return all(v >= self.limit if self.at_least else v <= self.limit for v in (self.value, self.worst))

    def report(self) -> dict[str, Any]:
        """Return the entry of the JSON file."""
        return {**asdict(self), "holds": self.holds}


def share(row: str, link: str, what: str, hits: int, of: int, limit: float, *, at_least: bool = True) -> Figure:
    """Return a ratio with Wilson's interval; `limit` bounds the ratio."""
    low, high = wilson(hits, of)
    return Figure(row, link, what, hits / of, low, high, hits / of, limit, at_least, "", of)


def count(row: str, link: str, what: str, found: int, limit: int, of: int, *, at_least: bool = False) -> Figure:
    """Return a number of cases with its bound; the interval's high end for 0 of n is Wilson's."""
    low, high = (edge * of for edge in wilson(found, of))
    return Figure(row, link, what, found, low, high, found, limit, at_least, "", of)


def quantile(
    row: str, link: str, what: str, drawn: Sequence[Sequence[float]], q: float, limit: float, unit: str
) -> Figure:
    """Return a quantile of all draws, at or below its limit; its interval comes from resampling whole seeds.

    drawn: one sequence per seed. Draws within a seed share queue and shadow, so they are not resampled one by one.
    """
    rng = np.random.default_rng(1)
    groups = [np.asarray(group, float) for group in drawn if len(group)]
    flat = np.concatenate(groups)
    tries = [
        np.quantile(np.concatenate([groups[i] for i in rng.integers(0, len(groups), len(groups))]), q)
        for _ in range(200)
    ]
    low, high = np.quantile(tries, (0.025, 0.975))
    value = float(np.quantile(flat, q))
    return Figure(row, link, what, value, float(low), float(high), value, limit, False, unit, len(flat))


def mean(
    row: str, link: str, what: str, drawn: Sequence[float], limit: float, unit: str = "", *, at_least: bool = False
) -> Figure:
    """Return a mean over seeds with Student's interval; the limit applies to the worst seed too."""
    values = np.asarray(drawn, float)
    n = len(values)
    half = float(stdtrit(n - 1, 0.975) * values.std(ddof=1) / math.sqrt(n)) if n > 1 else 0.0
    value, worst = float(values.mean()), float(values.min() if at_least else values.max())
    return Figure(row, link, what, value, value - half, value + half, worst, limit, at_least, unit, len(values))


def wilson(hits: int, of: int) -> tuple[float, float]:
    """Return Wilson's 95 % interval of a share (1927)."""
    z2 = 1.96**2
    middle = (hits + z2 / 2) / (of + z2)
    half = 1.96 * math.sqrt(hits * (of - hits) / of + z2 / 4) / (of + z2)
    return max(0.0, middle - half), min(1.0, middle + half)
