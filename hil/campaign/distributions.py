"""Distributions of a plan's knobs, and their draws, which depend on (plan's seed, case, knob) only.

lost_ratio = 0.01                                       fixed
lost_ratio = { fixed = 0.01 }                           the same
lost_ratio = { uniform = [0.0, 0.05] }
lost_ratio = { normal = [0.01, 0.005], low = 0.0 }      truncated; without low or high at 4 sigma
clump_least_beams = { integer = [2, 5] }                both ends included
profile = { choice = ["utm-30lx", "ideal"], weights = [3, 1] }
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import Any, Protocol
from zlib import crc32

import numpy as np

from hil.own_functions import generator
from onboard.config import ConfigError
from onboard.toml_text import shown

SIGMAS = 4.0  # a normal distribution ends here, unless the plan says where
LEAST_SHARE = 0.01  # of a normal distribution's draws, within its ends: a draw takes 100 tries on average


class Distribution(Protocol):
    """Law of one knob. `extremes`: values that must be in the knob's range, so that every draw is."""

    @property
    def extremes(self) -> tuple[Any, ...]:
        """Values to check."""

    def draw(self, rng: np.random.Generator) -> Any:
        """Draw a value."""


@dataclass(frozen=True, slots=True)
class Choice:
    """One of some values, by weights. One value: fixed."""

    values: tuple[Any, ...]
    weights: tuple[float, ...]

    @property
    def extremes(self) -> tuple[Any, ...]:
        """All values."""
        return self.values

    def draw(self, rng: np.random.Generator) -> Any:
        """Draw a value."""
        if len(self.values) == 1:
            return self.values[0]
        bounds = list(accumulate(self.weights))
        at = float(rng.random()) * bounds[-1]
        return next(value for value, bound in zip(self.values, bounds) if at < bound)

    def __str__(self) -> str:
        if len(self.values) == 1:
            return str(self.values[0])
        total = sum(self.weights)
        return ", ".join(f"{value} ({100 * w / total:.3g} %)" for value, w in zip(self.values, self.weights))


@dataclass(frozen=True, slots=True)
class Uniform:
    """Any number between two, or any whole number."""

    low: float
    high: float
    whole: bool = False

    @property
    def extremes(self) -> tuple[float, float]:
        """Both ends."""
        return self.low, self.high

    def draw(self, rng: np.random.Generator) -> float:
        """Draw a value."""
        if self.whole:
            return int(rng.integers(int(self.low), int(self.high), endpoint=True))
        return self.low + float(rng.random()) * (self.high - self.low)

    def __str__(self) -> str:
        return f"{'whole numbers' if self.whole else 'uniform'}, {self.low:g} to {self.high:g}"


@dataclass(frozen=True, slots=True)
class Normal:
    """Normal distribution, truncated to low .. high."""

    mean: float
    sigma: float
    low: float
    high: float

    @property
    def extremes(self) -> tuple[float, float]:
        """Both ends."""
        return self.low, self.high

    @property
    def share(self) -> float:
        """Probability that a draw of the whole distribution lies within the ends."""
        if self.sigma == 0:
            return 1.0
        low, high = (math.erf((end - self.mean) / (math.sqrt(2.0) * self.sigma)) for end in self.extremes)
        return (high - low) / 2

    def draw(self, rng: np.random.Generator) -> float:
        """Draw until a value is in range: LEAST_SHARE of them at least."""
        while True:
            drawn = self.mean + self.sigma * float(rng.standard_normal())
            if self.low <= drawn <= self.high:
                return drawn

    def __str__(self) -> str:
        return f"normal, mean {self.mean:g}, sigma {self.sigma:g}, {self.low:g} to {self.high:g}"


def draw(law: Distribution, seed: int, number: int, knob: str) -> Any:
    """Draw a knob's value in a case. A plan with more knobs draws the same values for the others."""
    return law.draw(generator([seed, number, crc32(knob.encode())]))


def _two(item: Any, what: str) -> tuple[float, float]:
    good = isinstance(item, list) and len(item) == 2 and all(_number(v) for v in item)
    if not good:
        raise ConfigError(f"{what} should be two numbers, found {shown(item)}")
    return item[0], item[1]


def _number(item: Any) -> bool:
    return isinstance(item, int | float) and not isinstance(item, bool) and math.isfinite(item)


