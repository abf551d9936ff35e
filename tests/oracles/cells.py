"""Slow plain twins of the fast code: loops over cells and poses, written from the rules, sharing nothing with it."""

from __future__ import annotations

import math

import numpy as np
from scipy import sparse

from onboard import config
from onboard.perception.map.cell_classes import SPREAD
from onboard.records import CellClass, Cloud, Grid, Ldem, Surface

KNOWN = (CellClass.HIT, CellClass.FILLED, CellClass.HOLE, CellClass.ASSUMED)


def rasterise(grid: Grid, cloud: Cloud) -> dict[str, np.ndarray]:
    """Each beam against the four sides of every cell."""
    shape = (grid.rows, grid.columns)
    out = {name: np.zeros(shape) for name in ("n", "sum_z", "sum_z2", "sum_sigma")}
    out |= {"z_hi": np.full(shape, -np.inf), "z_lo": np.full(shape, np.inf)}
    out |= {"z_ray": np.full(shape, np.inf), "view_m": np.full(shape, np.inf)}
    for end, hit in zip(cloud.ends_m.astype(float), cloud.hit):
        way = end - cloud.origin_m
        own = (
            math.floor((end[1] - grid.y0_m) / grid.cell_m + 0.5),
            math.floor((end[0] - grid.x0_m) / grid.cell_m + 0.5),
        )
        for j in range(grid.rows):
            for i in range(grid.columns):
                if hit and (j, i) == own:
                    flat = math.hypot(way[0], way[1])
                    out["n"][j, i] += 1
                    out["sum_z"][j, i] += end[2]
                    out["sum_z2"][j, i] += end[2] ** 2
                    out["sum_sigma"][j, i] += cloud.sigma_range_m * abs(math.sin(math.atan2(way[2], flat)))
                    out["z_hi"][j, i] = max(out["z_hi"][j, i], end[2])
                    out["z_lo"][j, i] = min(out["z_lo"][j, i], end[2])
                    out["view_m"][j, i] = min(out["view_m"][j, i], flat)
                    continue
                piece = _piece(cloud.origin_m, way, grid, j, i)
                if piece is not None:
                    low = min(cloud.origin_m[2] + t * way[2] for t in piece)
                    out["z_ray"][j, i] = min(out["z_ray"][j, i], low)
    missed = out["n"] == 0
    out["z_hi"][missed] = out["z_lo"][missed] = np.nan
    return out


def _piece(origin: np.ndarray, way: np.ndarray, grid: Grid, j: int, i: int) -> tuple[float, float] | None:
    t0, t1 = 0.0, 1.0
    for axis, centre in ((0, grid.x0_m + i * grid.cell_m), (1, grid.y0_m + j * grid.cell_m)):
        low, high = centre - grid.cell_m / 2 - origin[axis], centre + grid.cell_m / 2 - origin[axis]
        if way[axis] == 0:
            if not low <= 0 < high:
                return None
            continue
        a, b = sorted((low / way[axis], high / way[axis]))
        t0, t1 = max(t0, a), min(t1, b)
    return (t0, t1) if t1 > t0 else None


