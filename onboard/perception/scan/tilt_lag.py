"""Estimate of the lag of the scanner's times against the tilt axis's, from sweeps down and up over the same ground.

A tilt taken dt too late is wrong by rate * dt: the ground rises in one sweep and sinks in the other, and the two differ
by 2 * rate * dt. Play between motor and scanner causes an error of half the play, in the direction of turning, at any
rate. A wrong mounting angle or a slope moves all sweeps alike. So these are fitted to all points together: a height of
each small cell of the ground, one slope within all cells, one dt and, if the rates differ enough to separate them, one
play:

    z - c(cell) - c1 x - c2 y = (dt * rate + play / 2 * sign(rate)) * (dz/dtilt - c1 dx/dtilt)

The heights are eliminated by subtracting each cell's mean from both sides.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from onboard.config import Rover, Scanning
from onboard.perception.scan.scan3d import Scan3d, points
from onboard.perception.scan.sweep import ANGLE_STEP_RAD, RATE_STEP_RADPS, TiltSegment
from onboard.records import F64, Bool

FLOOR_M = 0.15  # from the wheels' plane, at the wheels: farther points are not ground
ASKEW_RATIO = 0.05  # added with distance: scanner or ground may lean by 3 degrees
CELL_M = 0.2  # of the ground, each with its own height
NEAR_M, FAR_M = 0.9, 8.0  # from the scanner: nearer is the rover itself
RATE_STEPS = (220, 220, 44)  # of the sweeps, in steps of TILT_COMMAND: 27.5 degrees/s twice, 5.5 once
UPPER_RAD, LEAST_WAY_RAD = math.radians(5.0), math.radians(15.0)
_RATES_RATIO = 2.0  # slow and fast rates must differ by this to separate play from lag
_REST_RADPS = math.radians(0.5)  # slower does not count as turning
_LINES = 2  # before and after a line: its rate is computed over them
_ROUNDS = 12
_LEAST = 1000
_SIGMA_OF_MEDIAN = 1.4826


class Lag(NamedTuple):
    """Estimated lag.

    late_s: delay of the scans' times (add it to lidar.latency_ns).
    sigma_s: 1 sigma of late_s.
    points: number of points in the fit.
    play_rad: play from end to end; NaN if all sweeps have one rate, then late_s includes play / (2 rate).
    play_sigma_rad: 1 sigma of play_rad.
    """

    late_s: float
    sigma_s: float
    points: int
    play_rad: float
    play_sigma_rad: float


def nods(scanning: Scanning) -> tuple[TiltSegment, ...]:
    """Sweeps that show a lag: down and up, fast and slow, each separate, in steps of TILT_COMMAND.

    Raises ValueError if the axis has too little travel below the horizon.
    """
    upper = round(max(UPPER_RAD, min(scanning.start_rad, scanning.end_rad)) / ANGLE_STEP_RAD)
    lower = round(max(scanning.start_rad, scanning.end_rad) / ANGLE_STEP_RAD)
    way_rad = (lower - upper) * ANGLE_STEP_RAD
    if way_rad < LEAST_WAY_RAD:
        raise ValueError(
            f"the axis has {math.degrees(way_rad):.0f} degrees below {math.degrees(UPPER_RAD):.0f} degrees down, "
            f"{math.degrees(LEAST_WAY_RAD):.0f} are needed: see scanning.start_rad and scanning.end_rad"
        )
    ends = (upper * ANGLE_STEP_RAD, lower * ANGLE_STEP_RAD)
    made = []
    for steps in RATE_STEPS:
        rate_radps = steps * RATE_STEP_RADPS
        duration_ns = round(way_rad / rate_radps * 1e9)
        made.append(TiltSegment(ends[0], ends[1], rate_radps, duration_ns))
        made.append(TiltSegment(ends[1], ends[0], -rate_radps, duration_ns))
    return tuple(made)


def lag(sweeps: Sequence[Scan3d], rover: Rover, floor_m: float = FLOOR_M) -> Lag:
    """The lag from sweeps both ways over the same ground with the rover at rest; outliers from their cell are left out.

    Raises ValueError if fewer than 1000 points of a sweep are ground, or if all sweeps run the same way.
    """
    if not sweeps:
        raise ValueError("there is no sweep: one down and one up are needed")
    parts = [_rows(scan, rover, floor_m) for scan in sweeps]
    rates = np.array([part[:, 3].mean() for part in parts])
    if not rates.min() < -_REST_RADPS < _REST_RADPS < rates.max():
        raise ValueError("the sweeps run the same way: the lag shows in the difference of opposite ones only")
    x, y, z, rate, dx, dz = np.concatenate([part[:, :6] for part in parts]).T
    turning = np.where(np.abs(rate) > _REST_RADPS, np.sign(rate), 0.0)
    slow, fast = np.percentile(np.abs(rate[turning != 0.0]), (10, 90))
    with_play = fast >= _RATES_RATIO * slow
    cell = _cells(x, y)
    kept, found = np.ones(len(x), np.bool_), np.zeros(4 if with_play else 3)
    for _ in range(_ROUNDS):
        lever_m = dz - found[0] * dx
        columns = [x, y, rate * lever_m, *([0.5 * turning * lever_m] if with_play else [])]
        design, height_m = _level(np.column_stack(columns), cell, kept), _level(z[:, None], cell, kept)[:, 0]
        found[:] = np.linalg.lstsq(design[kept], height_m[kept])[0]
        off_m = height_m - design @ found
        kept = np.abs(off_m) <= 3.0 * _SIGMA_OF_MEDIAN * float(np.median(np.abs(off_m[kept])))
    lines = np.concatenate([part[:, 6] + k * 1e6 for k, part in enumerate(parts)])
    sigmas = _sigmas(design[kept], off_m[kept], lines[kept])
    play = (float(found[3]), float(sigmas[3])) if with_play else (math.nan, math.nan)
    return Lag(float(found[2]), float(sigmas[2]), int(kept.sum()), *play)


def _cells(x_m: F64, y_m: F64) -> NDArray[np.intp]:
    """(k,) number of the ground cell of each point."""
    place = np.column_stack([np.floor(x_m / CELL_M), np.floor(y_m / CELL_M)]).astype(np.int64)
    place -= place.min(axis=0)
    _, cell = np.unique(place[:, 0] * (place[:, 1].max() + 1) + place[:, 1], return_inverse=True)
    return cell


def _level(values: F64, cell: NDArray[np.intp], kept: Bool) -> F64:
    """(k, columns) values minus the mean of the used points of their cell."""
    count = np.maximum(np.bincount(cell[kept], minlength=cell.max() + 1), 1)
    means = [np.bincount(cell[kept], column[kept], cell.max() + 1) / count for column in values.T]
    levelled: F64 = values - np.column_stack(means)[cell]
    return levelled


def _sigmas(design: F64, off_m: F64, lines: F64) -> F64:
    """1 sigma of each unknown; the beams of a line share the error of its tilt, so lines count, not beams."""
    inverse = np.linalg.inv(design.T @ design)
    scores = design * off_m[:, None]
    _, line = np.unique(lines, return_inverse=True)
    sums = np.column_stack([np.bincount(line, score) for score in scores.T])
    sigmas: F64 = np.sqrt((inverse @ (sums.T @ sums) @ inverse).diagonal())
    return sigmas


def _rows(scan: Scan3d, rover: Rover, floor_m: float) -> F64:
    """(k, 7) x, y, z, rate, dx/dtilt, dz/dtilt, line of the ground's points."""
    tilt, time_s = scan.pixels["tilt_rad"].astype(np.float64), scan.pixels["time_ns"] * 1e-9
    lines = np.arange(len(tilt))
    first, last = np.maximum(lines - _LINES, 0), np.minimum(lines + _LINES, len(tilt) - 1)
    made = points(scan, rover)
    line, beam = made.line, made.beam
    before, after = first[line], last[line]
    with np.errstate(divide="ignore", invalid="ignore"):  # a sweep of one line has no rate (0 / 0)
        rate = (tilt[after, beam] - tilt[before, beam]) / (time_s[after, beam] - time_s[before, beam])
    x, y, z = made.xyz_m.T
    away_m = np.hypot(x, y)
    range_m = made.pixels["range_m"]
    ground = (np.abs(z) <= floor_m + ASKEW_RATIO * away_m) & (range_m >= NEAR_M) & (range_m <= FAR_M)
    rows: F64 = np.column_stack([x, y, z, rate, z - rover.lidar_z_m, rover.lidar_x_m - x, line])
    rows = rows[ground & np.isfinite(rate)]
    if len(rows) < _LEAST:
        raise ValueError(f"{len(rows)} points within {floor_m} m of the wheels' plane are too few to see a lag")
    return rows
