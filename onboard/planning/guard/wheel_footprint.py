"""Cells that the wheels roll over on a path: watched by the drive guard and checked by the trust range.

They follow from the lattice poses that the planner tests: a wheel's cell and its 8 neighbours. A pose stands for all
places in its cell and all headings within 11.25 degrees, so a wheel may roll over any of the nine.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from onboard import config
from onboard.planning.local.poses import ORIENTATIONS, block, pose_index, wheel_cells
from onboard.records import F64, U8, Bool, Grid

SQUARE = tuple((dj, di) for dj in (-1, 0, 1) for di in (-1, 0, 1))  # a wheel's cell and its 8 neighbours


def wheel_squares(stations: F64, grid: Grid, rover: config.Rover) -> NDArray[np.int64]:
    """(k, 36, 2) cells (j, i) under the four wheels at each of stations (k, 3), neighbours included.

    They may lie off the grid.
    """
    poses = lattice(stations, grid)
    squares = np.array([_squares(o, rover, grid.cell_m) for o in range(ORIENTATIONS)], np.int64)
    return poses[:, None, :2] + squares[poses[:, 2]]


def lattice(stations: F64, grid: Grid) -> NDArray[np.int64]:
    """(k, 3) lattice poses j, i, o nearest to stations (k, 3) of x, y (m), yaw (rad)."""
    found = [pose_index(grid, *(float(part) for part in station)) for station in stations]
    return np.array(found, np.int64).reshape(-1, 3)


def driven(stations: F64, trail: F64, grid: Grid) -> Bool:
    """Flag of each station (k, 3): its lattice pose is one of the trail's (m, 3) (R2)."""
    poses = set(map(tuple, lattice(trail, grid).tolist()))
    return np.array([tuple(pose) in poses for pose in lattice(stations, grid).tolist()], np.bool_)


def tracks(stations: F64, trail: F64, grid: Grid, rover: config.Rover) -> Bool:
    """Cells (rows, columns) under wheels at stations (k, 3) still to come, poses of the trail (m, 3) left out."""
    cells = wheel_squares(stations[~driven(stations, trail, grid)], grid, rover).reshape(-1, 2)
    on = (cells >= 0).all(axis=1) & (cells[:, 0] < grid.rows) & (cells[:, 1] < grid.columns)
    found = np.zeros((grid.rows, grid.columns), np.bool_)
    found[cells[on, 0], cells[on, 1]] = True
    return found


def barred(freedom: U8, points_m: Sequence[tuple[float, float]], grid: Grid, rover: config.Rover) -> U8:
    """A copy with every pose blocked that would put a wheel, or one of its 8 neighbours, on the cell of a point."""
    out = freedom.copy()
    cells = np.array([grid.cell(*point) for point in points_m], np.int64).reshape(-1, 2)
    block(out, cells, lambda o: _squares(o, rover, grid.cell_m))
    return out


def _squares(o: int, rover: config.Rover, cell_m: float) -> list[tuple[int, int]]:
    return [(dj + a, di + b) for dj, di in wheel_cells(o, rover, cell_m) for a, b in SQUARE]
