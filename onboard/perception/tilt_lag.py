"""How late the scanner's times are against the tilt axis's, seen from a sweep down and a sweep up over flat ground.

A tilt taken dt too late is wrong by rate * dt: the ground rises in one sweep and sinks in the other, and the two differ
by 2 * rate * dt. A wrong mounting angle or a slope moves both alike. So one plane and one dt are fitted to both:

    z - c0 - c1 x - c2 y = dt * rate * (dz/dtilt - c1 dx/dtilt)
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from onboard.config import Rover
from onboard.perception.scan3d import Scan3d, points
from onboard.records import F64

FLOOR_M = 0.15  # of the wheels' plane: what is farther is no ground
_LINES = 2  # before and after: the rate of a line is taken over them
_ROUNDS = 5
_LEAST = 1000


class Lag(NamedTuple):
    """late_s: by how much the scans' times are late (add it to lidar.latency_ns); sigma_s; points: used in the fit."""

    late_s: float
    sigma_s: float
    points: int


def lag(down: Scan3d, up: Scan3d, rover: Rover, floor_m: float = FLOOR_M) -> Lag:
    """The lag from two sweeps over flat ground, the rover at rest; points that lie off the plane are left out.

    Raises ValueError where fewer than 1000 points are ground, or where the two sweeps run the same way.
    """
    rows = [_rows(scan, rover, floor_m) for scan in (down, up)]
    if rows[0][:, 3].mean() * rows[1][:, 3].mean() >= 0.0:
        raise ValueError("the sweeps run the same way: the lag shows in the difference of opposite ones only")
    x, y, z, rate, dx, dz = np.concatenate(rows).T
    kept, found = np.ones(len(x), np.bool_), np.zeros(4)
    for _ in range(_ROUNDS):
        design = np.column_stack([np.ones(len(x)), x, y, rate * (dz - found[1] * dx)])
        found = np.linalg.lstsq(design[kept], z[kept])[0]
        off_m = z - design @ found
        sigma_m = float(np.sqrt((off_m[kept] ** 2).mean()))
        kept = np.abs(off_m) <= 3 * sigma_m
    inverse = np.linalg.inv(design[kept].T @ design[kept])
    return Lag(float(found[3]), sigma_m * math.sqrt(float(inverse[3, 3])), int(kept.sum()))


def _rows(scan: Scan3d, rover: Rover, floor_m: float) -> F64:
    """(k, 6) x, y, z, rate, dx/dtilt, dz/dtilt of the ground's points."""
    tilt, time_s = scan.pixels["tilt_rad"].astype(np.float64), scan.pixels["time_ns"] * 1e-9
    lines = np.arange(len(tilt))
    first, last = np.maximum(lines - _LINES, 0), np.minimum(lines + _LINES, len(tilt) - 1)
    rates = (tilt[last] - tilt[first]) / (time_s[last] - time_s[first])
    made = points(scan, rover)
    rate = rates[made.line, made.beam]
    x, y, z = made.xyz_m.T
    rows: F64 = np.column_stack([x, y, z, rate, z - rover.lidar_z_m, rover.lidar_x_m - x])
    rows = rows[(np.abs(z) <= floor_m) & np.isfinite(rate)]
    if len(rows) < _LEAST:
        raise ValueError(f"{len(rows)} points within {floor_m} m of the wheels' plane are too few to see a lag")
    return rows
