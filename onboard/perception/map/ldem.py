"""Local digital elevation map: beams are inserted, the map grows along the way, the planner reads a window of it.

`10-navigation` section 3. Every function returns a new Ldem; cells never move against the map frame, so nothing is
resampled.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import DTypeLike

from onboard.kernel_calls import raster
from onboard.records import Bool, Cloud, Grid, Ldem, Pose

BLOCK_M = 5.0  # the map grows by whole blocks of this side
LEAST_KNOWN_RATIO = 0.25  # cells between the lines of a coarse sweep get no hit
REPLACING_HITS = 3  # R3: with this many near hits the newest scan replaces older values
ROBUST_HITS = 8  # from this many hits on, a scan's highest and lowest hit are ignored, against a wrong range

LAYERS: tuple[tuple[str, DTypeLike, float], ...] = (
    ("n", np.int32, 0),
    ("sum_z", np.float64, 0.0),
    ("sum_z2", np.float64, 0.0),
    ("z_hi", np.float32, np.nan),
    ("z_lo", np.float32, np.nan),
    ("sum_sigma", np.float32, 0.0),
    ("z_ray", np.float32, np.inf),
    ("view_m", np.float32, np.inf),
    ("stop", np.int16, -1),
    ("assumed_z", np.float32, np.nan),
)  # name, dtype, value of an unseen cell


def grid_around(x_m: float, y_m: float, size_m: float, cell_m: float) -> Grid:
    """The square grid of `size_m` whose cell (rows // 2, columns // 2) contains the point."""
    count = max(1, round(size_m / cell_m))
    first_i, first_j = math.floor(x_m / cell_m) - count // 2, math.floor(y_m / cell_m) - count // 2
    return lattice_grid(first_j, first_i, count, count, cell_m)


def empty(grid: Grid) -> Ldem:
    """A map without any observation."""
    shape = (grid.rows, grid.columns)
    layers: dict[str, Any] = {name: np.full(shape, unseen, dtype) for name, dtype, unseen in LAYERS}
    return Ldem(grid=grid, **layers)


def insert(ldem: Ldem, cloud: Cloud, stop: int, near_m: float) -> Ldem:
    """The map with the beams of one scan added, merged by rule R3.

    A cell with at least 3 hits from nearer than `near_m` (horizontal, m) in this scan takes the values of this scan
    alone, z_ray too. Elsewhere, and where the nearest view is already from this stop, counts and sums are added and
    bounds widen. A cell's bounds are the highest and the lowest hit of a scan; with 8 hits or more, the second highest
    and the second lowest. Beams are cut at the border of the grid: call `grow` first.
    """
    new = raster.rasterise(ldem.grid, cloud)
    many = new.n >= ROBUST_HITS
    z_hi, z_lo = np.where(many, new.z_hi2, new.z_hi), np.where(many, new.z_lo2, new.z_lo)
    alone: Bool = (new.n >= REPLACING_HITS) & (new.view_m < near_m) & (ldem.stop != stop)
    nearer: Bool = alone | (new.view_m < ldem.view_m)
    return Ldem(
        grid=ldem.grid,
        n=np.where(alone, new.n, ldem.n + new.n),
        sum_z=np.where(alone, new.sum_z, ldem.sum_z + new.sum_z),
        sum_z2=np.where(alone, new.sum_z2, ldem.sum_z2 + new.sum_z2),
        z_hi=np.where(alone, z_hi, np.fmax(ldem.z_hi, z_hi)),
        z_lo=np.where(alone, z_lo, np.fmin(ldem.z_lo, z_lo)),
        sum_sigma=np.where(alone, new.sum_sigma, ldem.sum_sigma + new.sum_sigma),
        z_ray=np.where(alone, new.z_ray, np.minimum(ldem.z_ray, new.z_ray)),
        view_m=np.where(nearer, new.view_m, ldem.view_m),
        stop=np.where(nearer, np.int16(stop), ldem.stop),
        assumed_z=ldem.assumed_z,
    )


def grow(ldem: Ldem, x_m: float, y_m: float, half_size_m: float) -> Ldem:
    """The map, extended by whole blocks of 5 m where less than `half_size_m` plus one cell lie around the point.

    Returned unchanged if it is large enough.
    """
    grid = ldem.grid
    block = max(1, round(BLOCK_M / grid.cell_m))
    first_j, first_i = first_cell(grid)
    j, i = math.floor(y_m / grid.cell_m) - first_j, math.floor(x_m / grid.cell_m) - first_i  # the same on any grid
    around = math.ceil(half_size_m / grid.cell_m) + 1
    below, above = _blocks(around - j, block), _blocks(j + around + 1 - grid.rows, block)
    left, right = _blocks(around - i, block), _blocks(i + around + 1 - grid.columns, block)
    if not (below or above or left or right):
        return ldem
    rows, columns = grid.rows + below + above, grid.columns + left + right
    return crop(ldem, lattice_grid(first_j - below, first_i - left, rows, columns, grid.cell_m))


def window(ldem: Ldem, x_m: float, y_m: float, size_m: float) -> Ldem:
    """The square of `size_m` whose cell (rows // 2, columns // 2) contains the point; unseen beyond the map (Eq. 1)."""
    return crop(ldem, grid_around(x_m, y_m, size_m, ldem.grid.cell_m))


def paste(ldem: Ldem, part: Ldem) -> Ldem:
    """The map with its cells replaced by those of `part`. Raises ValueError if the part is not within the map."""
    (first_j, first_i), (at_j, at_i) = first_cell(ldem.grid), first_cell(part.grid)
    j, i, rows, columns = at_j - first_j, at_i - first_i, part.grid.rows, part.grid.columns
    if min(j, i) < 0 or j + rows > ldem.grid.rows or i + columns > ldem.grid.columns:
        raise ValueError(f"the part {part.grid} is not within the map {ldem.grid}")
    layers: dict[str, Any] = {}
    for name, _, _ in LAYERS:
        layers[name] = getattr(ldem, name).copy()
        layers[name][j : j + rows, i : i + columns] = getattr(part, name)
    return Ldem(grid=ldem.grid, **layers)


def knows(ldem: Ldem, x_m: float, y_m: float, radius_m: float) -> bool:
    """True if enough cells within `radius_m` of the point are hit or assumed to know the ground under a rover there."""
    part = window(ldem, x_m, y_m, 2.0 * (radius_m + ldem.grid.cell_m))
    dx = part.grid.x0_m + np.arange(part.grid.columns) * part.grid.cell_m - x_m
    dy = (part.grid.y0_m + np.arange(part.grid.rows) * part.grid.cell_m - y_m)[:, None]
    known = ((part.n > 0) | np.isfinite(part.assumed_z))[dx * dx + dy * dy <= radius_m * radius_m]
    return int(known.sum()) > LEAST_KNOWN_RATIO * known.size


def assume_disc(ldem: Ldem, pose: Pose, radius_m: float) -> Ldem:
    """The map with the plane under the wheels assumed within `radius_m` (R1); only cells without hits use it."""
    grid, (nx, ny, nz) = ldem.grid, pose.matrix()[:3, 2]
    dx = grid.x0_m + np.arange(grid.columns) * grid.cell_m - pose.x_m
    dy = (grid.y0_m + np.arange(grid.rows) * grid.cell_m - pose.y_m)[:, None]
    plane = pose.z_m - (nx * dx + ny * dy) / nz
    assumed = np.where(dx * dx + dy * dy <= radius_m * radius_m, plane, ldem.assumed_z).astype(np.float32)
    layers = {name: getattr(ldem, name) for name, _, _ in LAYERS}
    return Ldem(grid=grid, **{**layers, "assumed_z": assumed})


def _blocks(missing: int, block: int) -> int:
    return block * -(-max(0, missing) // block)


def first_cell(grid: Grid) -> tuple[int, int]:
    """(j, i) of cell (0, 0) counted from the origin of the map frame; the centre of cell k is at (k + 1/2) * cell."""
    return round(grid.y0_m / grid.cell_m - 0.5), round(grid.x0_m / grid.cell_m - 0.5)


def lattice_grid(first_j: int, first_i: int, rows: int, columns: int, cell_m: float) -> Grid:
    """The grid that begins at cell (first_j, first_i) of the lattice."""
    return Grid((first_i + 0.5) * cell_m, (first_j + 0.5) * cell_m, cell_m, rows, columns)


def crop(ldem: Ldem, grid: Grid) -> Ldem:
    """The cells of `ldem` on `grid`, copied; unseen outside the map. Both grids have the same cells."""
    (old_j, old_i), (new_j, new_i) = first_cell(ldem.grid), first_cell(grid)
    low_j, high_j = max(old_j, new_j), min(old_j + ldem.grid.rows, new_j + grid.rows)
    low_i, high_i = max(old_i, new_i), min(old_i + ldem.grid.columns, new_i + grid.columns)
    made = empty(grid)
    if low_j < high_j and low_i < high_i:
        for name, _, _ in LAYERS:
            getattr(made, name)[low_j - new_j : high_j - new_j, low_i - new_i : high_i - new_i] = getattr(ldem, name)[
                low_j - old_j : high_j - old_j, low_i - old_i : high_i - old_i
            ]
    return made
