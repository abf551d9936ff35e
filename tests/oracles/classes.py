"""Vectorised numpy twins of the kernels of cell classes and poses: the flight code before there were kernels.

Also the reference of the bench row cell-classes. The rules are told where the flight code is.
"""

from __future__ import annotations

import math
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.sparse import coo_array, csgraph

from onboard import config
from onboard.perception.map.cell_classes import (
    FILL_ABOVE_M,
    FILL_STEP_M,
    FILL_STEP_PER_CELL_M,
    HOLE_DEPTH_M,
    RAY_MARGIN_M,
    SPREAD,
)
from onboard.planning.local.poses import CLOSE_M, LEAST_OF_PLANE, ORIENTATIONS, PLANE_M, Freedom, wheel_cells
from onboard.records import F32, F64, U8, Bool, CellClass, Ldem, Surface

T = TypeVar("T", bound=np.generic)
DIRECTIONS = ((0, 1), (1, 0), (1, 1), (1, -1))  # rows, columns, both diagonals: (dj, di)
SQUARE = tuple((dj, di) for dj in (-1, 0, 1) for di in (-1, 0, 1))


def classify(ldem: Ldem, mapping: config.Mapping_) -> Surface:
    """What perception.map.cell_classes.classify gives."""
    hit = ldem.n > 0
    mean, top, bottom = _bounds(ldem, hit)
    gap = _gaps(hit, mean, ldem.z_ray, mapping.fill_cells)
    assumed = ~hit & ~gap.hole & ~gap.filled & np.isfinite(ldem.assumed_z)

    classes = np.where(np.isfinite(ldem.z_ray), np.uint8(CellClass.OCCLUDED), np.uint8(CellClass.OUTSIDE))
    z_mean = np.where(hit, mean, np.nan)
    for chosen, kind, height in (
        (assumed, CellClass.ASSUMED, ldem.assumed_z),
        (gap.filled, CellClass.FILLED, gap.height),
        (gap.hole, CellClass.HOLE, ldem.z_ray),
    ):
        classes[chosen] = kind
        z_mean[chosen] = height[chosen]
    classes[hit] = CellClass.HIT
    return Surface(
        grid=ldem.grid,
        cell_class=classes,
        z_mean=z_mean.astype(np.float32),
        z_top=np.where(hit, top, z_mean).astype(np.float32),
        z_bot=np.where(hit, bottom, z_mean).astype(np.float32),
        z_ray=ldem.z_ray,
    )


def _bounds(ldem: Ldem, hit: Bool) -> tuple[F64, F64, F64]:
    """Mean, z_top and z_bot of the hit cells, NaN elsewhere; the spread that noise makes of n hits is taken out."""
    n = np.where(hit, ldem.n, 1)
    mean = np.where(hit, ldem.sum_z / n, np.nan)
    bias = ldem.sum_sigma / n * SPREAD[np.minimum(n, len(SPREAD) - 1)]
    low = np.minimum(ldem.z_lo, ldem.z_ray + np.float32(RAY_MARGIN_M))
    return mean, np.maximum(mean, ldem.z_hi - bias), np.minimum(mean, low + bias)


class _Gaps(NamedTuple):
    filled: Bool
    hole: Bool
    height: F64  # of filled cells: mean over the directions that fit


def _gaps(hit: Bool, mean: F64, z_ray: F32, fill_cells: int) -> _Gaps:
    """Cells without a hit between hits at most `fill_cells` missing cells apart, along any of four directions.

    A hole proved along one direction outweighs a fill along another: its surface, z_ray, lies within the fill's bounds
    then or is the danger itself.
    """
    hole, total, count = np.zeros_like(hit), np.zeros(hit.shape), np.zeros(hit.shape, np.int32)
    pad = max(1, fill_cells)
    heights = np.pad(mean, pad, constant_values=np.nan)
    for direction in DIRECTIONS:
        waiting = ~hit
        for missing in range(1, fill_cells + 1):
            for before in range(1, missing + 1):
                after = missing + 1 - before
                low, high = _at(heights, -before, direction, pad), _at(heights, after, direction, pad)
                bracketed = waiting & np.isfinite(low) & np.isfinite(high)
                waiting &= ~bracketed
                middle = low + (high - low) * (before / (missing + 1))
                even = bracketed & (np.abs(high - low) <= FILL_STEP_M + FILL_STEP_PER_CELL_M * missing)
                hole |= even & (z_ray < middle - HOLE_DEPTH_M)
                fits = even & (z_ray >= middle - RAY_MARGIN_M) & (z_ray <= middle + FILL_ABOVE_M)
                total += np.where(fits, middle, 0.0)
                count += fits
    return _Gaps((count > 0) & ~hole, hole, total / np.maximum(count, 1))


def _at(padded: F64, steps: int, direction: tuple[int, int], pad: int) -> F64:
    """The neighbour that lies `steps` in `direction` of every cell of the unpadded grid."""
    dj, di, (rows, columns) = steps * direction[0], steps * direction[1], padded.shape
    return padded[pad + dj : rows - pad + dj, pad + di : columns - pad + di]


