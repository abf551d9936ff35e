"""Interface of the pose kernels: freedom of poses, soft cost near blocked poses, reachable poses."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from onboard.kernel_calls.checks import check_array
from onboard.native.variant import kernels
from onboard.records import F32, I32, U8, Bool, Surface

LARGEST_FIELD = 2**31 - 1  # poses: the kernels use int32
FARTHEST = 128  # limit of the rover, the fitted plane and the soft cost, in cells from a pose


class Footprint(NamedTuple):
    """Cells under the rover in each orientation, relative to the cell of base_link.

    wheels: int32 (8, 4, 2), dj and di of wheels 1 to 4, 1 opposite 3 and 2 opposite 4.
    body: int32 (k, 6), for each row that the body may touch: orientation, dj, first and last di under the body
        (first > last: none), first and last di that it may touch; by rising orientation.
    """

    wheels: I32
    body: I32


class Limits(NamedTuple):
    """Parameters of planning.local.poses.

    tilt_ratio, slope_ratio: tangents.
    plane_half: cells, half the window's side.
    """

    step_m: float
    tilt_ratio: float
    slope_ratio: float
    belly_m: float
    plane_half: int
    plane_cells: int


def pose_freedom(surface: Surface, footprint: Footprint, limits: Limits) -> U8:
    """Freedom of each pose, uint8 (8, rows, columns): 0 blocked, 1 unknown, 2 free; `10-navigation` section 3.

    Raises ValueError for layers or footprints of wrong shape, dtype or layout, wheels in one line, rows of the body out
    of order, limits that are not finite or a reach of more than 128 cells.
    """
    check_array("cell_class", surface.cell_class, (None, None), np.uint8)
    rows, columns = surface.cell_class.shape
    for name in ("z_mean", "z_top", "z_bot", "z_ray"):
        check_array(name, getattr(surface, name), (rows, columns), np.float32)
    reach = _check_footprint(footprint)
    cell_m = surface.grid.cell_m
    if not (all(map(math.isfinite, (*limits, cell_m))) and min(*limits, cell_m) >= 0 < cell_m):
        raise ValueError(f"limits: expected finite numbers >= 0 and a cell > 0, given {limits}, {cell_m}")
    if limits.plane_half > FARTHEST:
        raise ValueError(f"plane_half: expected at most {FARTHEST} cells, given {limits.plane_half}")
    known = surface.cell_class >= 2
    heights = np.where(known, surface.z_mean, np.float32(0.0))
    freedom = np.empty((8, rows, columns), np.uint8)
    kernels.pose_freedom_into(
        surface.cell_class,
        surface.z_mean,
        surface.z_top,
        surface.z_bot,
        surface.z_ray,
        *footprint,
        reach,
        limits.plane_half,
        limits.plane_cells,
        float(heights.sum()) / max(1, int(known.sum())),
        limits.step_m,
        limits.slope_ratio * cell_m,
        limits.tilt_ratio,
        limits.slope_ratio,
        limits.belly_m,
        cell_m,
        freedom,
    )
    return freedom


def closeness(freedom: U8, falloff: F32, touching: float) -> F32:
    """Soft cost of each pose, float32 (8, rows, columns).

    freedom: uint8 (8, rows, columns), 0 blocked.
    falloff: float32 (k * k,), ratio by the square of the distance in cells to the nearest blocked pose of the
        orientation, 0 from k cells on, k 3 to 128.
    touching: added if one of the 8 neighbours or of the two adjacent orientations is blocked.

    Raises ValueError for wrong shapes, dtypes or layout.
    """
    check_array("freedom", freedom, (8, None, None), np.uint8)
    check_array("falloff", falloff, (None,), np.float32)
    side = math.isqrt(len(falloff))
    if side * side != len(falloff) or not 3 <= side <= FARTHEST:
        raise ValueError(f"falloff: expected the square of 3 to {FARTHEST} values, given {len(falloff)}")
    ratio = np.empty(freedom.shape, np.float32)
    kernels.closeness_into(freedom, falloff, side - 1, touching, ratio)
    return ratio


def reachable(freedom: U8, free: int, pose: tuple[int, int, int]) -> Bool:
    """Poses of the value `free` that are connected over such poses with `pose` (j, i, o), bool (8, rows, columns).

    All False if `pose` is not free. Raises ValueError for a wrong shape, dtype or layout and a pose off the field.
    """
    check_array("freedom", freedom, (8, None, None), np.uint8)
    _, rows, columns = freedom.shape
    if freedom.size > LARGEST_FIELD:
        raise ValueError(f"freedom: expected at most {LARGEST_FIELD} poses, given {freedom.size}")
    j, i, o = pose
    if not (0 <= j < rows and 0 <= i < columns and 0 <= o < 8):
        raise ValueError(f"pose: expected j, i, o within {rows}, {columns}, 8, given {pose}")
    reached = np.empty(freedom.shape, np.bool_)
    kernels.reachable_into(freedom, free, j, i, o, reached.view(np.uint8))
    return reached


def _check_footprint(footprint: Footprint) -> int:
    """Check a footprint and return its largest offset in cells. Raises ValueError."""
    wheels, body = footprint
    check_array("wheels", wheels, (8, 4, 2), np.int32)
    check_array("body", body, (None, 6), np.int32)
    offsets = np.concatenate([wheels.reshape(-1), body[:, 1:].reshape(-1)])
    low, high = int(offsets.min()), int(offsets.max())
    if low < -FARTHEST or high > FARTHEST:
        raise ValueError(f"footprint: expected offsets of at most {FARTHEST} cells, given {low} to {high}")
    orientations = body[:, 0]
    if (np.diff(orientations) < 0).any() or not ((orientations >= 0) & (orientations < 8)).all():
        raise ValueError("body: expected orientations 0 to 7 in rising order")
    first, second = wheels[:, 0], wheels[:, 1]
    if (first[:, 1] * second[:, 0] == second[:, 1] * first[:, 0]).any():
        raise ValueError("wheels: expected wheels that span an area, given some in one line: cells are too large")
    return max(-low, high)
