"""The ground: fractal soil and rocks, one triangulation that physics, soil, scanner and truth maps all read.

Soil is fractional Brownian motion by spectral synthesis (Eq. 7 to 20, corrected as in `10-navigation`, section 7).
Heights stand on the centres of a grid; each square of four centres is two triangles, cut from (x + 1, y) to (x, y + 1).
Rocks are irregular polyhedra, half buried, their number by a power law N(> D) ~ D^-2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.records import Gdem, Grid, Pose

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I32 = NDArray[np.int32]

ROCK_SMALLEST_M, ROCK_LARGEST_M = 0.15, 1.2
GOLDEN = (1 + math.sqrt(5)) / 2


@dataclass(frozen=True, slots=True)
class Rock:
    """A closed polyhedron. vertices_m: (v, 3) float64 in the map frame. triangles: (t, 3) int32, outward.

    height_m: how far it stands above the soil at its centre.
    """

    x_m: float
    y_m: float
    diameter_m: float
    height_m: float
    vertices_m: F64
    triangles: I32


@dataclass(frozen=True, slots=True)
class Field:
    """A piece of ground to drive on, in the map frame (origin at the start of the mission).

    soil_z: (rows, columns) float32 on `grid`. start: x, y, yaw count. goal_m: x, y. gdem: what the orbiter knows.
    stats: median_slope_deg, p95_slope_deg, hurst, rock_area_ratio, rocks, and what the maker adds.
    """

    grid: Grid
    soil_z: F32
    rocks: tuple[Rock, ...]
    start: Pose
    goal_m: tuple[float, float]
    gdem: Gdem
    seed: int
    stats: dict[str, float]


def fractal_heights(
    size: int, cell_m: float, hurst: float, sigma: float, rng: np.random.Generator, longest_m: float = math.inf
) -> F64:
    """Periodic fBm map, (size, size) float64, mean 0 (Eq. 15, 16, 20 corrected).

    Coefficients of z = sum c exp(...) have E|c|^2 = (sigma (N cell)^H / (u^2 + v^2)^((H + 1) / 2))^2 with signed u, v,
    which is |F| = sigma (N cell)^(H + 2) / ... of the continuous transform; so sigma, in m^(1 - H), does not depend on
    size or cell. White noise is filtered, so the half spectrum's u = 0 and Nyquist columns keep their power.
    Waves over `longest_m` are left out (detail to lay on ground known more coarsely).
    """
    noise = np.fft.rfft2(rng.standard_normal((size, size)))
    squares = (np.fft.fftfreq(size, 1 / size) ** 2)[:, None] + (np.fft.rfftfreq(size, 1 / size) ** 2)[None, :]
    squares[squares <= (size * cell_m / longest_m) ** 2] = np.inf
    level = size * sigma * (size * cell_m) ** hurst
    return np.fft.irfft2(noise * level * squares ** (-(hurst + 1) / 2), s=(size, size))


def slopes_deg(heights: F64 | F32, cell_m: float) -> F64:
    """Slope of the ground over two cells, degrees, (rows - 2, columns - 2)."""
    z = heights.astype(np.float64)
    dy, dx = (z[2:, 1:-1] - z[:-2, 1:-1]) / (2 * cell_m), (z[1:-1, 2:] - z[1:-1, :-2]) / (2 * cell_m)
    return np.degrees(np.arctan(np.hypot(dx, dy)))


def block_mean(heights: F64, factor: int) -> F64:
    """Mean over squares of factor x factor cells."""
    rows, columns = heights.shape[0] // factor, heights.shape[1] // factor
    return heights[: rows * factor, : columns * factor].reshape(rows, factor, columns, factor).mean(axis=(1, 3))


def soil_height(grid: Grid, soil_z: F32, x_m: F64, y_m: F64) -> F64:
    """Height of the triangulated soil at points (n,); a point off the mesh takes the nearest edge."""
    u = np.clip((np.asarray(x_m) - grid.x0_m) / grid.cell_m, 0, grid.columns - 1)
    v = np.clip((np.asarray(y_m) - grid.y0_m) / grid.cell_m, 0, grid.rows - 1)
    i = np.minimum(u.astype(np.int64), grid.columns - 2)
    j = np.minimum(v.astype(np.int64), grid.rows - 2)
    u, v, z = u - i, v - j, soil_z.astype(np.float64, copy=False)
    z00, z10, z01, z11 = z[j, i], z[j, i + 1], z[j + 1, i], z[j + 1, i + 1]
    lower = z00 + u * (z10 - z00) + v * (z01 - z00)
    upper = z11 + (1 - u) * (z01 - z11) + (1 - v) * (z10 - z11)
    return np.where(u + v <= 1, lower, upper)


def rock_top(rock: Rock, x_m: F64, y_m: F64) -> F64:
    """Height of a rock's upper surface at points (n,), -inf beside it."""
    a, b, c = (rock.vertices_m[rock.triangles[:, k]] for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    a, b, c, area = (part[area > 1e-12] for part in (a, b, c, area))  # those that look up
    dx, dy = np.asarray(x_m)[:, None] - a[:, 0], np.asarray(y_m)[:, None] - a[:, 1]
    beta = (dx * (c[:, 1] - a[:, 1]) - dy * (c[:, 0] - a[:, 0])) / area
    gamma = (dy * (b[:, 0] - a[:, 0]) - dx * (b[:, 1] - a[:, 1])) / area
    inside = (beta >= -1e-9) & (gamma >= -1e-9) & (beta + gamma <= 1 + 1e-9)
    z = a[:, 2] + beta * (b[:, 2] - a[:, 2]) + gamma * (c[:, 2] - a[:, 2])
    return np.where(inside, z, -np.inf).max(axis=1)


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
    """Top of soil and rocks at points (n,): what a vertical ray meets first."""
    top = soil_height(field.grid, field.soil_z, x_m, y_m)
    for rock in field.rocks:
        near = np.hypot(x_m - rock.x_m, y_m - rock.y_m) < rock.diameter_m
        if near.any():
            top[near] = np.maximum(top[near], rock_top(rock, x_m[near], y_m[near]))
    return top


def rock_diameters(area_m2: float, ratio: float, rng: np.random.Generator) -> F64:
    """Diameters, largest first, by N(> D) ~ D^-2 between 0.15 and 1.2 m until their discs fill `ratio` of the area.

    A rock that would overshoot the target is drawn anew, so the few largest cannot spoil the ratio.
    """
    target, total, drawn = area_m2 * ratio, 0.0, []
    smallest, largest = ROCK_SMALLEST_M**-2, ROCK_LARGEST_M**-2
    while total < target - math.pi / 4 * ROCK_SMALLEST_M**2:
        diameter = (smallest - rng.random() * (smallest - largest)) ** -0.5
        disc = math.pi / 4 * diameter**2
        if total + disc <= target:
            drawn.append(diameter)
            total += disc
        elif total > 0.98 * target:
            break
    return np.sort(np.array(drawn))[::-1]


def scatter_rocks(
    grid: Grid, soil_z: F32, ratio: float, clear: tuple[tuple[float, float, float], ...], rng: np.random.Generator
) -> tuple[Rock, ...]:
    """Rocks over the whole grid that do not overlap and keep off the discs `clear` (x, y, radius)."""
    width, height = grid.columns * grid.cell_m, grid.rows * grid.cell_m
    diameters = rock_diameters(width * height, ratio, rng)
    placed: list[tuple[float, float, float]] = []
    discs = np.zeros((len(clear) + len(diameters), 3))
    discs[: len(clear)] = np.reshape([(x, y, 2 * r) for x, y, r in clear], (-1, 3))
    for diameter in diameters.tolist():
        taken = discs[: len(clear) + len(placed)]
        for _ in range(200):
            x = grid.x0_m + (0.01 + 0.98 * rng.random()) * width
            y = grid.y0_m + (0.01 + 0.98 * rng.random()) * height
            if (np.hypot(taken[:, 0] - x, taken[:, 1] - y) > 0.55 * (taken[:, 2] + diameter)).all():
                discs[len(taken)] = x, y, diameter
                placed.append((x, y, diameter))
                break
    ground = soil_height(grid, soil_z, np.array([p[0] for p in placed]), np.array([p[1] for p in placed]))
    return tuple(_rock(x, y, float(z), diameter, rng) for (x, y, diameter), z in zip(placed, ground))


def _rock(x_m: float, y_m: float, z_m: float, diameter_m: float, rng: np.random.Generator) -> Rock:
    """A sphere of 80 triangles, cut by random planes and squeezed, its centre near the soil."""
    sphere, triangles = _sphere()
    normals = rng.standard_normal((9, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    reach = rng.uniform(0.72, 1.0, 9) / np.maximum(sphere @ normals.T, 1e-3)
    radius = np.minimum(reach.min(axis=1), 1.0) * rng.uniform(0.97, 1.03, len(sphere))
    shape = sphere * radius[:, None] * (1.0, rng.uniform(0.7, 1.0), rng.uniform(0.75, 1.1))
    turn = rng.uniform(0, 2 * math.pi)
    cosine, sine = math.cos(turn), math.sin(turn)
    shape = shape @ np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1.0]])
    shape *= diameter_m / 2 / np.hypot(shape[:, 0], shape[:, 1]).max()
    centre = np.array([x_m, y_m, z_m - rng.uniform(0.0, 0.1) * diameter_m])
    vertices = (shape + centre).astype(np.float32).astype(np.float64)
    return Rock(x_m, y_m, diameter_m, float(vertices[:, 2].max() - z_m), vertices, triangles)


