"""Ground as bodies of the physics engine, and rays cast on it.

Soil is concave triangle tiles of 100 x 100 squares; rocks are concave triangle meshes too. The rocks of a block of
ground share one body: each body costs a microsecond or more in every step.

pybullet 3.2.7 keeps two references to each list that createCollisionShape is given, for ever: vertices, their rows and
indices, 70 MB for a field of 20 m. So the rows are those of one pool, filled again for every mesh, and the other lists
are emptied after the call. Rays on the same triangles are cast by
hil.plant.rays: by our own kernel unless `cast_by` selects another caster. Other limits of the engine: docs/engine.md.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from hil.plant.engine import BODY, ROCK, SOIL, WHEEL, pybullet
from hil.plant.rays.casters import DEFAULT, ray_caster
from hil.terrain.field import Field
from hil.terrain.mesh import squares
from hil.terrain.rocks import Rock
from onboard.native import each
from onboard.records import F32

F64 = NDArray[np.float64]
TILE = 100
BLOCK_M, BLOCK_ROCKS = 5.0, 60  # inline meshes have a limit of vertices


class Ground:
    """Field built into an engine client: soil tiles and rocks, and `cast`."""

    def __init__(self, field: Field, client: int) -> None:
        self._client, self._caster = client, DEFAULT
        self._rocks: dict[int, tuple[F64, list[Rock]]] = {}
        self._tiles: dict[tuple[int, int], tuple[int, F32]] = {}  # soil: engine body and its heights by first j, i
        self.reshape(field)
        for rocks in _blocks(field.rocks):
            vertices = np.concatenate([rock.vertices_m for rock in rocks])
            counts = np.cumsum([0] + [len(rock.vertices_m) for rock in rocks])
            triangles = np.concatenate([rock.triangles + first for rock, first in zip(rocks, counts)])
            body = self._mesh(vertices, triangles, ROCK, SOIL | BODY | WHEEL)
            self._rocks[body] = (np.array([(rock.x_m, rock.y_m, rock.diameter_m / 2) for rock in rocks]), rocks)

    def reshape(self, field: Field) -> None:
        """Use the soil of another field on the same grid and with the same rocks from now on; equal tiles stay."""
        self._field = field
        self._rays = ray_caster(self._caster, field, self._client)
        grid, z = field.grid, field.soil_z
        for j in range(0, grid.rows - 1, TILE):
            for i in range(0, grid.columns - 1, TILE):
                part = z[j : j + TILE + 1, i : i + TILE + 1]
                body, old = self._tiles.get((j, i), (-1, None))
                if old is not None and np.array_equal(old, part):
                    continue
                if body >= 0:
                    pybullet.removeBody(body, physicsClientId=self._client)
                x = grid.x0_m + (i + np.arange(part.shape[1])) * grid.cell_m
                y = grid.y0_m + (j + np.arange(part.shape[0])) * grid.cell_m
                vertices = np.dstack((*np.meshgrid(x, y), part)).reshape(-1, 3)
                self._tiles[j, i] = self._mesh(vertices, squares(*part.shape), SOIL, SOIL | BODY), part.copy()

    def rock_at(self, body: int, point_m: tuple[float, float, float]) -> Rock | None:
        """Rock of a contact on an engine body; None if the body contains no rocks."""
        if body not in self._rocks:
            return None
        discs, rocks = self._rocks[body]
        return rocks[int(np.argmin(each.hypot(discs[:, 0] - point_m[0], discs[:, 1] - point_m[1]) - discs[:, 2]))]

    def _mesh(self, vertices: F64, triangles: NDArray[np.int32], group: int, mask: int) -> int:
        rows, indices = _filled_rows(vertices), triangles.ravel().tolist()
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_MESH, vertices=rows, indices=indices, physicsClientId=self._client
        )
        rows.clear()
        indices.clear()
        body = pybullet.createMultiBody(0, shape, useMaximalCoordinates=1, physicsClientId=self._client)
        if shape < 0 or body < 0:
            raise RuntimeError(f"the engine refused a mesh of {len(vertices)} vertices")
        pybullet.setCollisionFilterGroupMask(body, -1, group, mask, physicsClientId=self._client)
        friction = 0.6 if group == SOIL else 0.45
        pybullet.changeDynamics(body, -1, lateralFriction=friction, restitution=0, physicsClientId=self._client)
        return body

    def cast_by(self, name: str) -> None:
        """Cast rays by a row of rays.casters.CASTERS from now on. ValueError for another name or a missing package."""
        if name != self._caster:
            self._rays, self._caster = ray_caster(name, self._field, self._client), name

    def cast(self, origins_m: F64, directions: F64, range_m: float) -> F64:
        """Ranges of rays on soil and rocks, see hil.plant.rays.casters.RayCaster."""
        return self._rays.cast(origins_m, directions, range_m)


@cache
def _row_pool() -> list[list[float]]:
    """Rows that the engine has been given in this process."""
    return []


def _filled_rows(vertices: F64) -> list[list[float]]:
    """Vertices (n, 3) as lists, whose rows are those of the pool."""
    pool = _row_pool()
    pool.extend([0.0, 0.0, 0.0] for _ in range(len(vertices) - len(pool)))
    rows = pool[: len(vertices)]
    for row, vertex in zip(rows, vertices.tolist()):
        row[:] = vertex
    return rows


def _blocks(rocks: tuple[Rock, ...]) -> list[list[Rock]]:
    """Rocks grouped by square of ground, at most 60 in a group, in a fixed order."""
    order = sorted(rocks, key=lambda rock: (rock.y_m // BLOCK_M, rock.x_m // BLOCK_M, rock.y_m, rock.x_m))
    groups: list[list[Rock]] = []
    place: tuple[float, float] | None = None
    for rock in order:
        here = (rock.y_m // BLOCK_M, rock.x_m // BLOCK_M)
        if here != place or len(groups[-1]) == BLOCK_ROCKS:
            groups.append([])
        groups[-1].append(rock)
        place = here
    return groups
