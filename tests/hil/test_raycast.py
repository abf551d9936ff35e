"""Rays against an exact, slow numpy caster: no miss, no false hit, no error over 0.1 mm."""

from dataclasses import replace

import numpy as np
import pytest

from hil.engine import pybullet
from hil.raycast import Ground, squares
from hil.rocks import Rock
from hil.terrain import height_at
from tests.hil.small_fields import CELL_M, field_of, rough


@pytest.fixture
def ground_of():
    client = pybullet.connect(pybullet.DIRECT)
    yield lambda field: Ground(field, client)
    pybullet.disconnect(client)


def triangles_of(field):
    """All triangles of soil and rocks: corner a and edges (n, 3)."""
    grid = field.grid
    x, y = np.meshgrid(
        grid.x0_m + np.arange(grid.columns) * grid.cell_m, grid.y0_m + np.arange(grid.rows) * grid.cell_m
    )
    points = np.dstack((x, y, field.soil_z)).reshape(-1, 3).astype(float)
    parts = [points[squares(grid.rows, grid.columns)], *(rock.vertices_m[rock.triangles] for rock in field.rocks)]
    corners = np.concatenate(parts)
    return corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]


def fan(field, origin, azimuths, elevations, range_m):
    """Exact ranges (elevations, azimuths) of rays from one point: a vertical plane is cut with all triangles once."""
    a, e1, e2 = triangles_of(field)
    corners = np.stack((a, a + e1, a + e2), axis=1) - origin
    out = np.full((len(elevations), len(azimuths)), np.inf)
    directions = np.column_stack((np.cos(elevations), np.sin(elevations)))
    for column, azimuth in enumerate(azimuths):
        ahead, side = np.array([np.cos(azimuth), np.sin(azimuth)]), np.array([-np.sin(azimuth), np.cos(azimuth)])
        s = corners[..., :2] @ side
        cut = (s.min(axis=1) < 0) & (s.max(axis=1) > 0) & ((corners[..., :2] @ ahead).max(axis=1) > 0)
        s, u, z = s[cut], corners[cut][..., :2] @ ahead, corners[cut][..., 2]
        ends = []
        for i, j in ((0, 1), (1, 2), (2, 0)):
            with np.errstate(divide="ignore", invalid="ignore"):
                t = s[:, i] / (s[:, i] - s[:, j])
            crossing = (s[:, i] < 0) != (s[:, j] < 0)
            point = np.stack((u[:, i] + t * (u[:, j] - u[:, i]), z[:, i] + t * (z[:, j] - z[:, i])), axis=1)
            ends.append(np.where(crossing[:, None], point, np.nan))
        ends = np.stack(ends, axis=1)  # (n, 3, 2): two of three are points
        order = np.argsort(np.isnan(ends[..., 0]), axis=1)[:, :2]
        p, q = (np.take_along_axis(ends, order[:, k, None, None].repeat(2, 2), axis=1)[:, 0] for k in (0, 1))
        edge = q - p
        for row, d in enumerate(directions):
            det = d[0] * edge[:, 1] - d[1] * edge[:, 0]
            with np.errstate(divide="ignore", invalid="ignore"):
                t = (p[:, 0] * edge[:, 1] - p[:, 1] * edge[:, 0]) / det
                share = (p[:, 0] * d[1] - p[:, 1] * d[0]) / det
            hits = t[(t > 0) & (share >= -1e-9) & (share <= 1 + 1e-9)]
            out[row, column] = hits.min() if len(hits) else np.inf
    return np.where(out <= range_m, out, np.inf)


@pytest.mark.parametrize(("seed", "median_deg", "lift_m"), [(1, 6, 0.0), (2, 12, 0.0), (3, 18, 50.0), (4, 6, -3.0)])
def test_26_000_rays_a_field_without_a_miss_or_a_false_hit(ground_of, seed, median_deg, lift_m):
    field = rough(seed, median_deg, side=100, lift_m=lift_m)
    origin = np.array([0.013, 0.027, lift_m + 0.7])
    azimuths = np.linspace(-3.1, 3.1, 131) + 1e-4
    elevations = np.linspace(-1.0, 0.4, 200) + 1e-5
    exact = fan(field, origin, azimuths, elevations, 20.0)
    el, az = np.meshgrid(elevations, azimuths, indexing="ij")
    directions = np.dstack((np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el))).reshape(-1, 3)
    found = ground_of(field).cast(np.broadcast_to(origin, directions.shape), directions, 20.0).reshape(exact.shape)
    assert (np.isfinite(found) == np.isfinite(exact)).all()
    hit = np.isfinite(exact)
    assert np.abs(found[hit] - exact[hit]).max() < 1e-4


