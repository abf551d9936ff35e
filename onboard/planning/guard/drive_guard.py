"""Drive guard: checks the scan line ahead against the wheels' tracks and finds the cells that stop the rover.

    line -> levelled on the map -> against the map (change, no return)  \\
                                -> strip map -> step, depth, height      -> bad cells, each with its reason

`10-navigation` section 3. Only cells under the wheels of poses still to come are judged. A finding counts after two
consecutive lines against the map (three if nothing returned), or two evaluations 5 cm apart in the strip. Poses already
driven over never trigger, else one hole next to the trail would stop the rover for ever. All grids are the map window
of the leg's stop.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from onboard import config
from onboard.native.elementary import cos, dist, sin, tan
from onboard.native.linear import inner, product, solve
from onboard.perception.map import ldem, strip_map
from onboard.perception.map.cell_classes import MOST_SPREAD, classify
from onboard.records import F64, Bool, Cloud, Grid, Ldem, Pose, Surface

EVALUATE_M = 0.05  # motion of the line between two evaluations of the strip
WINDOW_M = 5.0  # side of the judged part of the strip, around the rover
BEAMS = 3  # neighbouring beams that must agree
TIMES = 2  # consecutive lines or evaluations that must agree
SILENT_LINES = 3  # the same for beams without a return: a scanner itself loses 3 to 30 neighbours at a time
PLANE_CELLS = 3  # cells of the plane's window to each side: 0.7 m
LEAST_OF_PLANE = 15  # known cells that a plane needs
BELOW_M = 0.02  # heights deeper below the first plane are not in the second
NEWS_M = 0.02  # of step, depth or height beyond the map's own: the accuracy of a pose while driving
LEAST_HITS = 20  # of a judged cell, about one line 1 m ahead: the rim of the strip is one line, which may be wrong
I8 = NDArray[np.int8]
Cells = Sequence[tuple[int, int]]  # (dj, di)
CROSS: Cells = ((0, 0), (0, 1), (0, -1), (1, 0), (-1, 0))  # a cell and its 4 neighbours
SQUARE: Cells = tuple((dj, di) for dj in (-1, 0, 1) for di in (-1, 0, 1))
BESIDE_CROSS: Cells = tuple({(a + c, b + d): None for a, b in SQUARE for c, d in CROSS})  # a CROSS shifted by one cell
_SIDE = np.arange(-PLANE_CELLS, PLANE_CELLS + 1.0)
PLANE_BASIS = np.array([(1.0, row, column) for row in _SIDE for column in _SIDE])
PLANE_SQUARES = (PLANE_BASIS[:, :, None] * PLANE_BASIS[:, None, :]).reshape(-1, 9)
REASONS = ("step", "depth", "height", "change", "no return")


class Bad(NamedTuple):
    """Cell that stops the rover.

    x_m, y_m: its centre.
    why: the reason, one of REASONS.
    """

    x_m: float
    y_m: float
    why: str


@dataclass(frozen=True, slots=True)
class GuardSettings:
    """Parts of the configuration that the guard reads."""

    rover: config.Rover
    mapping: config.Mapping_
    guard: config.DriveGuard


@dataclass(frozen=True, slots=True)
class Watch:
    """State of the guard within one leg.

    surface: the map at the leg's start.
    strip: strip map on the same grid.
    suspects: for each reason, (rows, columns) int8: the number of latest consecutive lines or evaluations that found
        the cell.
    line_m: position of the line at the last evaluation.
    """

    surface: Surface
    strip: Ldem
    suspects: dict[str, I8]
    line_m: tuple[float, float]


def begin(surface: Surface) -> Watch:
    """The guard at the start of a leg, before its first line."""
    nothing = np.zeros(surface.z_mean.shape, np.int8)
    return Watch(surface, ldem.empty(surface.grid), dict.fromkeys(REASONS, nothing), (math.inf, math.inf))


def ahead_m(rover: config.Rover, guard: config.DriveGuard) -> float:
    """Distance from base_link ahead to the line on flat ground."""
    return rover.lidar_x_m + rover.lidar_z_m / tan(guard.tilt_rad)


def hear(watch: Watch, line: Cloud, pose: Pose, tracks: Bool, settings: GuardSettings) -> tuple[Watch, tuple[Bad, ...]]:
    """Process one line; return the new guard state and the cells that stop the rover, row by row; none: drive on.

    line: its beams in the map frame by the estimated `pose`, in the order of their angles.
    tracks: (rows, columns), the cells that wheels of poses still to come roll over.

    Do not call it for a lost frame.
    """
    if not line.hit.any():
        found = {"no return": _silent(line, pose, tracks, watch.surface.grid)}
        return _confirmed(watch, found)
    levelled = strip_map.level(line, watch.surface)
    found = {
        "change": _changed(levelled, tracks, watch.surface.grid, settings.guard.depth_m),
        "no return": _silent(line, pose, tracks, watch.surface.grid),
    }
    watch = replace(watch, strip=strip_map.enter(watch.strip, levelled.cloud))
    at = ahead_m(settings.rover, settings.guard)
    here = (pose.x_m + at * cos(pose.yaw_rad), pose.y_m + at * sin(pose.yaw_rad))
    if dist(here, watch.line_m) >= EVALUATE_M or not math.isfinite(watch.line_m[0]):
        found |= judge(watch, pose, tracks, settings)
        watch = replace(watch, line_m=here)
    return _confirmed(watch, found)


def _confirmed(watch: Watch, found: dict[str, Bool]) -> tuple[Watch, tuple[Bad, ...]]:
    """The new suspect counts, and the cells found in as many consecutive checks as their reason needs."""
    grid, bad, suspects = watch.surface.grid, [], dict(watch.suspects)
    for why, cells in found.items():
        most = SILENT_LINES if why == "no return" else TIMES
        suspects[why] = np.where(cells, np.minimum(suspects[why] + 1, most), 0).astype(np.int8)
        bad += [Bad(*grid.centre(int(j), int(i)), why) for j, i in np.argwhere(suspects[why] == most)]
    return replace(watch, suspects=suspects), tuple(bad)


def _changed(line: strip_map.Line, tracks: Bool, grid: Grid, limit_m: float) -> Bool:
    """Track cells where 3 neighbouring beams of the levelled line lie off the map by more than the limit."""
    ends = line.cloud.ends_m[line.cloud.hit]
    return _runs(np.abs(np.nan_to_num(line.residual_m)) > limit_m, _cells(ends[:, :2], grid), tracks)


def _silent(line: Cloud, pose: Pose, tracks: Bool, grid: Grid) -> Bool:
    """Track cells where 3 neighbouring beams should have met the plane under the wheels and nothing returned."""
    T_map_base = pose.matrix()
    normal, foot = T_map_base[:3, 2], T_map_base[:3, 3]
    ways = line.ends_m - line.origin_m
    down = -product(ways, normal)
    share = np.where(down > 0.0, inner(normal, line.origin_m - foot) / np.where(down > 0.0, down, 1.0), np.inf)
    reaches = ~line.hit & (share < 1.0)
    met = line.origin_m[:2] + np.where(reaches, share, 0.0)[:, None] * ways[:, :2]
    return _runs(reaches, _cells(met, grid), tracks)


def _cells(points_m: NDArray[np.floating], grid: Grid) -> NDArray[np.int64]:
    """(j, i) of points (n, 2), as (2, n); -1 off the grid."""
    i = np.rint((points_m[:, 0] - grid.x0_m) / grid.cell_m).astype(np.int64)
    j = np.rint((points_m[:, 1] - grid.y0_m) / grid.cell_m).astype(np.int64)
    on = (i >= 0) & (i < grid.columns) & (j >= 0) & (j < grid.rows)
    return np.where(on, np.stack([j, i]), -1)


def _runs(struck: Bool, cells: NDArray[np.int64], tracks: Bool) -> Bool:
    """Track cells of flagged beams in a run of at least BEAMS neighbours."""
    padded = np.pad(struck, BEAMS - 1)
    starts = np.logical_and.reduce([padded[k : len(padded) - BEAMS + 1 + k] for k in range(BEAMS)])
    run = np.logical_or.reduce([starts[k : k + len(struck)] for k in range(BEAMS)])
    j, i = cells[:, run & (cells[0] >= 0)]
    found = np.zeros_like(tracks)
    found[j, i] = True
    return found & tracks


def judge(watch: Watch, pose: Pose, tracks: Bool, settings: GuardSettings) -> dict[str, Bool]:
    """One evaluation of the strip: {'step', 'depth', 'height': cells (rows, columns)} among the tracks near the rover.

    Step: of the bias-corrected bounds over a cell and its 4 neighbours, with the plane's slope removed. Depth, height:
    below and above the plane of 0.7 m, which is fitted a second time without heights more than 2 cm below the first
    plane. A value over its limit counts only where it exceeds that of the map at the leg's start by more than NEWS_M,
    compared over one cell more to each side. The plan was made with that map, so a known stone next to a track, or one
    low enough under it, does not stop the rover.
    """
    near = ldem.window(watch.strip, pose.x_m, pose.y_m, WINDOW_M)
    strip = classify(near, settings.mapping, MOST_SPREAD)  # so that noise does not stop the rover
    first = np.array(watch.strip.grid.cell(near.grid.x0_m, near.grid.y0_m))
    cells = np.argwhere(tracks) - first
    cells = cells[((cells >= 0) & (cells < (near.grid.rows, near.grid.columns))).all(axis=1)]
    cells = cells[near.n[tuple(cells.T)] >= LEAST_HITS]
    plane = _planes(_around(strip.z_mean, cells, PLANE_CELLS))  # height, slopes along rows and columns per cell
    high, low = _bounds(strip, cells, plane, CROSS)
    top, bottom = strip.z_top[tuple(cells.T)], strip.z_bot[tuple(cells.T)]
    was_high, was_low = _bounds(watch.surface, cells + first, plane, BESIDE_CROSS)
    was_top, was_bottom = _bounds(watch.surface, cells + first, plane, SQUARE)
    step = high - low
    found = {
        "step": (step > settings.guard.step_m) & ~(step <= was_high - was_low + NEWS_M),
        "depth": (plane[:, 0] - bottom > settings.guard.depth_m) & ~(bottom >= was_bottom - NEWS_M),
        "height": (top - plane[:, 0] > settings.guard.depth_m) & ~(top <= was_top + NEWS_M),
    }
    return {why: _placed(bad, cells + first, tracks.shape) for why, bad in found.items()}


def _bounds(surface: Surface, cells: NDArray[np.int64], plane: F64, among: Cells) -> tuple[F64, F64]:
    """Highest top and lowest bottom among cells around each, slope removed: two (k,), infinite if unknown."""
    reach = max(max(offset) for offset in among)
    of_square = [(2 * reach + 1) * (dj + reach) + di + reach for dj, di in among]
    slope = product(plane[:, 1:], np.array(among, np.float64).T)
    high = _around(surface.z_top, cells, reach)[:, of_square] - slope
    low = _around(surface.z_bot, cells, reach)[:, of_square] - slope
    return np.nanmax(high, axis=1, initial=-np.inf), np.nanmin(low, axis=1, initial=np.inf)


def _planes(squares: F64) -> F64:
    """The plane of each square of heights (k, 49): height at its middle, slopes along rows and columns, (k, 3).

    NaN are left out; a square with fewer than LEAST_OF_PLANE heights has NaN height and no slope.
    """
    first = _fit(squares, np.isfinite(squares))
    residual = squares - product(first, PLANE_BASIS.T)
    return _fit(squares, np.isfinite(squares) & ~(residual < -BELOW_M))


def _fit(squares: F64, used: Bool) -> F64:
    weight, heights = used.astype(np.float64), np.where(used, squares, 0.0)
    normal = product(weight, PLANE_SQUARES).reshape(-1, 3, 3) + 1e-6 * np.eye(3)
    planes = solve(normal, product(heights, PLANE_BASIS))
    planes[used.sum(axis=1) < LEAST_OF_PLANE] = (np.nan, 0.0, 0.0)
    return planes


def _around(grid: NDArray[np.floating], cells: NDArray[np.int64], reach: int) -> F64:
    """The squares around cells (k, 2), NaN beyond the grid: (k, (2 reach + 1) ** 2), row by row."""
    padded = np.pad(grid.astype(np.float64), reach, constant_values=np.nan)
    side = np.arange(2 * reach + 1)
    j, i = cells.T[:, :, None, None]
    square: F64 = padded[j + side[:, None], i + side]
    return square.reshape(len(cells), (2 * reach + 1) ** 2)


def _placed(chosen: Bool, cells: NDArray[np.int64], shape: tuple[int, ...]) -> Bool:
    placed = np.zeros(shape, np.bool_)
    placed[tuple(cells[chosen].T)] = True
    return placed
