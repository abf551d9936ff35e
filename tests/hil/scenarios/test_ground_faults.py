"""A trench or a step that comes to lie across the way: in the ground of wheels and beams alike, where the seed says."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.faults import ground_faults
from hil.faults.ground_faults import KINDS, across
from hil.plant.plant import Plant
from hil.terrain.grounds import flat_field
from hil.world.truth import Truth
from onboard.records import Pose

WAY_M = np.array([[0.0, 0.0], [1.0, 0.0], [8.0, 0.0]])


@given(st.integers(0, 10_000))
def test_it_lies_across_the_way_2_5_to_7_m_from_its_begin(seed):
    made = across(KINDS["trench"], WAY_M, seed)
    assert ground_faults.NEAREST_M <= made.x_m <= ground_faults.FARTHEST_M
    assert (made.y_m, made.yaw_rad) == (0.0, 0.0)


def test_on_a_way_too_short_for_it_there_is_none():
    assert across(KINDS["step"], WAY_M[:2], 1) is None


def test_round_a_bend_it_lies_across_the_part_that_it_is_on():
    way_m = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 9.0]])
    made = across(KINDS["step"], way_m, 3)
    assert made.x_m == pytest.approx(1.0)
    assert made.yaw_rad == pytest.approx(math.pi / 2)


@pytest.fixture(scope="module", params=sorted(KINDS))
def changed(request):
    plant = Plant(flat_field(1).field, step_ns=5_000_000)
    obstacle = across(KINDS[request.param], WAY_M[:, :] * 0.6, 1)
    plant.reshape(obstacle.dug(plant.field))
    yield plant, obstacle
    plant.close()


def test_beams_from_above_meet_its_depth_or_height_inside_and_the_old_ground_outside(changed):
    plant, obstacle = changed
    along = np.array([-0.2, obstacle.kind.along_m / 2, obstacle.kind.along_m + 0.2])
    origins = np.column_stack([obstacle.x_m + along, np.full(3, obstacle.y_m), np.full(3, 1.0)])
    found = plant.cast(origins, np.tile([0.0, 0.0, -1.0], (3, 1)), 5.0)
    assert 1.0 - found == pytest.approx([0.0, obstacle.kind.rise_m, 0.0], abs=1e-3)


def test_the_rover_stands_as_before_where_the_ground_is_as_before(changed):
    plant, _ = changed
    heights = [plant.step().position_m[2] for _ in range(20)]
    assert np.ptp(heights) < 1e-4


def test_wheels_sink_into_a_ground_that_gives_way_under_them():
    plant = Plant(flat_field(1).field, step_ns=5_000_000)
    before_m = plant.step().position_m[2]
    plant.reshape(plant.field.soil_z - np.float32(0.02))
    for _ in range(150):
        state = plant.step()
    plant.close()
    assert state.position_m[2] - before_m == pytest.approx(-0.02, abs=2e-3)


def test_other_ground_of_another_size_is_refused(changed):
    plant, _ = changed
    with pytest.raises(ValueError, match="on a grid"):
        plant.reshape(np.zeros((3, 3), np.float32))


def test_a_collapse_rolls_the_rover_to_its_left_however_it_is_turned():
    field = replace(flat_field(1).field, start=Pose(1.0, 0.0, yaw_rad=2.0))
    plant = Plant(field, step_ns=5_000_000)
    state = plant.reset(field.start)
    ground_faults.collapse(SimpleNamespace(plant=plant, state=state, truth=Truth()), None, 0)
    for _ in range(150):
        state = plant.step()
    plant.close()
    roll, pitch = state.pose.roll_rad, state.pose.pitch_rad
    assert roll < -math.radians(12.0) and abs(pitch) < math.radians(3.0)
