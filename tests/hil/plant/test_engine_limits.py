"""What the engine cannot do, shown on the engine itself: a test here that fails says that it was cured.

Each test is a row of docs/engine.md. What we do instead is in the same test, or in the one that the page names.
"""

import gc
import math
import sys
from dataclasses import replace

import numpy as np
import pytest

from hil.plant import rover_model
from hil.plant.engine import BODY, ROCK, SOIL, WHEEL, pybullet
from hil.plant.ground_bodies import Ground
from hil.plant.plant import Plant
from hil.plant.rays.engine_rays import EngineRays
from hil.plant.rays.ground_rays import GroundRays
from hil.records import WheelDrive
from hil.terrain.field import height_at
from onboard.config import Rover
from onboard.records import Pose
from tests.hil.small_fields import field_of, plane, rough

pytestmark = pytest.mark.tool

AHEAD = (WheelDrive(0.0, 1.1),) * 4
STEP_NS = 5_000_000


@pytest.fixture
def client():
    made = pybullet.connect(pybullet.DIRECT)
    yield made
    pybullet.disconnect(made)


def height_field(field, client):
    """The soil of a field as the engine's own height field."""
    grid, z = field.grid, field.soil_z
    shape = pybullet.createCollisionShape(
        pybullet.GEOM_HEIGHTFIELD,
        meshScale=[grid.cell_m, grid.cell_m, 1],
        heightfieldData=z.ravel().tolist(),
        numHeightfieldRows=grid.columns,
        numHeightfieldColumns=grid.rows,
        physicsClientId=client,
    )
    middle = [
        (low + high) / 2
        for low, high in zip(
            (grid.x0_m, grid.y0_m, float(z.min())), (*grid.centre(grid.rows - 1, grid.columns - 1), float(z.max()))
        )
    ]
    pybullet.createMultiBody(0, shape, basePosition=middle, physicsClientId=client)
    return EngineRays(field, client)


# -- rays ----------------------------------------------------------------------------------------------------------


def upward_rays(field, count):
    """From 0.3 m over the ground, up by 0 to 0.5 rad."""
    rng = np.random.default_rng(0)
    x, y = rng.uniform(-3.0, 3.0, (2, count))
    elevation, azimuth = rng.uniform(0.0, 0.5, count), rng.uniform(-3.1, 3.1, count)
    flat = np.column_stack((np.cos(azimuth), np.sin(azimuth))) * np.cos(elevation)[:, None]
    return np.column_stack((x, y, height_at(field, x, y) + 0.3)), np.column_stack((flat, np.sin(elevation)))


@pytest.mark.parametrize(("lift_m", "up"), [(0.0, True), (50.0, False)])
def test_a_height_field_misses_rays_that_look_up_and_many_where_the_ground_is_high_and_tiles_miss_none(
    client, lift_m, up
):
    field = replace(rough(2, 24, lift_m=lift_m), rocks=())
    origins, directions = upward_rays(field, 8000)
    if not up:
        directions = directions * (1, 1, -1)
    truth = np.isfinite(GroundRays(field).cast(origins, directions, 20.0))
    found = np.isfinite(height_field(field, client).cast(origins, directions, 20.0))
    assert (truth & ~found).sum() > 0.005 * truth.sum()
    pybullet.resetSimulation(physicsClientId=client)
    assert (np.isfinite(_tiles(field, client).cast(origins, directions, 20.0)) == truth).all()


def _tiles(field, client):
    ground = Ground(field, client)
    ground.cast_by("engine")
    return ground