def classify(ldem: Ldem, fill_cells: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Classes, z_mean, z_top, z_bot, cell by cell after the table of `10-navigation` section 3."""
    rows, columns = ldem.n.shape
    classes = np.zeros((rows, columns), np.uint8)
    mean, top, bottom = (np.full((rows, columns), np.nan) for _ in range(3))
    for j, i in np.argwhere(ldem.n > 0):
        n = ldem.n[j, i]
        bias = ldem.sum_sigma[j, i] / n * SPREAD[n]
        classes[j, i], mean[j, i] = CellClass.HIT, ldem.sum_z[j, i] / n
        top[j, i] = max(mean[j, i], ldem.z_hi[j, i] - bias)
        bottom[j, i] = min(mean[j, i], min(ldem.z_lo[j, i], ldem.z_ray[j, i] + 0.02) + bias)
    hits = mean.copy()
    for j, i in np.argwhere(ldem.n == 0):
        ray = ldem.z_ray[j, i]
        found = [_across(hits, j, i, d, fill_cells) for d in ((0, 1), (1, 0), (1, 1), (1, -1))]
        even = [between for between in found if between is not None]
        fits = [z for z in even if z - 0.02 <= ray <= z + 0.08]
        if any(ray < z - 0.06 for z in even):
            classes[j, i], height = CellClass.HOLE, float(ray)
        elif fits:
            classes[j, i], height = CellClass.FILLED, sum(fits) / len(fits)
        elif np.isfinite(ldem.assumed_z[j, i]):
            classes[j, i], height = CellClass.ASSUMED, float(ldem.assumed_z[j, i])
        else:
            classes[j, i] = CellClass.OCCLUDED if np.isfinite(ray) else CellClass.OUTSIDE
            continue
        mean[j, i] = top[j, i] = bottom[j, i] = height
    return classes, mean, top, bottom


def _across(hits: np.ndarray, j: int, i: int, direction: tuple[int, int], fill_cells: int) -> float | None:
    ends = []
    for sign in (-1, 1):
        for k in range(1, fill_cells + 1):
            row, column = j + sign * k * direction[0], i + sign * k * direction[1]
            if not (0 <= row < hits.shape[0] and 0 <= column < hits.shape[1]):
                return None
            if np.isfinite(hits[row, column]):
                ends.append((k, float(hits[row, column])))
                break
        else:
            return None
    (before, low), (after, high) = ends
    missing = before + after - 1
    if missing > fill_cells or abs(high - low) > 0.08 + 0.036 * missing:
        return None
    return low + (high - low) * before / (before + after)


def pose_freedom(surface: Surface, rover: config.Rover, planning: config.Planning) -> np.ndarray:
    """Pose by pose after the rules: 0 blocked, 1 unknown, 2 free."""
    rows, columns = surface.cell_class.shape
    slopes = {(j, i): _plane(surface, j, i) for j in range(rows) for i in range(columns)}
    out = np.zeros((8, rows, columns), np.uint8)
    for o in range(8):
        for j in range(rows):
            for i in range(columns):
                out[o, j, i] = _pose(surface, slopes, o, j, i, rover, planning)
    return out


def _known(surface: Surface, j: int, i: int) -> bool:
    rows, columns = surface.cell_class.shape
    return 0 <= j < rows and 0 <= i < columns and surface.cell_class[j, i] in KNOWN


def _plane(surface: Surface, j: int, i: int) -> tuple[float, float]:
    half = round((0.9 / surface.grid.cell_m - 1) / 2)
    near = [(b, a) for b in range(-half, half + 1) for a in range(-half, half + 1) if _known(surface, j + b, i + a)]
    if len(near) < 20:
        return 0.0, 0.0
    matrix = np.array([(a, b, 1.0) for b, a in near])
    heights = np.array([float(surface.z_mean[j + b, i + a]) for b, a in near])
    if np.linalg.det(np.cov(matrix[:, :2].T, bias=True)) <= 0.1:
        return 0.0, 0.0
    fit = np.linalg.lstsq(matrix, heights, rcond=None)[0]
    return float(fit[0]), float(fit[1])


def _pose(
    surface: Surface, slopes: dict, o: int, j: int, i: int, rover: config.Rover, planning: config.Planning
) -> int:
    cell, yaw = surface.grid.cell_m, o * math.pi / 8
    rotate = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
    ahead, left = rover.half_wheelbase_m, rover.half_track_m
    corners = ((ahead, left), (-ahead, left), (-ahead, -left), (ahead, -left))
    contacts = [tuple(round(v / cell) for v in rotate @ at) for at in corners]
    verdicts = [_wheel(surface, slopes, j + b, i + a, planning.step_m) for a, b in contacts]
    if min(verdicts) == 0:
        return 0
    if not all(_known(surface, j + b, i + a) for a, b in contacts):
        return 1
    heights = [float(surface.z_mean[j + b, i + a]) for a, b in contacts]
    sx, sy, middle = np.linalg.lstsq(np.array([(a, b, 1.0) for a, b in contacts]), np.array(heights), rcond=None)[0]
    tilts = np.abs(np.arctan(rotate.T @ (sx / cell, sy / cell)))
    slope = min(math.atan(math.hypot(*v) / cell) for v in (slopes[j, i], (sx, sy)))
    if tilts.max() > planning.tilt_limit_rad or slope > planning.slope_limit_rad:
        return 0
    for b in range(-7, 8):
        for a in range(-7, 8):
            along, across = np.abs(rotate.T @ (a * cell, b * cell)) - (rover.body_length_m / 2, rover.body_width_m / 2)
            outside = max(along, across) - 1e-9
            if outside <= 0.0 or (outside <= cell / 2 and not _known(surface, j + b, i + a)):
                limit = middle + sx * a + sy * b + planning.under_belly_m
                verdicts.append(_under_body(surface, j + b, i + a, limit))
    return min(verdicts)


def _wheel(surface: Surface, slopes: dict, j: int, i: int, step_m: float) -> int:
    square = [(j + y, i + x) for y in (-1, 0, 1) for x in (-1, 0, 1)]
    seen = [at for at in square if _known(surface, *at)]
    if seen and surface.grid.contains(j, i):
        steps = []
        for sx, sy in ((0.0, 0.0), slopes[j, i]):
            lift = [sx * (x - i) + sy * (y - j) for y, x in seen]
            high = max(float(surface.z_top[at]) - up for at, up in zip(seen, lift))
            low = min(float(surface.z_bot[at]) - up for at, up in zip(seen, lift))
            steps.append(high - low)
        if min(steps) > step_m:
            return 0
    return 2 if len(seen) == 9 else 1


def _under_body(surface: Surface, j: int, i: int, limit: float) -> int:
    if _known(surface, j, i):
        return 0 if surface.z_top[j, i] > limit else 2
    return 2 if surface.grid.contains(j, i) and surface.z_ray[j, i] <= limit else 1


def pose_graph(
    passable: np.ndarray, cell_m: float, turn_m: float, closeness: np.ndarray | None = None
) -> sparse.csr_array:
    """The edges between passable poses (8, rows, columns) as a sparse matrix over flat indices."""
    _, rows, columns = passable.shape
    index, ratio = np.arange(passable.size).reshape(passable.shape), np.zeros(passable.shape)
    ratio = ratio if closeness is None else closeness
    factor = {0.0: 1.0, 22.5: 1.2, 45.0: 1.2, 67.5: 1.32, 90.0: 1.44}
    edges = []
    for o, j, i in np.argwhere(passable):
        ways = [(o, j + b, i + a) for b in (-1, 0, 1) for a in (-1, 0, 1) if (a, b) != (0, 0)]
        for to in [*ways, ((o + 1) % 8, j, i), ((o - 1) % 8, j, i)]:
            if not (0 <= to[1] < rows and 0 <= to[2] < columns) or not passable[to]:
                continue
            price = turn_m
            if to[0] == o:
                apart = abs(math.degrees(math.atan2(to[1] - j, to[2] - i)) - o * 22.5) % 180
                price = cell_m * math.hypot(to[1] - j, to[2] - i) * factor[round(min(apart, 180 - apart), 3)]
            edges.append((index[o, j, i], index[to], price * (1 + (ratio[o, j, i] + ratio[to]) / 2)))
    if not edges:
        return sparse.csr_array((passable.size, passable.size))
    here, there, prices = zip(*edges)
    return sparse.csr_array((prices, (here, there)), shape=(passable.size, passable.size))