def _sphere() -> tuple[F64, I32]:
    """Icosahedron, each face cut in four: 42 unit vectors and 80 outward triangles."""
    corners = [(-1, GOLDEN, 0), (1, GOLDEN, 0), (-1, -GOLDEN, 0), (1, -GOLDEN, 0), (0, -1, GOLDEN), (0, 1, GOLDEN)]
    corners += [(0, -1, -GOLDEN), (0, 1, -GOLDEN), (GOLDEN, 0, -1), (GOLDEN, 0, 1), (-GOLDEN, 0, -1), (-GOLDEN, 0, 1)]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6)]
    faces += [(7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10)]
    faces += [(8, 6, 7), (9, 8, 1)]
    points = [np.array(c, float) / math.hypot(*c) for c in corners]
    middle: dict[tuple[int, int], int] = {}
    triangles: list[tuple[int, int, int]] = []

    def between(a: int, b: int) -> int:
        key = (min(a, b), max(a, b))
        if key not in middle:
            half = points[a] + points[b]
            points.append(half / np.linalg.norm(half))
            middle[key] = len(points) - 1
        return middle[key]

    for a, b, c in faces:
        ab, bc, ca = between(a, b), between(b, c), between(c, a)
        triangles += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
    return np.array(points), np.array(triangles, np.int32)