@pytest.mark.campaign  # the engine needs a minute to make it
def test_a_height_field_of_1449_by_1449_nodes_stands_wrong_without_a_word_and_tiles_of_it_do_not(client):
    x, y = np.array([1.012, -2.013]), np.array([-20.013, 20.013])
    down, off_m = np.broadcast_to([0.0, 0.0, -1.0], (2, 3)), []
    for side in (100, 1449):
        z = np.zeros((side, side), np.float32)
        z[side // 2 :] = 0.5
        origins = np.column_stack((x, y * side / 1449, np.full(2, 5.0)))
        pybullet.resetSimulation(physicsClientId=client)
        found = height_field(field_of(z), client).cast(origins, down, 10.0)
        off_m.append(np.abs(found - (5.0, 4.5)).max())
    assert off_m[0] < 1e-6 and off_m[1] > 0.2
    kernel = GroundRays(field_of(z)).cast(origins, down, 10.0)
    assert np.abs(kernel - (5.0, 4.5)).max() < 1e-6


def test_a_convex_rock_answers_early_and_a_rock_of_triangles_does_not(client):
    rock = rough(2).rocks[0]
    rng = np.random.default_rng(0)
    aims = rock.vertices_m.mean(axis=0) + rng.normal(size=(800, 3)) * rock.diameter_m / 6
    origins = aims + np.array((1.5, 0.0, 0.5))
    directions = (aims - origins) / np.linalg.norm(aims - origins, axis=1)[:, None]
    field = replace(field_of(np.full((160, 160), -5.0)), rocks=(rock,))
    truth = GroundRays(field).cast(origins, directions, 5.0)
    convex = pybullet.createCollisionShape(
        pybullet.GEOM_MESH, vertices=rock.vertices_m.tolist(), physicsClientId=client
    )
    pybullet.createMultiBody(0, convex, physicsClientId=client)
    found = EngineRays(field, client).cast(origins, directions, 5.0)
    both = np.isfinite(found) & np.isfinite(truth)
    assert 0.0008 < np.median(truth[both] - found[both]) < 0.003
    assert np.abs(truth[both] - found[both]).max() > 0.005
    pybullet.resetSimulation(physicsClientId=client)
    found = _tiles(field, client).cast(origins, directions, 5.0)
    assert (np.isfinite(found) == np.isfinite(truth)).all()
    assert np.abs(truth[both] - found[both]).max() < 1e-6


def test_16_384_rays_in_a_call_return_nothing_and_more_are_refused(client):
    Ground(field_of(np.zeros((20, 20))), client)

    def answers(count):
        start, end = (np.tile([0.01, 0.02, z], (count, 1)) for z in (1.0, -1.0))
        return len(pybullet.rayTestBatch(start, end, physicsClientId=client))

    assert answers(16_383) == 16_383 and answers(16_384) == 0
    with pytest.raises(pybullet.error, match="exceed the maximum batch size"):
        answers(16_385)


# -- wheels and suspension -----------------------------------------------------------------------------------------


class EngineWheels(Plant):
    """A rover whose wheels are cylinders on the engine's own ground and friction."""

    GRIP = 0.5
    URDF_FLAGS = pybullet.URDF_USE_INERTIA_FROM_FILE  # the engine's default: a cylinder becomes a hull with corners

    def reset(self, pose):
        """Before the rover settles: wheels meet the soil."""
        for wheel in self._wheels:
            self._meet(wheel, self._body, WHEEL, SOIL | ROCK, self.GRIP)
        for body, _ in self.ground._tiles.values():
            self._meet(-1, body, SOIL, SOIL | BODY | WHEEL, 1.0)
        return super().reset(pose)

    def _meet(self, link, body, group, mask, friction):
        pybullet.setCollisionFilterGroupMask(body, link, group, mask, physicsClientId=self._client)
        pybullet.changeDynamics(body, link, lateralFriction=friction, physicsClientId=self._client)

    def step(self, ticks_ns=10_000_000):
        """The engine alone; the wheels' loads are not told."""
        self._motors(ticks_ns * 1e-9)
        for _ in range(ticks_ns // self._step_ns):
            pybullet.stepSimulation(self._client)
        self._now_ns += ticks_ns
        return self._truth(ticks_ns * 1e-9, [((0, 0, 0), (0, 0, 0), 1.0, 0.0)] * 4)

    def _touch(self):
        return ""


@pytest.fixture
def drive():
    """States of a drive ahead with the engine's wheels or ours."""
    plants = []

    def of(kind, field, seconds):
        plants.append(kind(field, step_ns=STEP_NS))
        plants[-1].reset(Pose(-1.0, 0.0))
        plants[-1].apply(AHEAD)
        return [plants[-1].step() for _ in range(round(seconds * 100))]

    yield of
    for plant in plants:
        plant.close()


def test_cylinders_of_the_engine_shake_the_rover_on_flat_ground_and_our_soil_does_not(drive):
    felt = [
        np.std([state.specific_force_mps2[2] for state in drive(kind, plane(), 4)[200:]])
        for kind in (EngineWheels, Plant)
    ]
    assert felt[0] > 0.2 and felt[1] < 0.01


def slip(states, slope_deg):
    """Share of the wheels' way that is lost, over the second half."""
    half, end = states[len(states) // 2], states[-1]
    rolled = 0.1 * np.mean([b.position_rad - a.position_rad for a, b in zip(half.wheels, end.wheels)])
    return 1 - (end.position_m[0] - half.position_m[0]) / math.cos(math.radians(slope_deg)) / rolled


def test_slip_by_the_engine_s_friction_is_a_step_and_on_our_soil_a_curve(drive):
    by_engine, by_soil = (
        [slip(drive(kind, plane(deg), 4), deg) for deg in (0, 20, 28)] for kind in (EngineWheels, Plant)
    )
    assert np.ptp(by_engine[:2]) < 0.02 and by_engine[2] > 1
    assert by_soil == sorted(by_soil) and np.diff(by_soil).min() > 0.04


def test_a_stiff_chassis_has_a_wheel_in_the_air_and_the_gear_between_the_rockers_keeps_all_four_down():
    aloft = []
    for stiff in (True, False):
        plant = Plant(rough(2, ratio=0.0), step_ns=STEP_NS)
        if stiff:
            pybullet.setJointMotorControlArray(
                plant._body,
                plant._rockers,
                pybullet.POSITION_CONTROL,
                targetPositions=[0, 0],
                forces=[1e4, 1e4],
                physicsClientId=plant._client,
            )
        plant.apply(AHEAD)
        states = [plant.step() for _ in range(600)]
        aloft.append(np.mean([min(wheel.load_n for wheel in state.wheels) <= 0 for state in states]))
        plant.close()
    assert aloft[0] > 0.3 and aloft[1] == 0


# -- bodies and joints ---------------------------------------------------------------------------------------------


@pytest.fixture
def body(client, tmp_path):
    (tmp_path / "rover.urdf").write_text(rover_model.urdf(Rover()))
    return lambda fixed: pybullet.loadURDF(str(tmp_path / "rover.urdf"), useFixedBase=fixed, physicsClientId=client)


def test_links_lose_speed_to_a_damping_nobody_asked_for_and_the_plant_s_do_not(client, body):
    rover = body(False)
    pybullet.resetBaseVelocity(rover, [1, 0, 0], [0, 0, 0], physicsClientId=client)
    for _ in range(240):
        pybullet.stepSimulation(client)
    assert 0.05 < 1 - pybullet.getBaseVelocity(rover, client)[0][0] < 0.10
    plant = Plant(plane(), step_ns=STEP_NS)
    pybullet.setGravity(0, 0, 0, plant._client)
    place = [0, 0, 5]
    pybullet.resetBasePositionAndOrientation(plant._body, place, [0, 0, 0, 1], plant._client)
    pybullet.resetBaseVelocity(plant._body, [1, 0, 0], [0, 0, 0], physicsClientId=plant._client)
    for _ in range(200):
        pybullet.stepSimulation(plant._client)
    assert pybullet.getBaseVelocity(plant._body, plant._client)[0][0] == pytest.approx(1.0, abs=1e-9)
    plant.close()


@pytest.mark.parametrize("freed", [False, True])
def test_a_joint_is_locked_by_a_motor_until_its_force_is_0(client, body, freed):
    rover, rocker = body(True), 0
    assert pybullet.getJointInfo(rover, rocker, client)[1] == b"rocker_left"
    if freed:
        pybullet.setJointMotorControl2(rover, rocker, pybullet.VELOCITY_CONTROL, force=0, physicsClientId=client)
    for _ in range(24):
        pybullet.applyExternalTorque(rover, rocker, [0, 0.5, 0], pybullet.LINK_FRAME, physicsClientId=client)
        pybullet.stepSimulation(client)
    assert (abs(pybullet.getJointState(rover, rocker, client)[0]) > 1e-3) == freed


# -- time, state, edge ---------------------------------------------------------------------------------------------


def test_the_engine_s_own_step_does_not_divide_a_tick(client):
    step_s = pybullet.getPhysicsEngineParameters(client)["fixedTimeStep"]
    assert step_s == 1 / 240 and abs(0.01 / step_s - round(0.01 / step_s)) > 0.1


def boxes_fall(client, steps, from_start):
    """Places of five boxes on rough ground, `steps` after the 400 of a new start, or after where they are."""
    if from_start:
        pybullet.resetSimulation(physicsClientId=client)
        pybullet.setGravity(0, 0, -1.62, client)
        pybullet.setPhysicsEngineParameter(deterministicOverlappingPairs=1, physicsClientId=client)
        Ground(rough(3, 12), client)
        box = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.1, 0.07, 0.05], physicsClientId=client)
        for k in range(5):
            made = pybullet.createMultiBody(
                1,
                box,
                basePosition=[0.05 * k, 0.03 * k, 0.3 + 0.15 * k],
                baseOrientation=[0.3, 0.1 * k, 0.2, 0.9],
                physicsClientId=client,
            )
            pybullet.changeDynamics(made, -1, lateralFriction=0.8, physicsClientId=client)
        for _ in range(400):
            pybullet.stepSimulation(client)
    saved = pybullet.saveState(client) if from_start else None
    for _ in range(steps):
        pybullet.stepSimulation(client)
    last = pybullet.getNumBodies(client)
    bodies = [pybullet.getBodyUniqueId(k, client) for k in range(last - 5, last)]
    return saved, np.array([pybullet.getBasePositionAndOrientation(each, client)[0] for each in bodies])


def test_a_restored_state_goes_another_way_and_a_run_from_its_start_does_not(client):
    saved, through = boxes_fall(client, 600, from_start=True)
    pybullet.restoreState(stateId=saved, physicsClientId=client)
    _, restored = boxes_fall(client, 600, from_start=False)
    assert np.abs(restored - through).max() > 1e-9
    _, again = boxes_fall(client, 600, from_start=True)
    assert again.tolist() == through.tolist()


def test_beyond_its_mesh_a_body_falls_for_ever_without_a_word(client):
    Ground(plane(), client)
    pybullet.setGravity(0, 0, -1.62, client)
    box = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1], physicsClientId=client)
    over, beside = (
        pybullet.createMultiBody(1, box, basePosition=[x, 0, 0.2], physicsClientId=client) for x in (0.0, 4.5)
    )
    for _ in range(2400):
        pybullet.stepSimulation(client)
    depths = [pybullet.getBasePositionAndOrientation(each, client)[0][2] for each in (over, beside)]
    assert depths[0] > 0.05 and depths[1] < -40


# -- memory --------------------------------------------------------------------------------------------------------


def test_lists_given_to_a_mesh_are_kept_for_ever_and_a_second_ground_keeps_next_to_none(client):
    rows, indices = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [0, 1, 2]
    before = [sys.getrefcount(each) for each in (rows, rows[0], indices)]
    pybullet.createCollisionShape(pybullet.GEOM_MESH, vertices=rows, indices=indices, physicsClientId=client)
    pybullet.resetSimulation(client)
    assert [sys.getrefcount(each) for each in (rows, rows[0], indices)] == [count + 2 for count in before]
    field = rough(1)
    nodes = field.soil_z.size
    Ground(field, client)  # its rows are there from now on
    pybullet.resetSimulation(client)
    gc.collect()
    first = len(gc.get_objects())
    Ground(field, client)
    pybullet.resetSimulation(client)
    gc.collect()
    assert len(gc.get_objects()) - first < nodes / 100
