"""Slip of the rover driving up planes of one soil. Drawn by tools/drawings/soil.py."""

from __future__ import annotations

import math

import numpy as np

from hil.plant.plant import Plant
from hil.records import PlantState, WheelDrive
from hil.terrain.field import Field
from onboard.config import Rover
from onboard.native import elementary
from onboard.records import Gdem, Grid, Pose

SLOPES_DEG = (0.0, 2.5, 5.0, 7.5, 10.0, 12.5, 15.0, 17.5, 20.0, 22.5, 25.0)
RATE_RADPS, WARM_S, DRIVE_S = 1.1, 10.0, 20.0  # soft soil needs some seconds to reach its final slip
LENGTH_M, WIDTH_M, CELL_M = 16.0, 4.0, 0.1
STEP_NS = 5_000_000


def inclined(slope_deg: float) -> Field:
    """Plane that rises along x, through the origin; the start is the origin."""
    rows, columns = round(WIDTH_M / CELL_M) + 1, round(LENGTH_M / CELL_M) + 1
    grid = Grid(-LENGTH_M / 2, -WIDTH_M / 2, CELL_M, rows, columns)
    x_m = grid.x0_m + np.arange(columns) * CELL_M
    z = np.broadcast_to(elementary.tan(math.radians(slope_deg)) * x_m, (rows, columns)).astype(np.float32)
    return Field(grid, z, (), Pose(0.0, 0.0), (2.0, 0.0), Gdem(grid, z.astype(np.float64)), 0, {})


def slip(soil: str, slope_deg: float) -> float:
    """Slip driving straight up: lost share of the wheels' way; 1 if the rover digs in, over 1 if it slides back."""
    plant = Plant(inclined(slope_deg), step_ns=STEP_NS, soil=soil)
    plant.apply((WheelDrive(0.0, RATE_RADPS),) * 4)
    states = [plant.step() for _ in range(round(DRIVE_S * 100))]
    plant.close()
    first, last = states[round(WARM_S * 100)], states[-1]
    moved_m = float(last.position_m[0] - first.position_m[0]) / elementary.cos(math.radians(slope_deg))
    return 1.0 - moved_m / (rolled_m(last) - rolled_m(first))


def rolled_m(state: PlantState) -> float:
    """Mean way of the wheels, m."""
    return Rover().wheel_radius_m * float(np.mean([wheel.position_rad for wheel in state.wheels]))
