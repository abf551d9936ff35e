"""The plant drives as a rover on the Moon does: slip, turns, suspension, contacts, fences; the same bits each time."""

import hashlib
import math

import numpy as np
import pytest

from hil.plant.plant import ROCK_LIMIT_M, Plant, PlantAbortError
from hil.plant.soil import CLASSES, mixed
from hil.records import WheelDrive
from hil.terrain.rocks import Rock
from hil.world.contacts import Contacts
from onboard.records import Pose
from tests.hil.small_fields import field_of, plane, rough

STILL = (WheelDrive(0.0, 0.0),) * 4


def run(plant, drives, seconds):
    plant.apply(drives)
    return [plant.step() for _ in range(round(seconds * 100))]


def way(state):
    """Way by the wheels, m."""
    return 0.1 * float(np.mean([wheel.position_rad for wheel in state.wheels]))


def yaw(state):
    x, y, z, w = state.quaternion_xyzw
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


@pytest.fixture
def plant_on():
    plants = []

    def make(field, **settings):
        plants.append(Plant(field, **settings))
        return plants[-1]

    yield make
    for plant in plants:
        plant.close()


def straight(plant, seconds=18.5, rate=1.1):
    before = plant.reset(Pose(-1.0, 0.0))
    after = run(plant, (WheelDrive(0.0, rate),) * 4, seconds)[-1]
    return before, after, float(np.linalg.norm(after.position_m - before.position_m))


def test_two_metres_straight_on_flat_soil_slip_1_to_2_percent(plant_on):
    before, after, moved = straight(plant_on(plane()))
    assert way(after) - way(before) == pytest.approx(1.97, abs=0.02)
    assert 0.01 < 1 - moved / way(after) < 0.02
    assert abs(after.position_m[1]) < 1e-3 and abs(yaw(after)) < 1e-3
    assert after.velocity_mps[0] == pytest.approx(0.109, abs=0.002)
    assert after.contact == ""


def test_at_rest_the_accelerometer_feels_gravity_alone(plant_on):
    states = run(plant_on(plane()), STILL, 2)
    felt = np.array([state.specific_force_mps2 for state in states])
    np.testing.assert_allclose(felt.mean(axis=0), [0, 0, 1.62], atol=1e-4)
    assert felt.std(axis=0).max() < 1e-4


def test_four_wheels_carry_the_weight_of_40_kg(plant_on):
    state = run(plant_on(plane()), STILL, 0.1)[-1]
    loads = [wheel.load_n for wheel in state.wheels]
    assert sum(loads) == pytest.approx(40 * 1.62, rel=0.01)
    assert min(loads) > 0.2 * sum(loads)


def test_wheels_stay_loaded_on_rough_ground(plant_on):
    states = run(plant_on(rough(2, ratio=0.0)), (WheelDrive(0.0, 1.1),) * 4, 20)
    loaded = [min(wheel.load_n for wheel in state.wheels) > 0.05 * 40 * 1.62 / 4 for state in states]
    assert np.mean(loaded) > 0.99


def test_point_turn_goes_left_round_base_link(plant_on):
    angle, arm = math.atan2(0.375, 0.23), math.hypot(0.375, 0.23)
    steer = (-angle, angle, -angle, angle)
    plant = plant_on(plane())
    run(plant, tuple(WheelDrive(s, 0.0) for s in steer), 3)
    rate = 0.2 * arm / 0.1
    after = run(plant, tuple(WheelDrive(s, r) for s, r in zip(steer, (-rate, -rate, rate, rate))), 5)[-1]
    assert math.degrees(yaw(after)) == pytest.approx(math.degrees(0.2 * (5 - rate / 2)), rel=0.04)
    assert np.hypot(*after.position_m[:2]) < 0.005


def test_crab_goes_aside_without_turning(plant_on):
    plant = plant_on(plane())
    run(plant, (WheelDrive(0.5, 0.0),) * 4, 2)
    after = run(plant, (WheelDrive(0.5, 1.1),) * 4, 10)[-1]
    assert math.atan2(after.position_m[1], after.position_m[0]) == pytest.approx(0.5, abs=0.01)
    assert abs(yaw(after)) < 0.01


def test_steering_runs_at_half_a_radian_a_second_and_drive_at_1_radps2(plant_on):
    state = run(plant_on(plane()), (WheelDrive(1.0, 3.0),) * 4, 1)[-1]
    assert state.wheels[0].steer_rad == pytest.approx(0.5, abs=0.02)
    assert state.wheels[0].rate_radps == pytest.approx(1.0, abs=0.05)


