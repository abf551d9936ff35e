"""The ray kernels pass over a tile of ground that lies under a ray at once: faster, and the same to the bit."""

import numpy as np
import pytest

from hil.plant.rays import ground_rays
from hil.plant.rays.ground_rays import GroundRays
from hil.terrain import heightfield
from hil.terrain.heightfield import HeightField, highest_of_tiles
from tests.hil.ray_oracle import any_rays, terrains

TILE = 16


@pytest.mark.parametrize(("name", "field"), terrains().items())
def test_a_tile_passed_over_at_once_changes_no_bit_of_a_range(name, field, monkeypatch):
    origins, steep = any_rays(field, 2_000, np.random.default_rng(2))
    directions = np.vstack((steep, steep * (1.0, 1.0, 0.05), [(1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0)]))
    directions /= np.linalg.norm(directions, axis=1)[:, None]  # any, nearly level, and along the axes
    origins = np.vstack((origins, origins, origins[:3]))

    def cast():
        soil = HeightField(field.grid, field.soil_z)
        alone = [soil.cast(origin, way[None], 30.0) for origin, way in zip(origins, directions)]
        return GroundRays(field).cast(origins, directions, 30.0), np.concatenate(alone)

    quick = cast()
    for module in (ground_rays, heightfield):  # no tile is ever clear: every square is walked
        monkeypatch.setattr(module, "highest_of_tiles", lambda top_m: np.full_like(highest_of_tiles(top_m), np.inf))
    walked = cast()
    assert [each.tobytes() for each in quick] == [each.tobytes() for each in walked]
    assert all(min(np.isfinite(each).sum(), np.isinf(each).sum()) > 100 for each in quick)


def test_the_highest_of_a_tile_is_that_of_its_squares():
    top_m = np.random.default_rng(3).normal(size=(2 * TILE + 3, TILE)).astype(np.float32)
    parts = top_m[:TILE], top_m[TILE : 2 * TILE], top_m[2 * TILE :]
    assert highest_of_tiles(top_m).tolist() == [[float(part.max())] for part in parts]
