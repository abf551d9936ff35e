"""Strip map of the drive guard: scanner lines at a fixed tilt while the rover drives, each levelled on the map first.

    line (Cloud, map frame) -> residuals against the map -> height and roll removed -> strip (a separate Ldem)

The strip is separate from the common map because pose errors within a drive would double its edges (study 9.4). At the
end of a leg `merge` puts the strip's result into the map: cells with few hits are filled, elsewhere bounds widen, and
nothing is replaced.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from onboard import config
from onboard.native.elementary import atan2, cos, sin
from onboard.perception.map import ldem
from onboard.perception.map.cell_classes import COUNTS, MOST_SPREAD, SPREAD, classify
from onboard.records import F64, Cloud, Grid, Ldem, Pose, Surface

INLIER_M = 0.05  # a residual farther from the line's median is changed ground, not an attitude error
MOST_M, MOST_SLOPE = 0.05, 0.05  # more height or roll than this is not an error of the estimate either
LEAST_INLIERS = 30  # fewer beams on known ground do not give height and roll
FILL_HITS = 3  # a cell of the map with fewer hits takes the strip's values
PASSED_M = 0.2  # cells that the line has passed by less show one face only


class Line(NamedTuple):
    """One levelled line.

    cloud: its beams.
    residual_m: (hits,) height of each hit over the map without height and roll of the line; NaN where the map knows no
        height.
    """

    cloud: Cloud
    residual_m: F64


def level(line: Cloud, surface: Surface) -> Line:
    """The line with its height and roll against the map removed.

    The errors are a median and a slope across the line over the residuals within 5 cm of their median: obstacles and
    holes in the way do not contribute. The line is unchanged if the errors are larger than the estimate may be off (the
    ground itself has changed), or if too few hits lie on known ground.
    """
    hits: F64 = line.ends_m[line.hit].astype(np.float64)
    residual = hits[:, 2] - height_at(surface, hits[:, 0], hits[:, 1])
    known = np.isfinite(residual)
    if known.sum() < LEAST_INLIERS:
        return Line(line, np.full(len(hits), np.nan))
    inlier = known & (np.abs(residual - np.median(residual[known])) < INLIER_M)
    across = _across(line)
    if inlier.sum() < LEAST_INLIERS:
        slope, height = 0.0, float(np.median(residual[known]))
    else:
        s, r = across[line.hit][inlier], residual[inlier]
        off = s - s.mean()
        slope = float((off * (r - r.mean())).mean() / max((off * off).mean(), 1e-9))
        height = float(np.median(r - slope * s))
    if abs(height) > MOST_M or abs(slope) > MOST_SLOPE:
        return Line(line, residual)
    ends = line.ends_m.copy()
    ends[:, 2] -= (height + slope * across).astype(np.float32)
    return Line(replace(line, ends_m=ends), residual - height - slope * across[line.hit])


def _across(line: Cloud) -> F64:
    """Distance of each beam's end along the line's main direction from the middle of its hits, (n,) m."""
    flat: F64 = line.ends_m[:, :2].astype(np.float64)
    middle = flat[line.hit].mean(axis=0)
    x, y = (flat[line.hit] - middle).T
    turned_rad = 0.5 * atan2(2.0 * float((x * y).sum()), float((x * x - y * y).sum()))  # direction of the larger spread
    along: F64 = cos(turned_rad) * (flat[:, 0] - middle[0]) + sin(turned_rad) * (flat[:, 1] - middle[1])
    return along


def height_at(surface: Surface, x_m: F64, y_m: F64) -> F64:
    """Bilinear height of the map's cell means at points (n,), NaN next to an unknown cell and off the map."""
    grid = surface.grid
    u, v = (x_m - grid.x0_m) / grid.cell_m, (y_m - grid.y0_m) / grid.cell_m
    i, j = np.floor(u).astype(np.int64), np.floor(v).astype(np.int64)
    inside = (i >= 0) & (j >= 0) & (i < grid.columns - 1) & (j < grid.rows - 1)
    i, j = np.where(inside, i, 0), np.where(inside, j, 0)
    a, b, z = u - i, v - j, surface.z_mean
    low = (1.0 - a) * z[j, i] + a * z[j, i + 1]
    high = (1.0 - a) * z[j + 1, i] + a * z[j + 1, i + 1]
    return np.where(inside, (1.0 - b) * low + b * high, np.nan)


def enter(strip: Ldem, line: Cloud) -> Ldem:
    """The strip with one more line added; hits are summed, nothing is replaced.

    Only beams that returned are used: the end of a beam without a return is unknown, so its path under the ground
    proves no hole.
    """
    return ldem.insert(strip, replace(line, ends_m=line.ends_m[line.hit], hit=line.hit[line.hit]), stop=0, near_m=0.0)


def merge(memory: Ldem, strip: Ldem, pose: Pose, ahead_m: float, mapping: config.Mapping_) -> Ldem:
    """The map with the result of a leg's strip: filled where it has fewer than 3 hits, bounds widened elsewhere.

    pose: where the leg ended.
    ahead_m: distance of the line ahead of it. Cells from 0.2 m behind the line on are left out: the line has seen only
        the front of a rock there. Bounds: z_top upward, z_bot and z_ray downward, with the map's own noise added back.
        A view is recorded only for cells that took its data. A cell keeps the
        stop of its last sweep, so the next sweep from near replaces what the strip put in.
    """
    memory = ldem.grow(memory, pose.x_m, pose.y_m, mapping.size_m / 2)
    part = ldem.crop(strip, memory.grid)
    seen = (part.n > 0) & (_along(part.grid, pose) <= ahead_m - PASSED_M)
    fill, bound = seen & (memory.n < FILL_HITS), seen & (memory.n >= FILL_HITS)
    found = classify(part, mapping, MOST_SPREAD)
    noise = memory.sum_sigma / np.maximum(memory.n, 1) * SPREAD[np.minimum(memory.n, COUNTS - 1)]
    high, low = np.fmax(memory.z_hi, found.z_top + noise), np.fmin(memory.z_lo, found.z_bot - noise)
    ray, nearer = np.minimum(memory.z_ray, part.z_ray), seen & (part.view_m < memory.view_m)
    return replace(
        memory,
        n=np.where(fill, part.n, memory.n),
        sum_z=np.where(fill, part.sum_z, memory.sum_z),
        sum_z2=np.where(fill, part.sum_z2, memory.sum_z2),
        z_hi=np.where(fill, part.z_hi, np.where(bound, high, memory.z_hi)).astype(np.float32),
        z_lo=np.where(fill, part.z_lo, np.where(bound, low, memory.z_lo)).astype(np.float32),
        sum_sigma=np.where(fill, part.sum_sigma, memory.sum_sigma),
        z_ray=np.where(seen, ray, memory.z_ray),
        view_m=np.where(nearer, part.view_m, memory.view_m),
    )


def _along(grid: Grid, pose: Pose) -> F64:
    """Distance of each cell ahead of a pose, (rows, columns) m."""
    x, y = grid.x0_m + np.arange(grid.columns) * grid.cell_m, grid.y0_m + np.arange(grid.rows) * grid.cell_m
    along: F64 = cos(pose.yaw_rad) * (x[None, :] - pose.x_m) + sin(pose.yaw_rad) * (y[:, None] - pose.y_m)
    return along
