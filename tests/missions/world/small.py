"""Small worlds for tests: flat ground with boxes on it, and a scanner with a coarse sweep."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from onboard.config import Config, load
from onboard.records import F64, Grid, Pose
from tests.missions.world.world import World

QUICK = {
    "mission.leg_m": 100.0, "scanning.start_rad": 0.9, "scanning.spacing_m": 0.12, "scanning.floor_rad": 0.003,
    "scanning.cap_rad": 0.03, "scanning.range_m": 5.0, "mapping.size_m": 12.0,
}  # fmt: skip
Box = tuple[float, float, float, float]


def quick(**settings: object) -> Config:
    """Return the configuration with the coarse sweep; settings: SECTION__NAME=value over it."""
    return load(None, {**QUICK, **{name.replace("__", "."): value for name, value in settings.items()}})


def world(
    boxes: Sequence[Box] = (),
    goal_m: tuple[float, float] = (3.0, 0.0),
    height_m: Callable[[F64, F64], F64] = lambda x, y: 0.0 * x,
    half_m: float = 5.0,
) -> World:
    """Square ground about the origin, heights by a function, with boxes (x0, y0, x1, y1) of 0.6 m; start at (-2, 0)."""
    count = round(2 * half_m / 0.05)
    grid = Grid(-half_m + 0.025, -half_m + 0.025, 0.05, count, count)
    x, y = np.meshgrid(grid.x0_m + 0.05 * np.arange(count), grid.y0_m + 0.05 * np.arange(count))
    heights = height_m(x, y)
    for x0, y0, x1, y1 in boxes:
        heights = heights + 0.6 * ((x >= x0) & (x <= x1) & (y >= y0) & (y <= y1))
    return World(grid, heights.astype(np.float32), Pose(-2.0, 0.0), goal_m, 1, "small", np.empty((0, 4)))
