"""Field of a run: soil and rocks together, and the top of both."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hil.terrain.mesh import slopes_deg, soil_height
from hil.terrain.rocks import Rock, rock_top
from onboard.native import each, elementary
from onboard.records import F32, F64, Gdem, Grid, Pose


@dataclass(frozen=True, slots=True)
class Field:
    """Piece of ground to drive on, in the map frame (origin at the start of the mission).

    grid: grid of soil_z
    soil_z: (rows, columns) float32
    rocks: rocks on the soil
    start: x, y, yaw are used
    goal_m: x, y
    gdem: orbital map
    seed: seed of the field
    stats: median_slope_deg, p95_slope_deg, hurst, rock_area_ratio, rocks, and entries added by the maker
    """

    grid: Grid
    soil_z: F32
    rocks: tuple[Rock, ...]
    start: Pose
    goal_m: tuple[float, float]
    gdem: Gdem
    seed: int
    stats: dict[str, float]


def truth_height(field: Field) -> F32:
    """Top of soil and rocks on the field's grid, (rows, columns) float32."""
    grid, top = field.grid, field.soil_z.astype(np.float64)
    for rock in field.rocks:
        low, high = rock.vertices_m.min(axis=0), rock.vertices_m.max(axis=0)
        i0, i1 = (math.floor((v - grid.x0_m) / grid.cell_m) for v in (low[0], high[0]))
        j0, j1 = (math.floor((v - grid.y0_m) / grid.cell_m) for v in (low[1], high[1]))
        i, j = np.arange(max(i0, 0), min(i1 + 2, grid.columns)), np.arange(max(j0, 0), min(j1 + 2, grid.rows))
        if len(i) == 0 or len(j) == 0:
            continue
        x, y = np.meshgrid(grid.x0_m + i * grid.cell_m, grid.y0_m + j * grid.cell_m)
        part = top[j[0] : j[-1] + 1, i[0] : i[-1] + 1]
        np.maximum(part, rock_top(rock, x.ravel(), y.ravel()).reshape(part.shape), out=part)
    return top.astype(np.float32)


def height_at(field: Field, x_m: F64, y_m: F64) -> F64:
    """Top of soil and rocks at points (n,): the first hit of a vertical ray from above."""
    top = soil_height(field.grid, field.soil_z, x_m, y_m)
    for rock in field.rocks:
        near = each.hypot(x_m - rock.x_m, y_m - rock.y_m) < rock.diameter_m
        if near.any():
            top[near] = np.maximum(top[near], rock_top(rock, x_m[near], y_m[near]))
    return top


def inside(field: Field, x_m: float, y_m: float) -> bool:
    """True if a place lies on the field."""
    j, i = field.grid.cell(x_m, y_m)
    return 0 <= j < field.grid.rows and 0 <= i < field.grid.columns


def field_stats(grid: Grid, soil_z: F32, rocks: tuple[Rock, ...], hurst: float) -> dict[str, float]:
    """Statistics for the choice of fields: slopes of the soil, roughness exponent, share of the area under rocks."""
    slopes = slopes_deg(soil_z, grid.cell_m)
    area = grid.rows * grid.columns * grid.cell_m * grid.cell_m
    return {
        "median_slope_deg": float(np.median(slopes)),
        "p95_slope_deg": float(np.percentile(slopes, 95)),
        "hurst": hurst,
        "rock_area_ratio": elementary.total(math.pi / 4 * rock.diameter_m * rock.diameter_m for rock in rocks) / area,
        "rocks": len(rocks),
    }
