"""Exact, slow rays in plain numpy: Moeller and Trumbore over the field's own triangles, and rays to try casters with.

Soil: a ray is cut where it passes from column to column (or row to row) of the raster, along whichever axis it goes
faster. In one such slab it can be in two squares at most; both triangles of these, and of neighbours within rounding,
are asked, unless a square lies above or below the ray. Rocks: every triangle of every rock whose sphere it comes near.
"""

from dataclasses import replace
from functools import cache

import numpy as np

from hil.terrain.field import height_at
from tests.hil.small_fields import field_of, rough

BLOCK = 20_000
RIM = 1e-9


def triangle(corners, origins, directions):
    """Ranges (n,) of rays to one triangle each, corners (n, 3, 3); inf beside it."""
    ab, ac, away = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], origins - corners[:, 0]
    p, q = np.cross(directions, ac), np.cross(away, ab)
    with np.errstate(divide="ignore", invalid="ignore"):
        det = (ab * p).sum(axis=1)
        u, v, t = (away * p).sum(axis=1) / det, (directions * q).sum(axis=1) / det, (ac * q).sum(axis=1) / det
        return np.where((u >= -RIM) & (v >= -RIM) & (u + v <= 1 + RIM) & (t > 0), t, np.inf)


def exact(field, origins, directions, range_m):
    """Ranges (n,) of rays on a field's soil and rocks, inf where nothing is met within `range_m`."""
    out = np.full(len(directions), np.inf)
    for k in range(0, len(directions), BLOCK):
        some = slice(k, k + BLOCK)
        steep = np.abs(directions[some, 0]) >= np.abs(directions[some, 1])
        for along, which in ((0, np.flatnonzero(steep)), (1, np.flatnonzero(~steep))):
            o, d = origins[some][which], directions[some][which]
            out[k + which] = np.minimum(_soil(field, along, o, d, range_m), _rocks(field, o, d))
    return np.where(out <= range_m, out, np.inf)


def _soil(field, along, origins, directions, range_m):
    """Ranges on the soil of rays that go faster along axis `along` than along the other."""
    grid, z = field.grid, field.soil_z.astype(float)
    start = np.array([grid.x0_m, grid.y0_m])
    cells = (grid.columns - 1, grid.rows - 1)
    across = 1 - along
    best = np.full(len(directions), np.inf)
    for slab in range(cells[along]):
        edges = start[along] + (slab + np.array([[-1e-6], [1 + 1e-6]])) * grid.cell_m - origins[:, along]
        with np.errstate(divide="ignore", invalid="ignore"):
            t = edges / directions[:, along]
        near, far = np.maximum(t.min(axis=0), 0.0), np.minimum(t.max(axis=0), range_m + 1)
        (here,) = np.nonzero((near < far) & (near < best))
        side = (origins[here, across] + near[here] * directions[here, across] - start[across]) / grid.cell_m
        end = (origins[here, across] + far[here] * directions[here, across] - start[across]) / grid.cell_m
        first = np.floor(np.minimum(side, end) - 0.01).astype(int)
        height = origins[here, 2] + np.stack((near[here], far[here])) * directions[here, 2]
        strip = z[:, slab : slab + 2] if along == 0 else z[slab : slab + 2].T  # (cells across + 1, 2)
        for step in range(4):
            n = first + step
            inside = (n >= 0) & (n < cells[across]) & (first + step <= np.maximum(side, end) + 0.01)
            k, n = here[inside], n[inside]
            corners = np.stack((strip[n], strip[n + 1]), axis=1)  # of each square
            low, high = corners.min(axis=(1, 2)) - 1e-6, corners.max(axis=(1, 2)) + 1e-6
            crossed = (height[:, inside].min(axis=0) <= high) & (height[:, inside].max(axis=0) >= low)
            k, n = k[crossed], n[crossed]
            for corners in _two(grid, z, *((np.full_like(n, slab), n) if along == 0 else (n, np.full_like(n, slab)))):
                best[k] = np.minimum(best[k], triangle(corners, origins[k], directions[k]))
    return best


def _two(grid, z, i, j):
    """Corners (n, 3, 3) of the lower and of the upper triangle of squares (j, i)."""

    def at(di, dj):
        x, y = grid.x0_m + (i + di) * grid.cell_m, grid.y0_m + (j + dj) * grid.cell_m
        return np.column_stack((x, y, z[j + dj, i + di]))

    return (np.stack((at(0, 0), at(1, 0), at(0, 1)), axis=1), np.stack((at(1, 0), at(1, 1), at(0, 1)), axis=1))


def _rocks(field, origins, directions):
    best = np.full(len(directions), np.inf)
    for rock in field.rocks:
        middle = rock.vertices_m.mean(axis=0)
        reach = np.linalg.norm(rock.vertices_m - middle, axis=1).max() + 1e-6
        aside = np.cross(middle - origins, directions)
        (near,) = np.nonzero((aside * aside).sum(axis=1) <= reach * reach)
        sides = len(rock.triangles)
        each = np.repeat(near, sides)
        corners = np.tile(rock.vertices_m[rock.triangles], (len(near), 1, 1))
        ranges = triangle(corners, origins[each], directions[each]).reshape(-1, sides)
        best[near] = np.minimum(best[near], ranges.min(axis=1))
    return best


TERRAINS = ("gentle", "steep", "lifted", "ridge", "crater")


@cache
def tried(name, count):
    """A terrain, `count` rays on it and their exact ranges to 100 m."""
    field = terrains()[name]
    origins, directions = any_rays(field, count, np.random.default_rng(1))
    return field, origins, directions, exact(field, origins, directions, 100.0)


def terrains():
    """Five fields by name: with rocks, steep, at z = +50 m, with a ridge, with a crater."""
    ridge = np.zeros((100, 100))
    ridge[:, 80:] = 1.2
    y, x = np.mgrid[0:100, 0:100] * 0.05 - 2.5
    bowl = np.clip(np.hypot(x, y) / 2, 0, 1) ** 2 * 0.8
    return {
        "gentle": rough(1, 6, side=100),
        "steep": rough(2, 20, side=100),
        "lifted": rough(3, 12, side=100, lift_m=50.0),
        "ridge": field_of(ridge),
        "crater": replace(rough(4, 3, side=100), soil_z=bowl.astype(np.float32)),
    }


def any_rays(field, count, rng):
    """Origins and directions (n, 3): two thirds from beside the ground, up and down, a third from 50 m over it."""
    xy = rng.uniform(-2.3, 2.3, (count, 2))
    ground = height_at(field, xy[:, 0], xy[:, 1])
    high = rng.random(count) < 1 / 3
    origins = np.column_stack((xy, ground + np.where(high, 50.0, rng.uniform(0.05, 1.0, count))))
    azimuth, elevation = rng.uniform(-np.pi, np.pi, count), rng.uniform(-0.6, 0.5, count)
    level = np.column_stack((np.cos(azimuth), np.sin(azimuth))) * np.cos(elevation)[:, None]
    aimed = np.column_stack((rng.uniform(-3.0, 3.0, (count, 2)), np.full(count, field.soil_z.mean()))) - origins
    aimed /= np.linalg.norm(aimed, axis=1)[:, None]
    directions = np.where(high[:, None], aimed, np.column_stack((level, np.sin(elevation))))
    return origins, directions
