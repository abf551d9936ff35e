"""Obstacle put into a field: a trench or a step, straight across a route, 2 m wide."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hil.terrain.field import Field
from onboard.native import elementary
from onboard.records import F32, F64, Bool

ACROSS_M = 2.0


@dataclass(frozen=True, slots=True)
class ObstacleShape:
    """Shape of an obstacle.

    rise_m: change of the height
    along_m: length along the route
    """

    rise_m: float
    along_m: float


@dataclass(frozen=True, slots=True)
class Obstacle:
    """Obstacle of one of KINDS.

    x_m, y_m: middle of its near edge
    yaw_rad: direction of the route that crosses it
    """

    kind: ObstacleShape
    x_m: float
    y_m: float
    yaw_rad: float

    def holds(self, x_m: F64, y_m: F64, margin_m: float = 0.0) -> Bool:
        """True for each point on the obstacle, or within a margin of it."""
        along = self.along_m(x_m, y_m)
        across = elementary.cos(self.yaw_rad) * (y_m - self.y_m) - elementary.sin(self.yaw_rad) * (x_m - self.x_m)
        within: Bool = (along >= -margin_m) & (along <= self.kind.along_m + margin_m)
        return within & (np.abs(across) <= ACROSS_M / 2 + margin_m)

    def along_m(self, x_m: F64, y_m: F64) -> F64:
        """Distance of points beyond the near edge, along the route."""
        return elementary.cos(self.yaw_rad) * (x_m - self.x_m) + elementary.sin(self.yaw_rad) * (y_m - self.y_m)

    def dug(self, field: Field) -> F32:
        """Field's soil heights with the obstacle, (rows, columns)."""
        grid = field.grid
        x = grid.x0_m + np.arange(grid.columns) * grid.cell_m
        y = grid.y0_m + np.arange(grid.rows) * grid.cell_m
        return field.soil_z + np.float32(self.kind.rise_m) * self.holds(x[None, :], y[:, None])
