"""Rocks on the ground: irregular polyhedra, half buried, without overlap. Their sizes: rock_sizes.py."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hil.terrain.mesh import soil_height
from hil.terrain.rock_sizes import RockLaw
from onboard.native import each, elementary, linear
from onboard.records import F32, F64, I32, Grid

GOLDEN = (1 + math.sqrt(5)) / 2


@dataclass(frozen=True, slots=True)
class Rock:
    """Closed polyhedron.

    x_m, y_m: centre, map frame
    diameter_m: largest diameter
    height_m: height above the soil at its centre
    vertices_m: (v, 3) float64, map frame
    triangles: (t, 3) int32, outward
    """

    x_m: float
    y_m: float
    diameter_m: float
    height_m: float
    vertices_m: F64
    triangles: I32


def rock_top(rock: Rock, x_m: F64, y_m: F64) -> F64:
    """Height of a rock's upper surface at points (n,), -inf off the rock."""
    a, b, c = (rock.vertices_m[rock.triangles[:, k]] for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    a, b, c, area = (part[area > 1e-12] for part in (a, b, c, area))  # triangles that face up
    dx, dy = np.asarray(x_m)[:, None] - a[:, 0], np.asarray(y_m)[:, None] - a[:, 1]
    beta = (dx * (c[:, 1] - a[:, 1]) - dy * (c[:, 0] - a[:, 0])) / area
    gamma = (dy * (b[:, 0] - a[:, 0]) - dx * (b[:, 1] - a[:, 1])) / area
    inside = (beta >= -1e-9) & (gamma >= -1e-9) & (beta + gamma <= 1 + 1e-9)
    z = a[:, 2] + beta * (b[:, 2] - a[:, 2]) + gamma * (c[:, 2] - a[:, 2])
    return np.where(inside, z, -np.inf).max(axis=1)


def scatter_rocks(
    grid: Grid, soil_z: F32, law: RockLaw, clear: tuple[tuple[float, float, float], ...], rng: np.random.Generator
) -> tuple[Rock, ...]:
    """Rocks over the whole grid that do not overlap and avoid the discs `clear` (x, y, radius).

    The largest are placed first; a rock without a free place after 200 tries is omitted.
    """
    width, height = grid.columns * grid.cell_m, grid.rows * grid.cell_m
    diameters = law.diameters_m(width * height, rng)
    placed: list[tuple[float, float, float]] = []
    discs = np.zeros((len(clear) + len(diameters), 3))
    discs[: len(clear)] = np.reshape([(x, y, 2 * r) for x, y, r in clear], (-1, 3))
    for diameter in diameters.tolist():
        taken = discs[: len(clear) + len(placed)]
        for _ in range(200):
            x = grid.x0_m + (0.01 + 0.98 * rng.random()) * width
            y = grid.y0_m + (0.01 + 0.98 * rng.random()) * height
            if (each.hypot(taken[:, 0] - x, taken[:, 1] - y) > 0.55 * (taken[:, 2] + diameter)).all():
                discs[len(taken)] = x, y, diameter
                placed.append((x, y, diameter))
                break
    ground = soil_height(grid, soil_z, np.array([p[0] for p in placed]), np.array([p[1] for p in placed]))
    return tuple(_rock(x, y, float(z), diameter, rng) for (x, y, diameter), z in zip(placed, ground))


def rock_of(x_m: float, y_m: float, z_m: float, width_m: float, height_m: float, rng: np.random.Generator) -> Rock:
    """Irregular rock on soil of height z_m at its centre, with this largest width and this height above the soil."""
    rock = _rock(0.0, 0.0, 0.0, width_m, rng)
    shape = rock.vertices_m * (1.0, 1.0, height_m / rock.height_m) + (x_m, y_m, z_m)
    return Rock(x_m, y_m, width_m, height_m, shape.astype(np.float32).astype(np.float64), rock.triangles)


def _rock(x_m: float, y_m: float, z_m: float, diameter_m: float, rng: np.random.Generator) -> Rock:
    """Sphere of 80 triangles, cut by random planes and squeezed, its centre near the soil."""
    sphere, triangles = _sphere()
    normals = rng.standard_normal((9, 3))
    normals /= np.sqrt(np.square(normals).sum(axis=1, keepdims=True))
    reach = rng.uniform(0.72, 1.0, 9) / np.maximum(linear.product(sphere, normals.T), 1e-3)
    radius = np.minimum(reach.min(axis=1), 1.0) * rng.uniform(0.97, 1.03, len(sphere))
    shape = sphere * radius[:, None] * (1.0, rng.uniform(0.7, 1.0), rng.uniform(0.75, 1.1))
    turn = rng.uniform(0, 2 * math.pi)
    cosine, sine = elementary.cos(turn), elementary.sin(turn)
    shape = linear.product(shape, [[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    shape *= diameter_m / 2 / each.hypot(shape[:, 0], shape[:, 1]).max()
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
    points = [np.array(c, float) / linear.norm(np.array(c, float)) for c in corners]
    middle: dict[tuple[int, int], int] = {}
    triangles: list[tuple[int, int, int]] = []

    def between(a: int, b: int) -> int:
        key = (min(a, b), max(a, b))
        if key not in middle:
            half = points[a] + points[b]
            points.append(half / linear.norm(half))
            middle[key] = len(points) - 1
        return middle[key]

    for a, b, c in faces:
        ab, bc, ca = between(a, b), between(b, c), between(c, a)
        triangles += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
    return np.array(points), np.array(triangles, np.int32)
