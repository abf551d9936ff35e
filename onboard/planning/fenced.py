"""Keep-outs in the planner: their cells become obstacles, in the rover's map and in the orbiter's."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import ndimage

from onboard.config import Rover
from onboard.native import each
from onboard.native.elementary import cos, hypot, sin
from onboard.planning.fences import KEEP_OUT, Fence, Point
from onboard.planning.local.poses import ORIENTATIONS, Freedom
from onboard.records import U8, Bool, Gdem, Grid

MARGIN_M = 0.15  # of a way to a keep-out: headings up to 11 degrees off their orientation, follower error
STAND_M = 0.25  # radius around the rover without the margin, so that it can leave the place it backed off to


def keep_out(fences: Sequence[Fence], grid: Grid) -> Bool:
    """Cells (rows, columns) that a keep-out touches, plus at most half a cell's diagonal."""
    x = grid.x0_m + np.arange(grid.columns) * grid.cell_m
    y = (grid.y0_m + np.arange(grid.rows) * grid.cell_m)[:, None]
    found = np.zeros((grid.rows, grid.columns), np.bool_)
    for fence in fences:
        if fence.kind == KEEP_OUT:
            odd = np.zeros_like(found)
            for (ax, ay), (bx, by) in zip(fence.corners_m, (*fence.corners_m[1:], fence.corners_m[0])):
                if ay != by:
                    odd ^= ((ay > y) != (by > y)) & (x < ax + (y - ay) / (by - ay) * (bx - ax))
                dx, dy = bx - ax, by - ay
                length2 = max(dx * dx + dy * dy, 1e-12)
                share = np.clip(((x - ax) * dx + (y - ay) * dy) / length2, 0.0, 1.0)
                found |= each.hypot(x - ax - share * dx, y - ay - share * dy) <= grid.cell_m * 0.71
            found |= odd
    return found


def fenced(freedom: U8, fences: Sequence[Fence], grid: Grid, rover: Rover, here_m: Point) -> U8:
    """A copy with every pose blocked whose body would touch a keep-out or come nearer to one than MARGIN_M.

    freedom: (8, rows, columns) on the grid.

    Within STAND_M of the rover the margin does not count.
    """
    cells = keep_out(fences, grid)
    if not cells.any():
        return freedom
    x = grid.x0_m + np.arange(grid.columns) * grid.cell_m - here_m[0]
    y = (grid.y0_m + np.arange(grid.rows) * grid.cell_m - here_m[1])[:, None]
    near = each.hypot(x, y) <= STAND_M
    out = freedom.copy()
    for o in range(ORIENTATIONS):
        touched = ndimage.binary_dilation(cells, _body(o, rover, grid.cell_m, 0.0))
        close = ndimage.binary_dilation(cells, _body(o, rover, grid.cell_m, MARGIN_M))
        out[o][touched | (close & ~near)] = Freedom.BLOCKED
    return out


def _body(o: int, rover: Rover, cell_m: float, margin_m: float) -> Bool:
    """Cells of the body at an orientation, relative to base_link: a square of odd side, the same from behind."""
    half_x_m, half_y_m = rover.body_length_m / 2 + margin_m, rover.body_width_m / 2 + margin_m
    reach = math.ceil(hypot(half_x_m, half_y_m) / cell_m)
    at = np.arange(-reach, reach + 1) * cell_m
    x, y = at[None, :], at[:, None]
    yaw = o * np.pi / ORIENTATIONS
    c, s = cos(yaw), sin(yaw)
    along, aside = c * x + s * y, c * y - s * x
    return np.asarray((np.abs(along) <= half_x_m) & (np.abs(aside) <= half_y_m))


def closed(gdem: Gdem, fences: Sequence[Fence]) -> Gdem:
    """The orbiter's map without the cells whose centre lies in a keep-out; the same object if there are none."""
    grid = gdem.grid
    inside = [
        (j, i)
        for j, i in np.argwhere(keep_out(fences, grid)).tolist()
        if any(f.kind == KEEP_OUT and f.distance_m(grid.centre(j, i)) == 0.0 for f in fences)
    ]
    if not inside:
        return gdem
    heights = gdem.heights_m.copy()
    heights[tuple(np.array(inside).T)] = np.nan
    return replace(gdem, heights_m=heights)
