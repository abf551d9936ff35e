"""Rows of clouds and maps: rasterise-200k, rasterise-scan, scan-to-map, registration-100k, fbm-1024."""

from __future__ import annotations

import math
from dataclasses import replace
from statistics import median

import numpy as np
import small_gicp

from hil.terrain.fractal import fractal_heights
from onboard.config import Localisation, Rover
from onboard.kernel_calls import raster
from onboard.kernel_calls.cells import BeamBlock, Mount
from onboard.perception.map.live import LiveGrid, mount_of
from onboard.perception.pose.registration import MATCH_M, NEIGHBOURS, VOXEL_M, difference, register
from onboard.records import Cloud, Grid
from tests.bench.goals import Measured, against, seconds

GRID = Grid(-9.95, -9.95, 0.1, 200, 200)
EYE_M = np.array([0.03, 0.02, 0.7])  # not on the border of a cell
LINES, BEAMS = 460, 1081


def sweep(lines: int = LINES) -> Cloud:
    """Return the beams of `lines` turns of the scanner over waves of 5 cm, to 10 m."""
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
    """Compute n, sum, sum of squares, highest, lowest of each cell by bincount and ufunc.at, without beams."""
    ends = cloud.ends_m[cloud.hit]
    cell = np.floor((ends[:, 1] - grid.y0_m) / grid.cell_m + 0.5).astype(np.int64) * grid.columns
    cell += np.floor((ends[:, 0] - grid.x0_m) / grid.cell_m + 0.5).astype(np.int64)
    size, z = grid.rows * grid.columns, ends[:, 2].astype(np.float64)
    high, low = np.full(size, -np.inf), np.full(size, np.inf)
    np.maximum.at(high, cell, z)
    np.minimum.at(low, cell, z)
    return np.bincount(cell, minlength=size), np.bincount(cell, z, size), np.bincount(cell, z * z, size), high, low


def by_numpy(grid: Grid, cloud: Cloud) -> tuple[np.ndarray, ...]:
    """Compute the same with z_ray: all beams step from cell border to cell border together; finished beams drop out."""
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
    """Measure 200,000 hits into five statistics of a new grid: at random places, and in the scanner's order."""
    rng = np.random.default_rng(1)
    strewn = np.column_stack([rng.uniform(-9.9, 9.9, (200_000, 2)), rng.normal(0, 0.1, 200_000)]).astype(np.float32)
    whole = sweep()
    hits = whole.ends_m[whole.hit]
    in_order = hits[np.linspace(0, len(hits) - 1, 200_000).astype(np.int64)]
    found = {}
    for name, ends in (("strewn", strewn), ("in order", in_order)):
        cloud = Cloud(EYE_M, ends, np.ones(len(ends), np.bool_), 0.03)
        found[name] = against(
            lambda cloud=cloud: LiveGrid(GRID).add_points(cloud.ends_m),
            lambda cloud=cloud: by_ufunc(GRID, cloud),
            "numpy bincount + ufunc.at",
            2 * repeats,
        )
    least = min(found.values(), key=lambda made: made.ratio)
    return replace(least, note=", ".join(f"{name} {made.ratio:.1f}" for name, made in found.items()))


