"""Eq. 21 to 25 as printed; the flight version is `onboard.planning.global_path`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onboard.records import F32, F64

WHEELBASE_M, WIDTH_M = 0.75, 0.56


@dataclass(frozen=True, slots=True)
class Weights:
    """Weights W N of the indices of Eq. 25.

    roughness: per metre of roughness.
    length: per metre of way.
    theta_x, theta_y: per radian about x and y.
    """

    roughness: float
    length: float
    theta_x: float
    theta_y: float


def projection(heights_m: F32, cell_m: float, at: tuple[int, int]) -> F64:
    """The region R_i about a node: heights of the nodes between the wheels, (n, m), body along +x."""
    j, i = at
    down, right = int(WIDTH_M / 2 / cell_m), int(WHEELBASE_M / 2 / cell_m)
    rows, columns = slice(max(j - down, 0), j + down + 1), slice(max(i - right, 0), i + right + 1)
    return heights_m[rows, columns].astype(np.float64)


def eq_21(region_m: F64) -> float:
    """B: standard deviation of the heights in a region, metres."""
    return float(np.sqrt(np.mean((region_m - region_m.mean()) ** 2)))


def eq_22(a_m: F64, b_m: F64) -> float:
    """L: way between neighbouring nodes (3,), metres."""
    return float(np.sqrt(((a_m - b_m) ** 2).sum()))


def eq_23_24(region_m: F64, cell_m: float) -> tuple[float, float]:
    """Theta_x, Theta_y: mean inclination about the axes, radians, signed; 0 where the region is one node.

    Right-handed: ground that rises to the left is positive about x, ground that falls ahead positive about y.
    """
    along_y = np.arctan(np.diff(region_m, axis=0) / cell_m)
    along_x = np.arctan(np.diff(region_m, axis=1) / cell_m)
    return (float(along_y.mean()) if along_y.size else 0.0, -float(along_x.mean()) if along_x.size else 0.0)


def eq_25(roughness_m: float, length_m: float, thetas_rad: tuple[float, float], weights: Weights) -> float:
    """Cost of one node of a path."""
    tilt = weights.theta_x * thetas_rad[0] + weights.theta_y * thetas_rad[1]
    return weights.roughness * roughness_m + weights.length * length_m + tilt
