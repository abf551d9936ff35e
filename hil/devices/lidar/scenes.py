"""Scenes for an emulated scanner without a rover: `SCENES` name -> rays cast exactly.

The scanner is at the origin, x ahead, y to the left, z up. `room`, seen from above at the height of the scanner:

    y  4 +--------------------------+
         |   o post     [ cupboard ]|
         |                          |
         |      S ->        [box]     door, and nothing behind it
         |                          |
      -3 +--------------------------+
        -3                          6  x
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from hil.devices.lidar.sensor import BEAMS, Cast
from hil.devices.lidar.turns import FRONT_STEP, STEPS_A_TURN
from onboard.native import each, elementary

F64 = NDArray[np.float64]


class Scene(Protocol):
    """Surfaces that rays can meet."""

    def cast(self, origin_m: F64, directions: F64) -> F64:
        """Ranges (n,) of rays from one origin (3,) along unit directions (n, 3); inf where nothing is met."""


class Boxes:
    """Boxes (n, 2, 3), lower and upper corners, parallel to the axes: walls, objects, floor."""

    def __init__(self, corners_m: F64) -> None:
        self._low, self._high = corners_m[:, 0], corners_m[:, 1]

    def cast(self, origin_m: F64, directions: F64) -> F64:
        """See Scene. From inside a box a ray meets its far side."""
        with np.errstate(divide="ignore", invalid="ignore"):
            a = (self._low - origin_m) / directions[:, None, :]
            b = (self._high - origin_m) / directions[:, None, :]
        # 0 / 0: a ray within a side's plane; it counts as between the two sides
        enter = np.nan_to_num(np.minimum(a, b), nan=-np.inf, posinf=np.inf, neginf=-np.inf).max(axis=2)
        leave = np.nan_to_num(np.maximum(a, b), nan=np.inf, posinf=np.inf, neginf=-np.inf).min(axis=2)
        hit = (leave >= enter) & (leave >= 0)
        ranges: F64 = np.where(hit, np.where(enter >= 0, enter, leave), np.inf).min(axis=1, initial=np.inf)
        return ranges


def room() -> Scene:
    """Room of 9 m x 7 m with a door; a post 0.08 m to the side of the scanner gives the code for too near."""
    return Boxes(
        np.array(
            [
                [(-3.1, -3.0, -0.5), (-3.0, 4.0, 2.0)],  # wall behind
                [(6.0, -3.0, -0.5), (6.1, -0.5, 2.0)],  # wall ahead, right of the door
                [(6.0, 0.5, -0.5), (6.1, 4.0, 2.0)],  # and left of it
                [(-3.0, 4.0, -0.5), (6.0, 4.1, 2.0)],
                [(-3.0, -3.1, -0.5), (6.0, -3.0, 2.0)],  # wall left, right
                [(-3.0, -3.0, -0.6), (6.0, 4.0, -0.5)],
                [(-3.0, -3.0, 2.0), (6.0, 4.0, 2.1)],  # floor, ceiling
                [(4.0, 3.0, -0.5), (6.0, 4.0, 1.5)],
                [(3.0, -1.0, -0.5), (3.6, -0.3, 0.4)],  # cupboard, box
                [(-0.05, 0.08, -0.5), (0.0, 0.10, 2.0)],  # post
            ],
            np.float64,
        )
    )


def flat() -> Scene:
    """Level ground 0.5 m below, without end: tilt the scanner to see it."""
    return Boxes(np.array([[(-1e4, -1e4, -1.5), (1e4, 1e4, -0.5)]], np.float64))


def empty() -> Scene:
    """Empty space: every beam returns the code of no object."""
    return Boxes(np.empty((0, 2, 3)))


class Terrain:
    """First field of a terrain, seen from 0.5 m above the rover's start."""

    def __init__(self, name: str) -> None:
        from hil.terrain.field import height_at, truth_height
        from hil.terrain.grounds import GROUNDS  # slow to import: not for --help
        from hil.terrain.heightfield import HeightField

        field = GROUNDS[name](1).field
        x_m, y_m = np.array([field.start.x_m]), np.array([field.start.y_m])
        self._place_m = np.array([x_m[0], y_m[0], height_at(field, x_m, y_m)[0] + 0.5])
        self._ground = HeightField(field.grid, truth_height(field))

    def cast(self, origin_m: F64, directions: F64) -> F64:
        """See Scene."""
        return self._ground.cast(origin_m + self._place_m, directions, 60.0)


SCENES: Mapping[str, Callable[[], Scene]] = {
    "room": room, "flat": flat, "empty": empty,
    "fbm": lambda: Terrain("fbm"), "craters": lambda: Terrain("craters"), "real": lambda: Terrain("real"),
}  # fmt: skip


def still(scene: Scene, tilt_rad: float = 0.0) -> Cast:
    """Cast function of a scanner that does not move, its front `tilt_rad` down: the same ranges each turn."""
    angles = (np.arange(BEAMS) - FRONT_STEP) * (2 * np.pi / STEPS_A_TURN)
    flat_x = each.cos(angles)
    cosine, sine = elementary.cos(tilt_rad), elementary.sin(tilt_rad)
    directions = np.column_stack((flat_x * cosine, each.sin(angles), -flat_x * sine))
    ranges_m = scene.cast(np.zeros(3), directions)
    return lambda times_ns: ranges_m.copy()