class _Ground(NamedTuple):
    """What the pose rules ask of each cell, (rows, columns)."""

    z: F32  # height a wheel stands on, NaN where unknown
    whole: Bool  # the cell and its 8 neighbours are known
    rough: Bool  # the step over those of them that are known is too high
    steep: Bool  # the fitted plane is too steep
    top: F32  # highest of a known cell, -inf where unknown
    ray: F32  # lowest beam over an unknown cell, -inf where known


def pose_freedom(surface: Surface, rover: config.Rover, planning: config.Planning) -> U8:
    """What planning.local.poses.pose_freedom gives."""
    ground = _ground(surface, planning)
    return np.stack([_layer(ground, o, rover, planning, surface.grid.cell_m) for o in range(ORIENTATIONS)])


def closeness(freedom: U8, planning: config.Planning, cell_m: float) -> F32:
    """What planning.local.poses.closeness gives."""
    ratio = np.zeros(freedom.shape, np.float32)
    for layer, open_poses in zip(ratio, freedom != Freedom.BLOCKED):
        if open_poses.all():
            continue
        beyond_m = (ndimage.distance_transform_edt(open_poses) - 1.0) * cell_m
        layer[:] = planning.closeness_weight * np.clip(1.0 - beyond_m / CLOSE_M, 0.0, 1.0)
    blocked = freedom == Freedom.BLOCKED
    beside = ndimage.binary_dilation(blocked, np.ones((1, 3, 3), bool))
    beside |= np.roll(blocked, 1, axis=0) | np.roll(blocked, -1, axis=0)
    ratio[beside] += planning.touching_ratio
    return ratio


def reachable(freedom: U8, j: int, i: int, o: int) -> Bool:
    """What planning.local.poses.reachable gives."""
    free = freedom == Freedom.FREE
    if not free[o, j, i]:
        return np.zeros_like(free)
    structure = np.zeros((3, 3, 3), np.bool_)
    structure[1], structure[:, 1, 1] = True, True
    labels, count = ndimage.label(free, structure)
    seam = free[0] & free[-1]  # orientation 7 turns on to 0
    pairs = (labels[0][seam], labels[-1][seam])
    graph = coo_array((np.ones(int(seam.sum()), np.int8), pairs), shape=(count + 1, count + 1))
    _, group = csgraph.connected_components(graph, directed=False)
    same: Bool = group == group[labels[o, j, i]]
    same[0] = False
    return same[labels]


def body_cells(o: int, rover: config.Rover, cell_m: float, margin_m: float = 0.0) -> tuple[tuple[int, int], ...]:
    """(dj, di) of the cells whose centre lies under the body in orientation o, or up to a margin beside it."""
    yaw = o * math.pi / ORIENTATIONS
    reach = math.ceil(math.hypot(rover.body_length_m, rover.body_width_m) / 2 / cell_m) + 1
    length_m, width_m = (side_m / 2 + margin_m + 1e-9 for side_m in (rover.body_length_m, rover.body_width_m))
    found = []
    for dj in range(-reach, reach + 1):
        for di in range(-reach, reach + 1):
            along = (di * math.cos(yaw) + dj * math.sin(yaw)) * cell_m
            across = (dj * math.cos(yaw) - di * math.sin(yaw)) * cell_m
            if abs(along) <= length_m and abs(across) <= width_m:
                found.append((dj, di))
    return tuple(found)


def _layer(ground: _Ground, o: int, rover: config.Rover, planning: config.Planning, cell_m: float) -> U8:
    """Freedom of every cell in one orientation, (rows, columns)."""
    wheels = wheel_cells(o, rover, cell_m)
    whole = np.logical_and.reduce([_moved(ground.whole, at, False) for at in wheels])
    blocked = np.logical_or.reduce([_moved(ground.rough, at, False) for at in wheels])
    heights = [_moved(ground.z, at, np.float32(np.nan)) for at in wheels]
    middle, slope_x, slope_y = _wheel_plane(heights, wheels)  # slopes in metres per cell

    yaw = o * math.pi / ORIENTATIONS
    along = (slope_x * math.cos(yaw) + slope_y * math.sin(yaw)) / cell_m
    across = (slope_y * math.cos(yaw) - slope_x * math.sin(yaw)) / cell_m
    tilt = math.tan(planning.tilt_limit_rad)
    blocked |= (np.abs(along) > tilt) | (np.abs(across) > tilt)
    blocked |= ground.steep & (np.hypot(along, across) > math.tan(planning.slope_limit_rad))

    highest = np.full(middle.shape, -np.inf, np.float32)  # over the wheels' plane, known cells
    vouched = highest.copy()  # the same, beams over unknown cells
    for dj, di in body_cells(o, rover, cell_m):
        plane = slope_x * np.float32(di) + slope_y * np.float32(dj)
        np.fmax(highest, _moved(ground.top, (dj, di), np.float32(-np.inf)) - plane, out=highest)
    for dj, di in body_cells(o, rover, cell_m, cell_m / 2):
        plane = slope_x * np.float32(di) + slope_y * np.float32(dj)
        np.maximum(vouched, _moved(ground.ray, (dj, di), np.float32(np.inf)) - plane, out=vouched)
    limit = middle + np.float32(planning.under_belly_m)
    blocked |= highest > limit  # False where a wheel's height is unknown
    layer = np.full(middle.shape, Freedom.UNKNOWN, np.uint8)
    layer[whole & (vouched <= limit)] = Freedom.FREE
    layer[blocked] = Freedom.BLOCKED
    return layer