def _ends(low: float, high: float, what: str) -> None:
    if low > high:
        raise ConfigError(f"{what} = [{low:g}, {high:g}]: the first should not be above the second")


def _uniform(table: Mapping[str, Any], what: str) -> Distribution:
    low, high = _two(table["uniform"], what)
    _ends(low, high, what)
    return Uniform(float(low), float(high))


def _integer(table: Mapping[str, Any], what: str) -> Distribution:
    low, high = _two(table["integer"], what)
    _ends(low, high, what)
    if not (isinstance(low, int) and isinstance(high, int)):
        raise ConfigError(f"{what} should be two whole numbers, found {shown(table['integer'])}")
    return Uniform(low, high, whole=True)


def _normal(table: Mapping[str, Any], what: str) -> Distribution:
    mean, sigma = _two(table["normal"], what)
    if sigma < 0:
        raise ConfigError(f"{what}: sigma = {sigma:g} should be 0 or more")
    ends = {"low": mean - SIGMAS * sigma, "high": mean + SIGMAS * sigma} | {
        key: table[key] for key in ("low", "high") if key in table
    }
    if not all(map(_number, ends.values())) or not ends["low"] <= mean <= ends["high"]:
        raise ConfigError(f"{what}: low = {shown(ends['low'])}, mean = {mean:g}, high = {shown(ends['high'])}: rising")
    made = Normal(float(mean), float(sigma), float(ends["low"]), float(ends["high"]))
    if made.share < LEAST_SHARE:
        raise ConfigError(
            f"{what}: between low = {made.low:g} and high = {made.high:g} lie {100 * made.share:.2g} % of its draws, "
            f"of {100 * LEAST_SHARE:g} % at least; use uniform = [{made.low:g}, {made.high:g}]"
        )
    return made


def _choice(table: Mapping[str, Any], what: str) -> Distribution:
    values, weights = table["choice"], table.get("weights")
    if not isinstance(values, list) or not values:
        raise ConfigError(f"{what} should be a list of values, found {shown(values)}")
    weights = [1.0] * len(values) if weights is None else weights
    good = isinstance(weights, list) and len(weights) == len(values) and all(_number(w) and w >= 0 for w in weights)
    if not good or not sum(weights) > 0:
        raise ConfigError(f"{what}: weights should be {len(values)} numbers of 0 or more, found {shown(weights)}")
    return Choice(tuple(values), tuple(map(float, weights)))


def _fixed(table: Mapping[str, Any], what: str) -> Distribution:
    return Choice((table["fixed"],), (1.0,))


@dataclass(frozen=True, slots=True)
class Kind:
    """Kind of distribution. also: keys that may stand beside its own."""

    make: Callable[[Mapping[str, Any], str], Distribution]
    also: tuple[str, ...] = ()


KINDS: Mapping[str, Kind] = {
    "uniform": Kind(_uniform),
    "normal": Kind(_normal, ("low", "high")),
    "integer": Kind(_integer),
    "choice": Kind(_choice, ("weights",)),
    "fixed": Kind(_fixed),
}


def is_law(item: Any) -> bool:
    """True for a table that names a distribution, or nearly names one."""
    return isinstance(item, Mapping) and any(difflib.get_close_matches(key, KINDS, n=1, cutoff=0.75) for key in item)


def law_of(item: Any, what: str) -> Distribution:
    """Law of a knob from its value in the plan. what: file and key, for messages. Raises ConfigError."""
    if not isinstance(item, Mapping):
        return Choice((item,), (1.0,))
    names = [key for key in item if key in KINDS]
    if len(names) != 1:
        raise ConfigError(f"{what}: {_which(list(item))}")
    kind = KINDS[names[0]]
    for key in item:
        if key != names[0] and key not in kind.also:
            allowed = ", ".join(kind.also) or "nothing"
            raise ConfigError(f"{what}: unknown key `{key}` beside `{names[0]}`; allowed there: {allowed}")
    return kind.make(item, f"{what}.{names[0]}")


def _which(keys: Sequence[str]) -> str:
    near = [match for key in keys for match in difflib.get_close_matches(key, KINDS, n=1)]
    hint = f"; did you mean `{near[0]}`?" if near else ""
    return f"a distribution is one of {', '.join(KINDS)}, found {', '.join(keys) or 'nothing'}{hint}"