def test_stuck_and_free_wheel(plant_on):
    plant = plant_on(plane())
    plant.set_motor(1, 0.0)
    free = run(plant, (WheelDrive(0.0, 1.1),) * 4, 6)[-1]
    assert abs(free.wheels[0].torque_nm) < 1e-9 and free.wheels[0].rate_radps == pytest.approx(1.1, rel=0.05)
    plant.set_motor(1, 8.0)
    plant.reset(Pose(-1.0, 0.0))
    stuck = run(plant, (WheelDrive(0.0, 0.0), *(WheelDrive(0.0, 1.1),) * 3), 6)[-1]
    assert yaw(stuck) > math.radians(3) and stuck.wheels[0].torque_nm < -0.3


def octahedron(x_m, y_m, height_m):
    """A rock of 0.3 m with its centre on the ground."""
    axes = np.concatenate([np.eye(3), -np.eye(3)])[[0, 3, 1, 4, 2, 5]]
    faces = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
    vertices = axes * (0.15, 0.15, height_m) + np.array([x_m, y_m, 0.0])
    return Rock(x_m, y_m, 0.3, height_m, vertices, np.array(faces, np.int32))


def test_body_and_wheel_contacts_are_told(plant_on):
    soil_z = plane().soil_z
    ahead, on_the_track = octahedron(0.6, 0.0, 0.2), octahedron(0.75, 0.23, 0.14)
    for rock, contact in ((ahead, "body on a rock of 0.20 m"), (on_the_track, "wheel 1 on a rock of 0.14 m")):
        plant = plant_on(field_of(soil_z, rocks=[octahedron(-2.0, 0.0, 0.3), rock]))
        assert contact in {state.contact for state in run(plant, (WheelDrive(0.0, 1.1),) * 4, 5)}


def test_a_wheel_that_climbs_a_rock_is_one_contact_of_that_wheel_at_its_place(plant_on):
    """Of 8 cm: the least height that counts."""
    plant = plant_on(field_of(plane().soil_z, rocks=[octahedron(0.75, 0.23, ROCK_LIMIT_M)]))
    contacts = Contacts()
    for state in run(plant, (WheelDrive(0.0, 1.1),) * 4, 6):
        contacts.add(state.now_ns, state.touches)
    (found,) = contacts.found
    assert (found.wheel, found.rock_height_m) == (1, ROCK_LIMIT_M)
    assert math.dist((found.x_m, found.y_m), (0.75, 0.23)) < 0.2
    assert 0.5 < found.end_s - found.begin_s < 4.0


def test_a_start_in_a_rock_is_refused(plant_on):
    with pytest.raises(PlantAbortError, match="stand in a rock"):
        plant_on(field_of(plane().soil_z, rocks=[octahedron(0.0, 0.0, 0.25)]))


def test_low_rock_under_a_wheel_is_no_collision(plant_on):
    plant = plant_on(field_of(plane().soil_z, rocks=[octahedron(0.75, 0.23, 0.06)]))
    states = run(plant, (WheelDrive(0.0, 1.1),) * 4, 6)
    assert {state.contact for state in states} == {""}
    assert max(state.position_m[2] for state in states) > states[0].position_m[2] + 0.01  # it did climb


def test_edge_of_the_field_aborts(plant_on):
    plant = plant_on(plane())
    plant.reset(Pose(3.4, 0.0))
    with pytest.raises(PlantAbortError, match="from the field's edge"):
        run(plant, (WheelDrive(0.0, 1.1),) * 4, 5)


def test_same_field_and_commands_give_the_same_bits(plant_on):
    sums = []
    for _ in range(2):
        sha = hashlib.sha256()
        for state in run(plant_on(rough(3)), (WheelDrive(0.2, 1.1),) * 4, 3):
            sha.update(state.position_m.tobytes() + state.quaternion_xyzw.tobytes() + repr(state.wheels).encode())
        sums.append(sha.hexdigest())
    assert sums[0] == sums[1]


def test_step_of_5_ms_ends_within_5_mm_of_2_ms(plant_on):
    ends = [
        run(plant_on(rough(4, ratio=0.0), step_ns=step_ns), (WheelDrive(0.0, 1.1),) * 4, 10)[-1].position_m
        for step_ns in (2_000_000, 5_000_000)
    ]
    assert np.linalg.norm(ends[0] - ends[1]) < 0.005


