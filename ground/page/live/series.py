"""Short history of every item in memory of fixed size, for plots; and the rover's trail."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from ground.link.news import Item
from protocol.tables.telemetry import TABLE

LENGTH = 1800  # values of one item: 15 minutes at 2 Hz
MOST_PLACES, STEP_M = 20_000, 0.05
F64 = NDArray[np.float64]


class Series:
    """Rings of UTC in s and value, one for each item."""

    def __init__(self, length: int = LENGTH) -> None:
        self._rows = {row.name: at for at, row in enumerate(TABLE)}
        self._kept = np.full((len(TABLE), 2, length), np.nan)
        self._next = np.zeros(len(TABLE), int)
        self._newest = np.full(len(TABLE), -1, np.int64)

    def add(self, items: Mapping[str, Item], utc_s_of: Mapping[str, float]) -> None:
        """Add the items that are newer than the last of their ring. utc_s_of: UTC of each measurement, s."""
        for name, item in items.items():
            row = self._rows.get(name)
            if row is not None and item.onboard_ns != self._newest[row]:
                self._newest[row] = item.onboard_ns
                self._put(row, utc_s_of[name], item.value)

    def seed(self, name: str, values: Iterable[tuple[float, float]]) -> None:
        """Add values of the archive, in order of time."""
        for utc_s, value in values:
            self._put(self._rows[name], utc_s, value)

    def _put(self, row: int, utc_s: float, value: float) -> None:
        at = self._next[row] % self._kept.shape[2]
        self._kept[row, :, at] = utc_s, value
        self._next[row] += 1

    def of(self, name: str) -> F64:
        """Return (n, 2) UTC in s and value of an item, in order. Raises KeyError for an unknown one."""
        row = self._rows[name]
        count, length = self._next[row], self._kept.shape[2]
        kept = self._kept[row].T
        return kept[:count].copy() if count <= length else np.roll(kept, -(count % length), axis=0)

    def count(self, name: str) -> int:
        """Return how many values of an item there were so far, also those that the ring has lost."""
        return int(self._next[self._rows[name]])

    def since(self, name: str, count: int) -> F64:
        """Return (n, 2) as `of` the values after the first `count` ones, as far as the ring has them."""
        fresh = min(self.count(name) - count, self._kept.shape[2])
        row, length = self._rows[name], self._kept.shape[2]
        return self._kept[row][:, np.arange(self.count(name) - fresh, self.count(name)) % length].T


class Trail:
    """Places of the rover at least 5 cm apart, in this boot and those of the archive's newest boot.

    boot_id: a new one begins a new trail. begun: counts the trails.
    """

    def __init__(self, places_m: Iterable[tuple[float, float]] = ()) -> None:
        self.places: list[tuple[float, float]] = list(places_m)
        self.begun, self._boot_id = 0, 0

    def add(self, x_m: float, y_m: float, boot_id: int) -> None:
        """Add a place if it is far enough from the last."""
        if self._boot_id not in (0, boot_id):
            self.places, self.begun = [], self.begun + 1
        self._boot_id = boot_id
        if not (math.isfinite(x_m) and math.isfinite(y_m)):
            return
        if self.places and math.dist(self.places[-1], (x_m, y_m)) < STEP_M:
            return
        if len(self.places) >= MOST_PLACES:
            self.places, self.begun = self.places[::2], self.begun + 1
        self.places.append((x_m, y_m))
