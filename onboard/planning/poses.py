"""Which poses (cell, one of 8 orientations) are free, blocked or unknown, and the node sets of the chapter.

Orientation o stands for the body's axis at o * 22.5 degrees against +x, modulo 180: the rover is symmetric, which end
leads is decided by the path. Arrays over poses are (8, rows, columns) = freedom[o, j, i]. Rules: `10-navigation`
section 3.

The plane fitted over 0.9 m takes the slope out of a wheel's step. A wall nearby bends that plane the more, the more of
the wall is known, and ground that was free would become blocked by a better view. So two rules ask for two witnesses: a
step counts if it is too high with the plane taken out and as it is; the ground is too steep if the fitted plane at the
centre and the plane of the four wheels both say so.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.sparse import coo_array, csgraph

from onboard import config
from onboard.records import F32, F64, U8, Bool, CellClass, Grid, NodeSet, Surface

T = TypeVar("T", bound=np.generic)
ORIENTATIONS = 8
PLANE_M = 0.9  # side of the window of the fitted plane
LEAST_OF_PLANE = 20  # known cells that a plane needs, a quarter of its window: fewer at a rim make slopes of noise
CLOSE_M = 0.5  # the soft cost of closeness fades out over this distance
CROSS = ((0, 0), (0, 1), (0, -1), (1, 0), (-1, 0))


class Freedom(IntEnum):
    """What is known of a pose."""

    BLOCKED = 0
    UNKNOWN = 1
    FREE = 2


class _Ground(NamedTuple):
    """What the pose rules ask of each cell, (rows, columns)."""

    z: F32  # height a wheel stands on, NaN where unknown
    whole: Bool  # the cell and its 4 neighbours are known
    rough: Bool  # the step over those of them that are known is too high
    steep: Bool  # the fitted plane is too steep
    top: F32  # highest of a known cell, -inf where unknown
    ray: F32  # lowest beam over an unknown cell, -inf where known


def orientation(yaw_rad: float) -> int:
    """The orientation 0..7 nearest to a yaw (rad, any number of turns)."""
    return round(yaw_rad / (math.pi / ORIENTATIONS)) % ORIENTATIONS


def pose_index(grid: Grid, x_m: float, y_m: float, yaw_rad: float) -> tuple[int, int, int]:
    """(j, i, o) of the pose nearest to a place (m) and yaw (rad); the cell may lie outside the grid."""
    return (*grid.cell(x_m, y_m), orientation(yaw_rad))


def pose_freedom(surface: Surface, rover: config.Rover, planning: config.Planning) -> U8:
    """Freedom of every pose, uint8 of Freedom (8, rows, columns); `10-navigation` section 3.

    Free: every wheel's cell and its 4 neighbours known with steps up to step_m, roll, pitch and slope within their
    limits, and nothing under the body over under_belly_m above the wheel plane, by hits or by a beam that passed.
    Blocked: a known cell breaks a rule. Else unknown. Cells beyond the grid are unknown.
    """
    ground = _ground(surface, planning)
    return np.stack([_layer(ground, o, rover, planning, surface.grid.cell_m) for o in range(ORIENTATIONS)])


def trail(freedom: U8, poses: NDArray[np.integer]) -> U8:
    """A copy with the driven poses free (R2). poses: (k, 3) integers j, i, o; those outside the grid are left out."""
    j, i, o = np.asarray(poses, np.int64).reshape(-1, 3).T
    _, rows, columns = freedom.shape
    inside = (j >= 0) & (j < rows) & (i >= 0) & (i < columns)
    marked = freedom.copy()
    marked[o[inside] % ORIENTATIONS, j[inside], i[inside]] = Freedom.FREE
    return marked


def closeness(freedom: U8, planning: config.Planning, cell_m: float) -> F32:
    """Soft cost ratio >= 0 near blocked poses, float32 (8, rows, columns): a move's price is multiplied by 1 + it.

    `closeness_weight` beside a blocked pose of the same orientation, falling linearly to 0 at 0.5 m; and
    `touching_ratio` more where a neighbour cell or the next orientation is blocked: a wheel that passes there may brush
    the foot of a rock, so it is done only where there is no other way. Unknown poses draw no cost: an optimistic way
    must not shun them.
    """
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
    """Free poses connected with pose (j, i, o) over free poses, bool (8, rows, columns); all False if it is not free.

    Connected by the edges of the pose field: the 8 neighbour cells in the same orientation, the two next orientations.
    The pose has to lie on the grid.
    """
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


def node_sets(surface: Surface, freedom: U8, reachable_mask: Bool) -> U8:
    """The sets chi of the cells, uint8 of NodeSet (rows, columns); disjoint, their union is the grid (Eq. 2 to 5).

    The first that fits: free (centre of a free pose that the rover can reach), outside, occluded, obstacle. As printed
    each set is defined by the others; here the beams and `reachable` say it. reachable_mask: bool (8, rows, columns).
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
    ahead = (rover.half_wheelbase_m * math.cos(yaw), rover.half_wheelbase_m * math.sin(yaw))
    left = (-rover.half_track_m * math.sin(yaw), rover.half_track_m * math.cos(yaw))
    corners = ((1, 1), (-1, 1), (-1, -1), (1, -1))
    return tuple(
        (round((a * ahead[1] + b * left[1]) / cell_m), round((a * ahead[0] + b * left[0]) / cell_m)) for a, b in corners
    )


def body_cells(o: int, rover: config.Rover, cell_m: float) -> tuple[tuple[int, int], ...]:
    """(dj, di) of the cells whose centre lies under the body in orientation o, from the cell of base_link."""
    yaw = o * math.pi / ORIENTATIONS
    reach = math.ceil(math.hypot(rover.body_length_m, rover.body_width_m) / 2 / cell_m)
    found = []
    for dj in range(-reach, reach + 1):
        for di in range(-reach, reach + 1):
            along = (di * math.cos(yaw) + dj * math.sin(yaw)) * cell_m
            across = (dj * math.cos(yaw) - di * math.sin(yaw)) * cell_m
            if abs(along) <= rover.body_length_m / 2 + 1e-9 and abs(across) <= rover.body_width_m / 2 + 1e-9:
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
    for at in CROSS:
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
