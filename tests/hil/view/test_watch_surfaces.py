"""Grids become triangles that lie where the heights are, and nowhere else."""

import numpy as np
import pytest

from hil.terrain.field import truth_height
from hil.terrain.mesh import soil_height
from hil.view import surfaces
from hil.view.story import TrueGround
from hil.view.surfaces import ABOVE_M, dashes, ground_surface, map_surface, on_ground, segments
from onboard.planning import archive
from onboard.records import NodeSet
from pictures.rim import rim
from tests.ground.synthetic_run import field, plan_at

pytestmark = pytest.mark.tool


@pytest.fixture(scope="module")
def ground():
    made = field()
    rocks = np.array([(rock.x_m, rock.y_m, rock.diameter_m) for rock in made.rocks])
    return TrueGround(made.grid, truth_height(made), rocks, made.goal_m)


@pytest.fixture(scope="module")
def plan(ground):
    return archive.from_npz(archive.to_npz(plan_at(1, ground.heights_m, ground.grid)))


def looks_up(surface):
    a, b, c = (surface.vertices_m[surface.triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a)[:, 2] > 0


def test_the_ground_is_every_node_at_its_height_and_two_triangles_a_square(ground):
    surface, grid = ground_surface(ground), ground.grid
    assert len(surface.triangles) == 2 * (grid.rows - 1) * (grid.columns - 1)
    assert looks_up(surface).all()
    np.testing.assert_array_equal(surface.vertices_m[:, 2].reshape(grid.rows, grid.columns), ground.heights_m)
    assert surface.vertices_m[-1, :2] == pytest.approx(
        (grid.x0_m + (grid.columns - 1) * grid.cell_m, grid.y0_m + (grid.rows - 1) * grid.cell_m), abs=1e-5
    )


def test_a_large_ground_is_shown_by_fewer_nodes_of_the_same_heights(ground, monkeypatch):
    monkeypatch.setattr(surfaces, "LARGEST", ground.heights_m.size // 5)
    surface = ground_surface(ground)
    assert len(surface.vertices_m) <= ground.heights_m.size // 5
    x, y, z = surface.vertices_m.T.astype(float)
    np.testing.assert_allclose(z, soil_height(ground.grid, ground.heights_m, x, y), atol=2e-5)


def test_rocks_have_their_own_colour_and_nothing_else_has(ground):
    surface = ground_surface(ground)
    x, y, _ = surface.vertices_m.T.astype(float)
    nearest = np.min(
        np.hypot(x[:, None] - ground.rocks[:, 0], y[:, None] - ground.rocks[:, 1]) - ground.rocks[:, 2] / 2, axis=1
    )
    brown = (surface.colours == surfaces.ROCK).all(axis=1)
    clear = np.abs(nearest) > 1e-4
    np.testing.assert_array_equal(brown[clear], nearest[clear] < 0)


def test_the_map_is_drawn_where_it_knows_the_height_in_the_colour_of_its_set(plan):
    surface = map_surface(plan)
    assert len(surface.triangles) > 0
    assert looks_up(surface).all()
    i, j = (
        np.rint((surface.vertices_m[:, k] - start) / plan.grid.cell_m).astype(int)
        for k, start in ((0, plan.grid.x0_m), (1, plan.grid.y0_m))
    )
    np.testing.assert_allclose(surface.vertices_m[:, 2], plan.heights_m[j, i] + ABOVE_M, atol=1e-6)
    assert not (plan.node_sets[j, i] == NodeSet.OUTSIDE).any()
    beside = rim(plan.node_sets, plan.heights_m, plan.grid.cell_m)[j, i]
    assert (surface.colours[beside] == surfaces.RIM).all() and beside.any()
    for node_set, colour in surfaces.SETS.items():
        assert (surface.colours[(plan.node_sets[j, i] == node_set) & ~beside] == colour).all()


def test_the_texture_at_a_vertex_has_its_colour(ground, plan):
    for surface in (ground_surface(ground), map_surface(plan)):
        rows, columns, _ = surface.texture.shape
        i, j = np.floor(surface.uv * (columns, rows)).astype(int).T
        np.testing.assert_array_equal(surface.texture[j, i], surface.colours)


def test_a_way_lies_above_the_ground_and_dashes_lie_on_it_half_as_long(ground):
    way = on_ground(ground, np.array([(0.0, 0.0), (4.0, 1.0), (9.0, 1.0)]))
    below = soil_height(ground.grid, ground.heights_m, way[:, 0], way[:, 1])
    np.testing.assert_allclose(way[:, 2] - below, 2 * ABOVE_M)
    pieces = segments(way)
    np.testing.assert_array_equal(pieces[0, 1], pieces[1, 0])
    whole, part = (np.linalg.norm(p[:, 1] - p[:, 0], axis=1).sum() for p in (pieces, dashes(way)))
    assert part == pytest.approx(whole / 2, abs=0.16)