def test_poses_of_the_last_100_ms_lie_between_the_ticks(plant_on):
    plant = plant_on(plane())
    states = run(plant, (WheelDrive(0.0, 1.1),) * 4, 3)
    times = np.array([2_910_000_000, 2_995_000_000, 3_000_000_000])
    positions, quaternions = plant.poses_at(times)
    np.testing.assert_allclose(positions[[0, 2]], [states[-10].position_m, states[-1].position_m])
    np.testing.assert_allclose(positions[1], (states[-2].position_m + states[-1].position_m) / 2)
    np.testing.assert_allclose(np.linalg.norm(quaternions, axis=1), 1)
    with pytest.raises(ValueError, match="poses are known from"):
        plant.poses_at(np.array([1_000_000_000]))


def test_rays_do_not_see_the_rover_itself(plant_on):
    plant = plant_on(plane())
    origins = np.array([[0.0, 0.0, 1.0], [0.3, 0.0, 0.7]])
    ranges = plant.cast(origins, np.broadcast_to([0.0, 0.0, -1.0], (2, 3)), 30.0)
    np.testing.assert_allclose(ranges, [1.0, 0.7], atol=1e-6)


def test_steps_that_do_not_divide_the_tick_are_refused():
    with pytest.raises(ValueError, match="does not divide"):
        Plant(plane(), step_ns=4_166_667)


def test_a_wheel_without_torque_rolls_along_slower_than_ordered_and_draws_nothing(plant_on):
    plant = plant_on(plane(10), step_ns=5_000_000)
    plant.set_motor(4, 0.0)
    state = run(plant, (WheelDrive(0.0, 1.1),) * 4, 4)[-1]
    assert state.wheels[3].torque_nm == 0.0
    assert 0.7 < state.wheels[3].rate_radps < 1.09
    assert [wheel.rate_radps for wheel in state.wheels[:3]] == pytest.approx([1.1] * 3, abs=1e-3)


def test_a_jammed_wheel_stands_at_once_and_is_dragged(plant_on):
    plant = plant_on(plane(), step_ns=5_000_000)
    run(plant, (WheelDrive(0.0, 1.1),) * 4, 2)
    plant.jam(2, True)
    state = run(plant, (WheelDrive(0.0, 1.1),) * 4, 0.2)[-1]
    assert abs(state.wheels[1].rate_radps) < 1e-3
    assert state.velocity_mps[0] > 0.05


def test_a_rover_stops_in_a_patch_of_dust_and_goes_on_when_it_is_swept_away(plant_on):
    plant = plant_on(plane(), step_ns=5_000_000)
    run(plant, (WheelDrive(0.0, 1.1),) * 4, 2)
    plant.patches.lay((float(plant.poses_at(np.array([2_000_000_000]))[0][0, 0]), 0.0), 1.0, "dust")
    assert run(plant, (WheelDrive(0.0, 1.1),) * 4, 4)[-1].velocity_mps[0] < 0.02
    plant.patches.sweep()
    assert run(plant, (WheelDrive(0.0, 1.1),) * 4, 3)[-1].velocity_mps[0] > 0.1


def test_a_wheel_that_leaves_powder_climbs_out_and_is_not_thrown_out(plant_on):
    plant = plant_on(plane(), step_ns=5_000_000)
    run(plant, (WheelDrive(0.0, 1.1),) * 4, 2)
    plant.patches.lay((float(plant.poses_at(np.array([2_000_000_000]))[0][0, 0]) + 0.8, 0.0), 0.6, "powder")
    states = run(plant, (WheelDrive(0.0, 1.1),) * 4, 30)
    assert states[-1].position_m[0] > states[0].position_m[0] + 2.2
    assert max(abs(state.velocity_mps[2]) for state in states) < 0.05


def test_a_soil_between_two_is_either_at_its_ends():
    one, other = CLASSES["nominal"], CLASSES["powder"]
    assert mixed(one, other, 0.0) == pytest.approx(one)
    assert mixed(one, other, 1.0) == pytest.approx(other)
    half = mixed(one, other, 0.5)
    assert half.stiffness_npm3**2 == pytest.approx(one.stiffness_npm3 * other.stiffness_npm3)
    assert half.tan_phi == pytest.approx((one.tan_phi + other.tan_phi) / 2)
