"""Patches of another soil on the ground, and the resulting soil under each wheel.

A patch has a gradual rim: over EDGE_M inside it the soil changes from the ground's to the patch's. With a sharp rim a
wheel that leaves powder is at once 3 cm deep in firm ground, and is thrown up at 0.27 m/s.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from hil.plant.soil import CLASSES, SoilClass, mixed
from onboard.native import elementary

EDGE_M = 0.3


class Patches:
    """Circles of another soil.

    laid: True if there is a circle, or if the removal of the last one has not reached the wheels yet
    changes: number of changes
    """

    def __init__(self) -> None:
        self.laid, self.changes = False, 0
        self._circles: list[tuple[tuple[float, float], float, str]] = []  # centre, radius, soil; the newest wins

    def lay(self, centre_m: tuple[float, float], radius_m: float, soil: str) -> None:
        """Add a circle, from the next tick on. ValueError for a soil that is no row of hil.plant.soil.CLASSES."""
        if soil not in CLASSES:
            raise ValueError(f"soil {soil!r} is not one of {', '.join(CLASSES)}")
        self._circles.append((centre_m, radius_m, soil))
        self.laid = True
        self.changes += 1

    def sweep(self) -> None:
        """Remove all circles."""
        self._circles.clear()
        self.changes += 1

    def under(self, links: Sequence[Any], soils: Sequence[str]) -> list[SoilClass]:
        """Soil under each wheel's centre: its own of `soils`, overlaid by the patches, the newest last.

        links: one row per wheel as returned by pybullet's getLinkStates, [0] the centre.
        """
        self.laid = bool(self._circles)
        return [self._at(*link[0][:2], CLASSES[own]) for link, own in zip(links, soils)]

    def _at(self, x_m: float, y_m: float, soil: SoilClass) -> SoilClass:
        for (px, py), radius, name in self._circles:
            share = min((radius - elementary.hypot(x_m - px, y_m - py)) / EDGE_M, 1.0)
            if share > 0.0:
                soil = mixed(soil, CLASSES[name], share)
        return soil