def _wheel_plane(heights: list[F32], wheels: tuple[tuple[int, int], ...]) -> tuple[F32, F32, F32]:
    """Least-squares plane through the wheels: height at the centre, slopes along +x and +y per cell; NaN where unknown.

    The wheels lie in pairs opposite each other (1 and 3, 2 and 4), so the plane follows each pair's own difference.
    """
    (y1, x1), (y2, x2) = wheels[0], wheels[1]
    first, second = (heights[0] - heights[2]) * np.float32(0.5), (heights[1] - heights[3]) * np.float32(0.5)
    per_area = np.float32(1.0 / (x1 * y2 - x2 * y1))
    slope_x = (first * np.float32(y2) - second * np.float32(y1)) * per_area
    slope_y = (second * np.float32(x1) - first * np.float32(x2)) * per_area
    middle = (heights[0] + heights[1] + heights[2] + heights[3]) * np.float32(0.25)
    return middle, slope_x, slope_y


def _ground(surface: Surface, planning: config.Planning) -> _Ground:
    known = surface.cell_class >= CellClass.HIT
    slope_x, slope_y = _fitted_slopes(surface.z_mean, known, surface.grid.cell_m)
    raised, sunk = np.where(known, surface.z_top, -np.inf), np.where(known, surface.z_bot, np.inf)
    flat_high, flat_low = np.full(known.shape, -np.inf), np.full(known.shape, np.inf)
    high, low, whole = flat_high.copy(), flat_low.copy(), np.ones_like(known)
    for at in SQUARE:
        plane = slope_y * at[0] + slope_x * at[1]
        top, bottom = _moved(raised, at, -np.inf), _moved(sunk, at, np.inf)
        np.maximum(flat_high, top, out=flat_high)
        np.minimum(flat_low, bottom, out=flat_low)
        np.maximum(high, top - plane, out=high)
        np.minimum(low, bottom - plane, out=low)
        whole &= _moved(known, at, False)
    rough = (high - low > planning.step_m) & (flat_high - flat_low > planning.step_m)
    steep = np.hypot(slope_x, slope_y) > math.tan(planning.slope_limit_rad) * surface.grid.cell_m
    return _Ground(
        z=np.where(known, surface.z_mean, np.float32(np.nan)),
        whole=whole,
        rough=rough,
        steep=steep,
        top=np.where(known, surface.z_top, np.float32(-np.inf)),
        ray=np.where(known, np.float32(-np.inf), surface.z_ray),
    )


def _fitted_slopes(z: F32, known: Bool, cell_m: float) -> tuple[F64, F64]:
    """Slopes along +x and +y, metres per cell, of the plane fitted to the known cells of 0.9 m; 0 without fit."""
    half = max(1, round((PLANE_M / cell_m - 1) / 2))
    ones, ramp = np.ones(2 * half + 1), np.arange(-half, half + 1.0)
    weight = known.astype(np.float64)
    height = np.where(known, z, 0.0)
    height = (height - (height.sum() / max(1.0, weight.sum()))) * weight

    def moment(of: F64, rows: F64, columns: F64) -> F64:
        summed = ndimage.correlate1d(of, columns, axis=1, mode="constant")
        found: F64 = ndimage.correlate1d(summed, rows, axis=0, mode="constant")
        return found

    n = np.maximum(moment(weight, ones, ones), 1.0)
    x, y, z_ = (moment(weight, ones, ramp) / n, moment(weight, ramp, ones) / n, moment(height, ones, ones) / n)
    xx = moment(weight, ones, ramp * ramp) / n - x * x
    yy = moment(weight, ramp * ramp, ones) / n - y * y
    xy = moment(weight, ramp, ramp) / n - x * y
    xz = moment(height, ones, ramp) / n - x * z_
    yz = moment(height, ramp, ones) / n - y * z_
    area = xx * yy - xy * xy
    fits = (n >= LEAST_OF_PLANE) & (area > 0.1)
    area = np.where(fits, area, 1.0)
    return np.where(fits, (xz * yy - yz * xy) / area, 0.0), np.where(fits, (yz * xx - xz * xy) / area, 0.0)


def _moved(grid: NDArray[T], by: tuple[int, int], beyond: float | bool | np.float32) -> NDArray[T]:
    """grid[j + dj, i + di] at every (j, i); `beyond` outside the grid."""
    (dj, di), (rows, columns) = by, grid.shape
    moved = np.full_like(grid, beyond)
    moved[max(0, -dj) : max(0, rows - max(0, dj)), max(0, -di) : max(0, columns - max(0, di))] = grid[
        max(0, dj) : max(0, rows + min(0, dj)), max(0, di) : max(0, columns + min(0, di))
    ]
    return moved
