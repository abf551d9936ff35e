"""Every caster against an exact, slow numpy one: no miss, no false hit, no error over 0.1 mm."""

import importlib.util
import sys
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from hil.__main__ import app
from hil.plant.engine import pybullet
from hil.plant.ground_bodies import Ground
from hil.plant.rays.casters import CASTERS
from hil.plant.rays.embree_rays import EmbreeRays
from hil.plant.rays.engine_rays import EngineRays
from hil.plant.rays.ground_rays import GroundRays
from hil.run.in_process import InMemory
from hil.scenarios.model import load_scenario
from hil.terrain.field import height_at
from hil.terrain.rocks import Rock
from onboard.config import ConfigError
from tests.hil.ray_oracle import TERRAINS, tried
from tests.hil.small_fields import CELL_M, field_of, rough


def installed(name):
    """A caster that is an extra is tried where it is installed."""
    missing = name == "embree" and importlib.util.find_spec("embreex") is None
    return pytest.param(name, marks=pytest.mark.skipif(missing, reason="pip install .[fast]"))


@pytest.fixture(params=[installed(name) for name in CASTERS])
def ground_of(request):
    """Makes the ground of a field, in a world of its own, with rays by each caster in turn."""
    clients = []

    def make(field):
        clients.append(pybullet.connect(pybullet.DIRECT))
        ground = Ground(field, clients[-1])
        ground.cast_by(request.param)
        return ground

    yield make
    for client in clients:
        pybullet.disconnect(client)


def wrong(ground_of, name, count):
    """How many of `count` rays of any kind on a terrain are missed, hit nothing, or are out by over 0.1 mm."""
    field, origins, directions, truth = tried(name, count)
    found = ground_of(field).cast(origins, directions, 100.0)
    hit = np.isfinite(truth)
    assert 0.2 < hit.mean() < 0.8 and (hit & (directions[:, 2] > 0)).any()  # the rays do ask for both answers
    false = np.isfinite(found) != hit
    false[hit] |= np.abs(found[hit] - truth[hit]) > 1e-4
    return int(false.sum())


@pytest.mark.parametrize("name", TERRAINS)
def test_3_000_rays_a_terrain_without_a_miss_or_a_false_hit(ground_of, name):
    assert wrong(ground_of, name, 3_000) == 0


@pytest.mark.campaign
@pytest.mark.parametrize("ground_of", ["kernel", installed("embree")], indirect=True)
@pytest.mark.parametrize("name", TERRAINS)
def test_a_million_rays_over_five_terrains_without_a_miss_or_a_false_hit(ground_of, name):
    assert wrong(ground_of, name, 200_000) == 0


@pytest.mark.campaign
@pytest.mark.parametrize("ground_of", ["engine"], indirect=True)
def test_the_engine_itself_answers_some_of_a_million_rays_wrongly(ground_of):
    assert 0 < sum(wrong(ground_of, name, 200_000) for name in TERRAINS) < 20


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
    triangles = np.array(
        [
            (0, 1, 3),
            (0, 3, 2),
            (4, 6, 7),
            (4, 7, 5),
            (0, 4, 5),
            (0, 5, 1),
            (2, 3, 7),
            (2, 7, 6),
            (0, 2, 6),
            (0, 6, 4),
            (1, 5, 7),
            (1, 7, 3),
        ],
        np.int32,
    )
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


def test_a_scenario_names_who_casts_its_rays_and_another_ground_keeps_to_it(tmp_path):
    (tmp_path / "a.toml").write_text('seed = 1\nterrain = "flat"\nrays = "engine"\n')
    flight = InMemory(load_scenario(tmp_path / "a.toml"))
    ground = flight.plant.ground
    assert isinstance(ground._rays, EngineRays)
    flight.plant.reshape(flight.field.soil_z + np.float32(0.25))
    assert isinstance(ground._rays, EngineRays)
    down = ground.cast(np.array([[1.0, 1.0, 2.0]]), np.array([[0.0, 0.0, -1.0]]), 5.0)
    kernel = GroundRays(flight.plant.field).cast(np.array([[1.0, 1.0, 2.0]]), np.array([[0.0, 0.0, -1.0]]), 5.0)
    assert down == pytest.approx(kernel, abs=1e-6)
    flight.free()


def test_an_unknown_caster_is_refused_in_the_file_and_on_the_command_line(tmp_path):
    path = tmp_path / "a.toml"
    path.write_text('seed = 1\nrays = "lasers"\n')
    with pytest.raises(ConfigError, match=r"a\.toml.*rays.*kernel"):
        load_scenario(path)
    path.write_text("seed = 1\n")
    said = CliRunner().invoke(app, ["run", str(path), "--rays", "lasers"])
    assert said.exit_code == 64 and "kernel, engine, embree" in said.output


def test_embree_that_is_not_installed_says_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "embreex.rtcore_scene", None)
    with pytest.raises(ConfigError, match=r"pip install \.\[fast\]"):
        EmbreeRays(field_of(np.zeros((4, 4))))
