"""Patches of another soil on the ground, and which of them each wheel is on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from hil.plant.soil import CLASSES


class Patches:
    """Circles of soil. laid: whether there is one, or was, that wheels must still be told about. changes: so many."""

    def __init__(self) -> None:
        self.laid, self.changes = False, 0
        self._circles: list[tuple[tuple[float, float], float, str]] = []  # centre, radius, soil; the newest counts

    def lay(self, centre_m: tuple[float, float], radius_m: float, soil: str) -> None:
        """One more, from the next tick on. ValueError for a soil that is no row of hil.plant.soil.CLASSES."""
        if soil not in CLASSES:
            raise ValueError(f"soil {soil!r} is not one of {', '.join(CLASSES)}")
        self._circles.append((centre_m, radius_m, soil))
        self.laid = True
        self.changes += 1

    def sweep(self) -> None:
        """Away with them all."""
        self._circles.clear()
        self.changes += 1

    def under(self, links: Sequence[Any], soils: Sequence[str]) -> list[str]:
        """The soil under each wheel: of the newest patch that its centre is over, else its own of `soils`.

        links: one row per wheel as pybullet's getLinkStates tells it, [0] the centre.
        """
        self.laid = bool(self._circles)
        found = []
        for link, own in zip(links, soils):
            x, y, _ = link[0]
            over = [soil for (px, py), radius, soil in self._circles if math.hypot(x - px, y - py) < radius]
            found.append(over[-1] if over else own)
        return found
