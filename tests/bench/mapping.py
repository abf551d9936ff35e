"""Rows of clouds and maps: rasterise-200k, rasterise-scan, scan-to-map, registration-100k, fbm-1024."""

from __future__ import annotations

import math
from dataclasses import replace
from statistics import median

import numpy as np
import small_gicp

from hil.fractal import fractal_heights
from onboard.config import Localisation
from onboard.native import raster
from onboard.perception.registration import MATCH_M, NEIGHBOURS, VOXEL_M, difference, register
from onboard.records import Cloud, Grid
from tests.bench.goals import Measured, against, seconds

GRID = Grid(-9.95, -9.95, 0.1, 200, 200)
EYE_M = np.array([0.03, 0.02, 0.7])  # on no border of a cell
LINES, BEAMS = 460, 1081


def sweep(lines: int = LINES) -> Cloud:
    """Beams of `lines` turns of the scanner over waves of 5 cm, to 10 m."""
    azimuth = np.deg2rad(np.arange(BEAMS) * 0.25 - 135.0)
    down = np.geomspace(math.radians(60), math.radians(3), lines)[:, None]
    length = np.minimum(0.7 / np.tan(down), 9.7)
    x, y = length * np.cos(azimuth), length * np.sin(azimuth)
    z = np.where(length < 9.7, 0.05 * np.sin(x) * np.cos(1.3 * y), 0.7 - 9.7 * np.tan(down))
    hit = np.broadcast_to(length < 9.7, x.shape).ravel()
    return Cloud(
        EYE_M,
        np.stack([x + EYE_M[0], y + EYE_M[1], z], -1).reshape(-1, 3).astype(np.float32),
        np.ascontiguousarray(hit),
        0.03,
    )


def by_ufunc(grid: Grid, cloud: Cloud) -> tuple[np.ndarray, ...]:
    """n, sum, sum of squares, highest, lowest of each cell by bincount and ufunc.at: no beams."""
    ends = cloud.ends_m[cloud.hit]
    cell = np.floor((ends[:, 1] - grid.y0_m) / grid.cell_m + 0.5).astype(np.int64) * grid.columns
    cell += np.floor((ends[:, 0] - grid.x0_m) / grid.cell_m + 0.5).astype(np.int64)
    size, z = grid.rows * grid.columns, ends[:, 2].astype(np.float64)
    high, low = np.full(size, -np.inf), np.full(size, np.inf)
    np.maximum.at(high, cell, z)
    np.minimum.at(low, cell, z)
    return np.bincount(cell, minlength=size), np.bincount(cell, z, size), np.bincount(cell, z * z, size), high, low


def by_numpy(grid: Grid, cloud: Cloud) -> tuple[np.ndarray, ...]:
    """The same with z_ray: all beams go from border to border of the cells in step, those that have ended drop out."""
    start = (cloud.origin_m[:2] - (grid.x0_m, grid.y0_m)) / grid.cell_m + 0.5
    way = cloud.ends_m.astype(np.float64) - cloud.origin_m
    flat = way[:, :2] / grid.cell_m
    cell = np.tile(np.floor(start).astype(np.int64), (len(way), 1))
    last = np.floor(start + flat).astype(np.int64)
    sign = np.where(flat > 0, 1, -1)
    with np.errstate(divide="ignore", invalid="ignore"):
        step = np.abs(1.0 / flat)
        border = np.where(flat > 0, cell + 1 - start, start - cell) * step
    border[flat == 0] = np.inf
    ray, before = np.full(grid.rows * grid.columns, np.inf), np.zeros(len(way))
    goes_on = (cell != last).any(axis=1) | ~cloud.hit  # a beam without a hit counts in its last cell too
    alive = np.flatnonzero(goes_on)
    while len(alive):
        axis = (border[alive, 1] < border[alive, 0]).astype(np.int64)
        t = np.minimum(border[alive, axis], 1.0)
        rise = way[alive, 2]
        z = cloud.origin_m[2] + np.minimum(before[alive] * rise, t * rise)
        j, i = cell[alive, 1], cell[alive, 0]
        inside = (j >= 0) & (j < grid.rows) & (i >= 0) & (i < grid.columns)
        np.minimum.at(ray, (j * grid.columns + i)[inside], z[inside])
        before[alive] = t
        cell[alive, axis] += sign[alive, axis]
        border[alive, axis] += step[alive, axis]
        alive = alive[inside & (t < 1.0) & ((cell[alive] != last[alive]).any(axis=1) | ~cloud.hit[alive])]
    return *by_ufunc(grid, cloud), ray


def rasterise_200k(repeats: int) -> Measured:
    """A cloud of 200,000 hits."""
    rng = np.random.default_rng(1)
    ends = np.column_stack([rng.uniform(-9.9, 9.9, (200_000, 2)), rng.normal(0, 0.1, 200_000)]).astype(np.float32)
    cloud = Cloud(EYE_M, ends, np.ones(len(ends), np.bool_), 0.03)
    made = against(
        lambda: raster.rasterise(GRID, cloud), lambda: by_ufunc(GRID, cloud), "numpy bincount + ufunc.at", repeats
    )
    return replace(made, note="ours walks the beams for z_ray as well, the reference does not")