def turn_by_numpy(grid: Grid, turn: BeamBlock, mount: Mount, layers: tuple[np.ndarray, ...]) -> None:
    """Add the hits of one turn to flat layers n, sum, sum of squares, highest, lowest.

    Each step for all beams at once.
    """
    keep = np.flatnonzero(turn.ranges_m <= turn.longest_m)
    length = turn.ranges_m[keep].astype(np.float64)
    (cos_az, sin_az), (cos_tilt, sin_tilt) = turn.azimuths[:, keep], turn.tilts[:, keep]
    ahead = length * cos_az
    base = np.stack([ahead * cos_tilt, length * sin_az, -ahead * sin_tilt], axis=1) + mount.scanner_m
    low, high = mount.hull_m[:, 0].min(axis=0), mount.hull_m[:, 1].max(axis=0)
    near = np.flatnonzero(((base >= low) & (base <= high)).all(axis=1))
    few = base[near, None]
    own = ((few >= mount.hull_m[:, 0]) & (few <= mount.hull_m[:, 1])).all(axis=2).any(axis=1)
    base = np.delete(base, near[own], axis=0)
    ends = (base @ mount.T_map_base[:3, :3].T + mount.T_map_base[:3, 3]).astype(np.float32)
    at = np.floor((ends[:, :2] - (grid.x0_m, grid.y0_m)) / grid.cell_m + 0.5).astype(np.int64)
    on = ((at >= 0) & (at < (grid.columns, grid.rows))).all(axis=1)
    cell, z = (at[:, 1] * grid.columns + at[:, 0])[on], ends[on, 2].astype(np.float64)
    n, total, squares, highest, lowest = layers
    n += np.bincount(cell, minlength=len(n))
    total += np.bincount(cell, z, len(n))
    squares += np.bincount(cell, z * z, len(n))
    np.maximum.at(highest, cell, z)
    np.minimum.at(lowest, cell, z)


def rasterise_scan(repeats: int) -> Measured:
    """Measure one turn of 1081 beams, ranges and tilt, into a live grid."""
    azimuth, tilt = np.deg2rad(np.arange(BEAMS) * 0.25 - 135.0), np.deg2rad(np.linspace(20.0, 19.7, BEAMS))
    ranges = (2.0 + 0.1 * np.random.default_rng(1).standard_normal(BEAMS)).astype(np.float32)
    turn = BeamBlock(ranges, np.stack([np.cos(azimuth), np.sin(azimuth)]), np.stack([np.cos(tilt), np.sin(tilt)]), 8.0)
    mount = mount_of(_transform(0.03, 0.02, 0.0), Rover())  # no beam along a border
    live, size = LiveGrid(GRID), GRID.rows * GRID.columns
    layers = (np.zeros(size, np.int64), np.zeros(size), np.zeros(size), np.full(size, -np.inf), np.full(size, np.inf))
    live.add_turn(turn, mount)
    turn_by_numpy(GRID, turn, mount, layers)
    same = all(np.allclose(live.cells[name].ravel(), layer) for name, layer in zip(("n", "sum_z", "sum_z2"), layers))
    made = against(
        lambda: live.add_turn(turn, mount),
        lambda: turn_by_numpy(GRID, turn, mount, layers),
        "numpy bincount + ufunc.at",
        2 * repeats,
        50,
    )
    return replace(made, note=f"both from ranges and tilt; {'equal' if same else 'different'}", also=same)


def scan_to_map(repeats: int) -> Measured:
    """Measure 460 lines of 1081 beams, z_ray along each beam's cells."""
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
    """Measure two scans of 100,000 points, with a start error of 0.30 m and 2.6 degrees."""
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
    in_turn = [(seconds(lambda: register(source, target, guess, config), 1), seconds(alone, 1)) for _ in range(repeats)]
    ours_s, theirs_s = (min(times) for times in zip(*in_turn))
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
    """Measure a map of 1024 x 1024."""
    half = np.fft.rfft2(np.random.default_rng(2).standard_normal((1024, 1024)))

    def bare() -> object:
        np.random.default_rng(1).standard_normal((1024, 1024))
        return np.fft.irfft2(half, s=(1024, 1024))

    def ours() -> object:
        return fractal_heights(1024, 0.1, 0.8, 0.01, np.random.default_rng(1))

    in_turn = [(seconds(ours, 1), seconds(bare, 1)) for _ in range(repeats)]
    ours_s, bare_s = (median(times) for times in zip(*in_turn))
    ratio = median(ours_once / bare_once for ours_once, bare_once in in_turn)  # of pairs, as `against`
    return Measured(ratio, ours_s, bare_s, "its normal deviates + irfft2")


ROWS = {"scan-to-map": scan_to_map, "rasterise-200k": rasterise_200k, "rasterise-scan": rasterise_scan,
        "fbm-1024": fbm_1024, "registration-100k": registration_100k}  # fmt: skip
