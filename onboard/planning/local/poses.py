"""Freedom of poses (cell, one of 8 orientations): free, blocked or unknown; and the node sets of the chapter.

Orientation o is the body's axis at o * 22.5 degrees against +x, modulo 180: the rover is symmetric, and the path
decides which end leads. Arrays over poses are (8, rows, columns) = freedom[o, j, i]. Rules: `10-navigation` section 3.

The plane fitted over 0.9 m removes the slope from a wheel's step. A nearby wall bends that plane, and the more so the
more of the wall is known, so a better view would block ground that was free. So two rules need two witnesses: a step
counts if it is too high both with the plane removed and without; the ground is too steep if both the fitted plane at
the centre and the plane of the four wheels are too steep.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from onboard import config
from onboard.kernel_calls import poses as kernel
from onboard.native import each
from onboard.native.elementary import cos, hypot, sin, tan
from onboard.records import F32, F64, U8, Bool, CellClass, Grid, NodeSet, Surface

ORIENTATIONS = 8
PLANE_M = 0.9  # side of the window of the fitted plane
LEAST_OF_PLANE = 20  # known cells that a plane needs, a quarter of its window: with fewer, at a rim, noise makes slopes
CLOSE_M = 0.5  # the soft cost of closeness falls to 0 over this distance
HOLE_M = 0.8  # widest hole whose rim is told from a rock
SIGMAS = 2.0  # of the rover's position: it may be this much nearer to a blocked pose than estimated


class Freedom(IntEnum):
    """Knowledge of a pose."""

    BLOCKED = 0
    UNKNOWN = 1
    FREE = 2


def orientation(yaw_rad: float) -> int:
    """The orientation 0..7 nearest to a yaw (rad, any number of turns)."""
    return round(yaw_rad / (math.pi / ORIENTATIONS)) % ORIENTATIONS


def pose_index(grid: Grid, x_m: float, y_m: float, yaw_rad: float) -> tuple[int, int, int]:
    """(j, i, o) of the pose nearest to a place (m) and yaw (rad); the cell may lie outside the grid."""
    return (*grid.cell(x_m, y_m), orientation(yaw_rad))


def pose_freedom(surface: Surface, rover: config.Rover, planning: config.Planning, tyres: bool = True) -> U8:
    """Freedom of every pose, uint8 of Freedom (8, rows, columns); `10-navigation` section 3.

    Free: every wheel's cell and its 8 neighbours known with steps up to step_m; roll, pitch and slope within their
    limits; no tyre on a cell that stands out (`tall`); and nothing under the body more than under_belly_m above the
    wheel plane, by hits or, over unknown cells that the body may touch, by a beam that passed. Blocked: a known cell
    breaks a rule. Else unknown. Cells beyond the grid are unknown. A known cell has its heights.
    tyres: False leaves out the rule of cells that stand out. Raises ValueError for layers of wrong shape, dtype or
        layout, and for cells so large that the wheels of a pose do not span an area.
    """
    cell_m = surface.grid.cell_m
    limits = kernel.Limits(
        step_m=planning.step_m,
        tilt_ratio=tan(planning.tilt_limit_rad),
        slope_ratio=tan(planning.slope_limit_rad),
        belly_m=planning.under_belly_m,
        plane_half=max(1, round((PLANE_M / cell_m - 1) / 2)),
        plane_cells=LEAST_OF_PLANE,
    )
    freedom = kernel.pose_freedom(surface, footprint(rover, cell_m), limits)
    if not tyres:
        return freedom
    block(freedom, np.argwhere(tall(surface, planning.step_m)), lambda o: tyre_cells(o, rover, cell_m))
    return freedom


def block(freedom: U8, cells: NDArray[np.int64], touched: Callable[[int], Sequence[tuple[int, int]]]) -> None:
    """Block, in place, every pose that touches one of the cells (k, 2) j, i.

    touched: function that returns the touched cells (dj, di) of an orientation.
    """
    _, rows, columns = freedom.shape
    for o in range(ORIENTATIONS):
        at = (cells[:, None, :] - np.array(touched(o), np.int64)).reshape(-1, 2)
        on = (at >= 0).all(axis=1) & (at[:, 0] < rows) & (at[:, 1] < columns)
        freedom[o, at[on, 0], at[on, 1]] = Freedom.BLOCKED


def tall(surface: Surface, step_m: float) -> Bool:
    """Cells that stand out of the ground around them by more than a step, bool (rows, columns): the top of a rock.

    The height counts over the lowest of the 8 neighbours, and over the lowest mean of two opposite cells, one or two
    cells away: on a slope that mean is the height of the cell itself. A mean does not count if just one of its cells
    lies in a hole: at the rim of a hole it is far below the level ground of the other side.
    """
    top, bottom = surface.z_top.astype(np.float64), surface.z_bot.astype(np.float64)
    low = np.pad(bottom, 2, constant_values=np.nan)
    hole = np.pad(filled(bottom, surface.grid.cell_m) - bottom > step_m, 2)
    rows, columns = top.shape

    def beside(layer: NDArray[Any], dj: int, di: int) -> NDArray[Any]:
        return layer[2 + dj : 2 + dj + rows, 2 + di : 2 + di + columns]

    ground, middle = np.full(top.shape, np.inf), np.full(top.shape, np.inf)
    for dj, di in ((0, 1), (1, 0), (1, 1), (1, -1)):
        for far in (1, 2):
            one, other = beside(low, far * dj, far * di), beside(low, -far * dj, -far * di)
            alike = beside(hole, far * dj, far * di) == beside(hole, -far * dj, -far * di)
            middle = np.where(alike, np.fmin(middle, (one + other) / 2), middle)
            if far == 1:
                ground = np.fmin(ground, np.fmin(one, other))
    stands: Bool = (top - ground > step_m) & (top - middle > step_m)
    return stands


def filled(z_m: F64, cell_m: float) -> F64:
    """Heights (rows, columns) with narrow holes filled to the lowest part of their rims; NaN stays NaN.

    A cell rises only if higher ground lies on both sides of it along each of rows, columns and both diagonals, with
    less than about HOLE_M between. Ground between rocks is open to some side and stays as it is. An unknown cell, or
    one off the grid, is no rim.
    """
    straight, across = (2 * math.ceil(HOLE_M / apart_m / 2) + 1 for apart_m in (cell_m, cell_m * math.sqrt(2.0)))
    diagonal = np.eye(across, dtype=np.bool_)
    row = np.ones((1, straight), np.bool_)
    lines: tuple[Bool, ...] = (row, row.T, diagonal, diagonal[::-1])
    known = np.where(np.isnan(z_m), -np.inf, z_m)
    level = np.full(z_m.shape, np.inf)
    for line in lines:
        rims = ndimage.maximum_filter(known, footprint=line, mode="constant", cval=-np.inf)
        level = np.minimum(level, ndimage.minimum_filter(rims, footprint=line, mode="constant", cval=-np.inf))
    full: F64 = np.maximum(z_m, level)
    return full


def trail(freedom: U8, poses: NDArray[np.integer]) -> U8:
    """A copy with the driven poses free (R2).

    poses: (k, 3) integers j, i, o; poses outside the grid are ignored.
    """
    j, i, o = np.asarray(poses, np.int64).reshape(-1, 3).T
    _, rows, columns = freedom.shape
    inside = (j >= 0) & (j < rows) & (i >= 0) & (i < columns)
    marked = freedom.copy()
    marked[o[inside] % ORIENTATIONS, j[inside], i[inside]] = Freedom.FREE
    return marked


def closeness(freedom: U8, planning: config.Planning, cell_m: float, sigma_m: float = 0.0) -> F32:
    """Soft cost ratio >= 0 near blocked poses, float32 (8, rows, columns): a move's cost is multiplied by 1 + ratio.

    The ratio is `closeness_weight` next to a blocked pose of the same orientation, falling linearly to 0 at 0.5 m. It
    is higher by `touching_ratio` where a neighbour cell or the next orientation is blocked: a wheel that passes there
    may brush the foot of a rock, so such a pose is used only if there is no other way. The same addition applies to
    poses nearer to a blocked pose than two sigmas of the rover's position (sigma_m, m). Unknown poses add no cost: an
    optimistic way must not avoid them.
    """
    cells = math.ceil(CLOSE_M / cell_m) + 2
    beyond_m = (np.sqrt(np.arange(cells * cells)) - 1.0) * cell_m  # by the square of the distance in cells
    falloff = planning.closeness_weight * np.clip(1.0 - beyond_m / CLOSE_M, 0.0, 1.0)
    beside = np.arange(len(falloff)) <= 2  # squared cells: the kernel adds touching_ratio there
    falloff += planning.touching_ratio * (~beside & (beyond_m <= SIGMAS * sigma_m))
    return kernel.closeness(freedom, falloff.astype(np.float32), planning.touching_ratio)


def clearance_m(freedom: U8, poses: NDArray[np.integer], cell_m: float) -> NDArray[np.float64]:
    """Distance (k,) of each pose (k, 3) integers j, i, o to the nearest blocked cell of its orientation, at most 0.5 m.

    A neighbour cell is at distance 0. Poses off the grid have the full 0.5 m: nothing near them is known.
    """
    half = math.ceil(CLOSE_M / cell_m) + 1
    dj, di = np.mgrid[-half : half + 1, -half : half + 1].reshape(2, -1)
    beyond_m = np.clip((each.hypot(dj, di) - 1.0) * cell_m, 0.0, CLOSE_M)
    j, i, o = np.asarray(poses, np.int64).reshape(-1, 3).T
    _, rows, columns = freedom.shape
    jj, ii = j[:, None] + dj, i[:, None] + di
    inside = (jj >= 0) & (jj < rows) & (ii >= 0) & (ii < columns)
    around = freedom[o[:, None] % ORIENTATIONS, jj.clip(0, rows - 1), ii.clip(0, columns - 1)]
    return np.asarray(np.where(inside & (around == Freedom.BLOCKED), beyond_m, CLOSE_M).min(axis=1))


def reachable(freedom: U8, j: int, i: int, o: int) -> Bool:
    """Free poses connected with pose (j, i, o) over free poses, bool (8, rows, columns); all False if it is not free.

    Connected by the edges of the pose field: the 8 neighbour cells in the same orientation, the two next orientations.
    The pose must lie on the grid.
    """
    return kernel.reachable(freedom, Freedom.FREE, (j, i, o))


def node_sets(surface: Surface, freedom: U8, reachable_mask: Bool) -> U8:
    """The sets chi of the cells, uint8 of NodeSet (rows, columns); disjoint, their union is the grid (Eq. 2 to 5).

    The first that fits: free (centre of a free pose that the rover can reach), outside, occluded, obstacle. As printed,
    each set is defined by the others; here the beams and `reachable` define them.
    reachable_mask: bool (8, rows, columns).
    """
    free = ((freedom == Freedom.FREE) & reachable_mask).any(axis=0)
    sets = np.full(free.shape, NodeSet.OBSTACLE, np.uint8)
    sets[surface.cell_class == CellClass.OCCLUDED] = NodeSet.OCCLUDED
    sets[surface.cell_class == CellClass.OUTSIDE] = NodeSet.OUTSIDE
    sets[free] = NodeSet.FREE
    return sets


def wheel_cells(o: int, rover: config.Rover, cell_m: float) -> tuple[tuple[int, int], ...]:
    """(dj, di) of the cells under wheels 1 to 4 in orientation o, from the cell of base_link (Eq. 31, 32)."""
    yaw = o * math.pi / ORIENTATIONS
    ahead = (rover.half_wheelbase_m * cos(yaw), rover.half_wheelbase_m * sin(yaw))
    left = (-rover.half_track_m * sin(yaw), rover.half_track_m * cos(yaw))
    corners = ((1, 1), (-1, 1), (-1, -1), (1, -1))
    return tuple(
        (round((a * ahead[1] + b * left[1]) / cell_m), round((a * ahead[0] + b * left[0]) / cell_m)) for a, b in corners
    )


def tyre_cells(o: int, rover: config.Rover, cell_m: float) -> tuple[tuple[int, int], ...]:
    """(dj, di) of the cells that a tyre may touch in orientation o, from base_link anywhere in its cell.

    A tyre is a rectangle a diameter long and a wheel wide. Wheels do not stand in the middle of a cell: a square of 3 x
    3 cells around the nearest one leaves out up to 0.1 m of a tyre.
    """
    yaw = o * math.pi / ORIENTATIONS
    c, s, half = cos(yaw), sin(yaw), cell_m / 2
    reach = math.ceil((hypot(rover.body_length_m, rover.body_width_m) / 2 + cell_m) / cell_m) + 1
    dj, di = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    touched = np.zeros(dj.shape, np.bool_)
    for a, b in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        x = di * cell_m - (c * a * rover.half_wheelbase_m - s * b * rover.half_track_m)
        y = dj * cell_m - (s * a * rover.half_wheelbase_m + c * b * rover.half_track_m)
        spare = half * (abs(c) + abs(s))  # of the rover's own cell, across either side of the tyre
        along = np.abs(c * x + s * y) <= rover.wheel_radius_m + spare
        touched |= along & (np.abs(c * y - s * x) <= rover.wheel_width_m / 2 + spare)
    return tuple((int(j - reach), int(i - reach)) for j, i in np.argwhere(touched))


def steered_cells(o: int, rover: config.Rover, cell_m: float, margin_m: float) -> tuple[tuple[int, int], ...]:
    """(dj, di) of the cells within a margin of a tyre in orientation o, at any steering angle, from base_link.

    In a crab move and in a turn a tyre reaches beyond its place along the body: up to the circle about it.
    """
    yaw = o * math.pi / ORIENTATIONS
    c, s, half = cos(yaw), sin(yaw), cell_m / 2
    circle_m = hypot(rover.wheel_radius_m, rover.wheel_width_m / 2) + margin_m
    reach = math.ceil((hypot(rover.half_wheelbase_m, rover.half_track_m) + circle_m) / cell_m) + 1
    dj, di = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    touched = np.zeros(dj.shape, np.bool_)
    for a, b in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        x = np.abs(di * cell_m - (c * a * rover.half_wheelbase_m - s * b * rover.half_track_m))
        y = np.abs(dj * cell_m - (s * a * rover.half_wheelbase_m + c * b * rover.half_track_m))
        off_m = each.hypot(np.maximum(x - half, 0.0), np.maximum(y - half, 0.0))  # from anywhere in its own cell
        touched |= off_m <= circle_m
    return tuple((int(j - reach), int(i - reach)) for j, i in np.argwhere(touched))


def footprint(rover: config.Rover, cell_m: float) -> kernel.Footprint:
    """The cells under the wheels in each orientation, and row by row those under the body and those it may touch.

    A cell is under the body if its centre is. The body may touch a cell if its centre is within half a cell of the
    body, because a pose represents the whole of its cell.
    """
    reach = math.ceil((hypot(rover.body_length_m, rover.body_width_m) / 2 + cell_m) / cell_m)
    under, touched = (_covered(rover, cell_m, margin_m, reach) for margin_m in (0.0, cell_m / 2))
    o, row = np.nonzero(touched.any(axis=2))
    spans = [at for cells in (under[o, row], touched[o, row]) for at in _span(cells)]
    body = np.column_stack([o, row - reach, *(at - reach for at in spans)])
    wheels = [wheel_cells(o, rover, cell_m) for o in range(ORIENTATIONS)]
    return kernel.Footprint(np.array(wheels, np.int32), body.astype(np.int32))


def _covered(rover: config.Rover, cell_m: float, margin_m: float, reach: int) -> Bool:
    """Cells whose centre lies under the body grown by a margin, (8, dj, di) from -reach on, without gaps along di."""
    di = np.arange(-reach, reach + 1)
    dj, yaws = di[:, None], [o * math.pi / ORIENTATIONS for o in range(ORIENTATIONS)]
    c, s = (np.array([turn(yaw) for yaw in yaws])[:, None, None] for turn in (cos, sin))
    covered: Bool = np.abs((di * c + dj * s) * cell_m) <= rover.body_length_m / 2 + margin_m + 1e-9
    covered &= np.abs((dj * c - di * s) * cell_m) <= rover.body_width_m / 2 + margin_m + 1e-9
    return covered


def _span(rows: Bool) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First and last column set in each of rows (k, n) without gaps; last is before first if none is set."""
    first = rows.argmax(axis=1)
    return first, first + rows.sum(axis=1) - 1