def rasterise_scan(repeats: int) -> Measured:
    """One turn of 1081 beams."""
    whole = sweep()
    at = 300 * BEAMS
    cloud = Cloud(EYE_M, whole.ends_m[at : at + BEAMS], whole.hit[at : at + BEAMS], 0.03)
    made = against(
        lambda: raster.rasterise(GRID, cloud), lambda: by_ufunc(GRID, cloud), "numpy bincount + ufunc.at", repeats, 20
    )
    return replace(made, note="ours walks the beams for z_ray as well and makes a new grid, the reference no beams")


def scan_to_map(repeats: int) -> Measured:
    """460 lines of 1081 beams, z_ray along each beam's cells."""
    cloud, few = sweep(), sweep(23)
    ours, theirs = raster.rasterise(GRID, few), by_numpy(GRID, few)
    differing = int((~np.isclose(ours.z_ray.ravel(), theirs[5], atol=1e-4)).sum())
    ours_s = seconds(lambda: raster.rasterise(GRID, cloud), repeats)
    theirs_s = seconds(lambda: by_numpy(GRID, cloud), 1)
    return Measured(
        theirs_s / ours_s,
        ours_s,
        theirs_s,
        "vectorised numpy, beams in step",
        f"z_ray differs in {differing} of {theirs[5].size} cells on 23 lines; the reference is run once, warm",
    )


def registration_100k(repeats: int) -> Measured:
    """Two scans of 100,000 points, start 0.30 m and 2.6 degrees off."""
    rng = np.random.default_rng(3)

    def seen(truth: np.ndarray) -> np.ndarray:
        distance, azimuth = 0.8 * 12 ** rng.random(100_000), rng.uniform(-math.pi, math.pi, 100_000)
        x, y = truth[0, 3] + distance * np.cos(azimuth), truth[1, 3] + distance * np.sin(azimuth)
        z = 0.15 * np.sin(1.1 * x + 0.4) * np.cos(0.9 * y) + 0.05 * np.sin(3.1 * x - 2.3 * y)
        points = np.column_stack([x, y, z + rng.normal(0, 0.01, len(x))])
        return np.ascontiguousarray((points - truth[:3, 3]) @ truth[:3, :3])

    truth, off = _transform(1.0, 0.4, 0.2), _transform(0.24, 0.18, math.radians(2.6))
    target, source, guess, config = seen(np.eye(4)), seen(truth), truth @ off, Localisation()

    def alone() -> object:
        fixed, tree = small_gicp.preprocess_points(target, VOXEL_M, NEIGHBOURS, 1)
        moving, _ = small_gicp.preprocess_points(source, VOXEL_M, NEIGHBOURS, 1)
        return small_gicp.align(fixed, moving, tree, guess, "GICP", MATCH_M, 1, 60, 1e-5, 1e-4)

    found = register(source, target, guess, config)
    x, y, z, yaw = difference(found.T_map_base, truth)
    error_mm, error_deg = 1e3 * math.hypot(x, y, z), abs(math.degrees(yaw))
    ours_s, theirs_s = seconds(lambda: register(source, target, guess, config), repeats), seconds(alone, repeats)
    return Measured(
        ours_s / theirs_s,
        ours_s,
        theirs_s,
        "small_gicp GICP with its preprocessing",
        f"{error_mm:.1f} mm, {error_deg:.3f} deg; {found.reason or 'accepted'}",
        error_mm <= 10 and error_deg <= 0.05 and found.accepted,
    )


def _transform(x_m: float, y_m: float, yaw_rad: float) -> np.ndarray:
    T = np.eye(4)
    T[:2, :2] = [[math.cos(yaw_rad), -math.sin(yaw_rad)], [math.sin(yaw_rad), math.cos(yaw_rad)]]
    T[:2, 3] = x_m, y_m
    return T


def fbm_1024(repeats: int) -> Measured:
    """A map of 1024 x 1024."""
    half = np.fft.rfft2(np.random.default_rng(2).standard_normal((1024, 1024)))

    def bare() -> object:
        np.random.default_rng(1).standard_normal((1024, 1024))
        return np.fft.irfft2(half, s=(1024, 1024))

    def ours() -> object:
        return fractal_heights(1024, 0.1, 0.8, 0.01, np.random.default_rng(1))

    in_turn = [(seconds(ours, 1), seconds(bare, 1)) for _ in range(repeats)]
    ours_s, bare_s = (median(times) for times in zip(*in_turn))
    return Measured(ours_s / bare_s, ours_s, bare_s, "its normal deviates + irfft2")


ROWS = {"scan-to-map": scan_to_map, "rasterise-200k": rasterise_200k, "rasterise-scan": rasterise_scan,
        "fbm-1024": fbm_1024, "registration-100k": registration_100k}  # fmt: skip