def test_rays_that_look_up_meet_the_ridge(ground_of):
    soil = np.zeros((160, 160))
    soil[:, 140:] = 1.2
    ground = ground_of(field_of(soil))
    elevations = np.radians([0.0, 2, 5, 8, 10])
    directions = np.column_stack((np.cos(elevations), np.zeros(5), np.sin(elevations)))
    ranges = ground.cast(np.broadcast_to([0.0, 0.01, 0.6], (5, 3)), directions, 30.0)
    wall_m = (140 - 80 + 0.5) * CELL_M
    reached = ranges * np.cos(elevations)
    assert ((reached > wall_m - CELL_M) & (reached <= wall_m + 1e-6)).all()


def test_height_is_what_a_vertical_ray_meets(ground_of):
    field, rng = rough(5), np.random.default_rng(0)
    x, y = rng.uniform(-3.9, 3.9, (2, 4000))
    origins = np.column_stack((x, y, np.full(4000, 5.0)))
    ranges = ground_of(field).cast(origins, np.broadcast_to([0.0, 0.0, -1.0], (4000, 3)), 20.0)
    assert np.abs(5.0 - ranges - height_at(field, x, y)).max() < 1e-6


def test_16_384_rays_answer_like_any_other_number(ground_of):
    field = field_of(np.zeros((20, 20)))
    down = np.broadcast_to([0.0, 0.0, -1.0], (16384, 3))
    ranges = ground_of(field).cast(np.broadcast_to([0.01, 0.02, 1.0], (16384, 3)), down, 2.0)
    assert ranges.shape == (16384,) and np.abs(ranges - 1.0).max() < 1e-6


def test_nothing_met_is_infinite(ground_of):
    ranges = ground_of(field_of(np.zeros((20, 20)))).cast(np.array([[0, 0, 1.0]]), np.array([[0, 0, 1.0]]), 30.0)
    assert ranges.tolist() == [np.inf]


def test_a_rock_that_reaches_over_the_rim_is_met_from_beside_the_ground(ground_of):
    field = field_of(np.zeros((40, 40)))
    rim_m = field.grid.x0_m + 39 * CELL_M
    corners = np.array([(rim_m + x, y, z) for x in (-0.2, 0.6) for y in (-0.3, 0.3) for z in (-0.1, 0.5)])
    triangles = np.array([
        (0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4),
        (1, 5, 7), (1, 7, 3),
    ], np.int32)  # fmt: skip
    block = Rock(rim_m, 0.0, 0.8, 0.5, corners, triangles)
    origins = np.array([(rim_m + 0.4, -2.0, 0.2), (rim_m - 1.0, 0.05, 0.2)])  # off the ground; over it
    ranges = ground_of(replace(field, rocks=(block,))).cast(origins, np.array([(0.0, 1.0, 0.0), (1.0, 0.0, 0.0)]), 5.0)
    assert np.abs(ranges - (1.7, 0.8)).max() < 1e-9


def test_each_ray_has_an_origin_of_its_own(ground_of):
    field = rough(6)
    rng = np.random.default_rng(1)
    origins = np.column_stack((rng.uniform(-1.0, 1.0, (300, 2)), rng.uniform(1.0, 2.0, 300)))
    directions = rng.normal(size=(300, 3)) - (0.0, 0.0, 1.0)
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    ground = ground_of(field)
    alone = [ground.cast(origins[k : k + 1], directions[k : k + 1], 9.0)[0] for k in range(300)]
    assert ground.cast(origins, directions, 9.0).tolist() == alone
    assert 100 < np.isfinite(alone).sum() < 250


def test_rays_end_at_their_range(ground_of):
    ground, down = ground_of(field_of(np.zeros((20, 20)))), np.array([[0.0, 0.0, -1.0]])
    assert ground.cast(np.array([[0.01, 0.02, 1.0]]), down, 0.999).tolist() == [np.inf]
    assert abs(ground.cast(np.array([[0.01, 0.02, 1.0]]), down, 1.001)[0] - 1.0) < 1e-12


def test_origins_of_another_shape_are_refused(ground_of):
    with pytest.raises(ValueError, match=r"given \(1, 3\), \(2, 3\)"):
        ground_of(field_of(np.zeros((20, 20)))).cast(np.zeros((1, 3)), np.ones((2, 3)), 1.0)
