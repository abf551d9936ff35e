"""Update of the orbiter's map by the local map: the global path is solved again on it at each stop (Fig. 7).

A cell of the orbiter's map that known cells of the local map cover by half or more takes the mean of their heights. A
cell that is spanned by a lethal obstacle loses its height, which closes it: no passable ground joins two of its sides.
Both maps have one origin; heights are those of the map frame, so the first refresh of a cell also removes the orbiter's
vertical datum there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import ndimage

from onboard.planning.local.poses import Freedom
from onboard.records import F32, U8, Bool, CellClass, Gdem, Grid, Surface

COVERED_RATIO = 0.5
EIGHT = np.ones((3, 3), bool)


def refresh(gdem: Gdem, surface: Surface, freedom: U8, open_m: Sequence[tuple[float, float]] = ()) -> Gdem:
    """The orbiter's map with the cells under the local map's window updated; the same object if none changed.

    surface: the window.
    freedom: (8, rows, columns) uint8 on its grid.
    open_m: places (x, y) whose cells are never closed: a way that begins or ends in a cell need not cross it. Cells are
        compared by their area. A cell of the orbiter's map stays if it is finer than the local map's, or if more than
        half of it lies outside the window.
    """
    heights: F32 = gdem.heights_m.copy()
    known = surface.cell_class >= CellClass.HIT
    passable = (freedom != Freedom.BLOCKED).any(axis=0)
    kept_open = {gdem.grid.cell(*place) for place in open_m}
    for j, i in np.argwhere(_overlapping(gdem.grid, surface.grid)):
        part = _part(gdem.grid, surface.grid, int(j), int(i))
        side = gdem.grid.cell_m / surface.grid.cell_m
        if known[part].sum() >= COVERED_RATIO * side * side:
            heights[j, i] = np.float32(surface.z_mean[part][known[part]].mean(dtype=np.float64))
        covered = passable[part].size >= COVERED_RATIO * side * side
        if covered and (j, i) not in kept_open and _spanned(passable[part]):
            heights[j, i] = np.nan
    return gdem if np.array_equal(heights, gdem.heights_m, equal_nan=True) else replace(gdem, heights_m=heights)


def _overlapping(coarse: Grid, fine: Grid) -> Bool:
    """Cells of the coarse grid that share ground with the fine one, (rows, columns)."""

    def axis(first_m: float, count: int, low_m: float, high_m: float) -> Bool:
        centres = first_m + np.arange(count) * coarse.cell_m
        half = coarse.cell_m / 2
        return np.asarray((centres + half > low_m) & (centres - half < high_m))

    edge = fine.cell_m / 2
    columns = axis(coarse.x0_m, coarse.columns, fine.x0_m - edge, fine.x0_m + fine.columns * fine.cell_m - edge)
    rows = axis(coarse.y0_m, coarse.rows, fine.y0_m - edge, fine.y0_m + fine.rows * fine.cell_m - edge)
    return np.asarray(rows[:, None] & columns[None, :])


def _part(coarse: Grid, fine: Grid, j: int, i: int) -> tuple[slice, slice]:
    """The fine cells whose centres lie in a coarse cell, cut at the fine grid's border."""
    x_m, y_m = coarse.centre(j, i)

    def span(centre_m: float, first_m: float, count: int) -> slice:
        low = np.ceil((centre_m - coarse.cell_m / 2 - first_m) / fine.cell_m - 1e-9)
        high = np.ceil((centre_m + coarse.cell_m / 2 - first_m) / fine.cell_m - 1e-9)
        return slice(int(np.clip(low, 0, count)), int(np.clip(high, 0, count)))

    return span(y_m, fine.y0_m, fine.rows), span(x_m, fine.x0_m, fine.columns)


def _spanned(passable: Bool) -> bool:
    """True if no piece of passable ground touches two sides of the cell."""
    labels, _ = ndimage.label(passable, EIGHT)
    sides = [set(side[side > 0].tolist()) for side in (labels[0], labels[-1], labels[:, 0], labels[:, -1])]
    return not any(sides[a] & sides[b] for a in range(4) for b in range(a))
