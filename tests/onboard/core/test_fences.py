"""Keep-outs and goal fences: what the planner, the monitor and the orders make of them."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard import config
from onboard.core.rover import Rover
from onboard.planning.fenced import MARGIN_M, STAND_M, closed, fenced, keep_out
from onboard.planning.fences import GOAL, KEEP_OUT, Fence, entered, from_json, goal_refused, to_json
from onboard.planning.local.poses import ORIENTATIONS, Freedom
from onboard.records import Gdem, Grid, Pose
from onboard.records.status import SaveResult
from protocol.link.transactions import RequestState
from protocol.tables.faults import BY_NAME
from protocol.tables.modes import Mode, Phase
from tests.onboard.core_bench import CoreBench, first_map, quick

ROVER = config.Rover()
SQUARE = Fence("pit", KEEP_OUT, ((2.0, 1.0), (4.0, 1.0), (4.0, 3.0), (2.0, 3.0)))
CONCAVE = Fence("bay", KEEP_OUT, ((0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (2.0, 3.0), (2.0, 1.0), (0.0, 1.0)))
PLACES = st.tuples(st.floats(-1.0, 5.0), st.floats(-1.0, 5.0))
YAWS = st.floats(-math.pi, math.pi)


def body(pose, step=0.02):
    """Points of the rover's rectangle, the edge included."""
    x, y = np.meshgrid(np.arange(-0.475, 0.4751, step), np.append(np.arange(-0.28, 0.28, step), 0.28))
    c, s = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    return np.column_stack([(pose.x_m + c * x - s * y).ravel(), (pose.y_m + s * x + c * y).ravel()])


# -- geometry --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("point", "distance_m"),
    [
        ((3.0, 2.0), 0.0),
        ((2.0, 1.0), 0.0),
        ((1.0, 2.0), 1.0),
        ((5.0, 4.0), math.sqrt(2)),
        ((3.0, 0.5), 0.5),
    ],
)
def test_the_distance_to_a_square_worked_by_hand(point, distance_m):
    assert SQUARE.distance_m(point) == pytest.approx(distance_m)


def test_a_bay_of_a_polygon_is_outside():
    assert CONCAVE.distance_m((1.0, 2.0)) == pytest.approx(1.0)
    assert CONCAVE.distance_m((2.5, 2.0)) == 0.0


@given(PLACES, YAWS, st.sampled_from([SQUARE, CONCAVE]))
@settings(max_examples=150, deadline=None, derandomize=True)
def test_a_keep_out_is_entered_where_a_point_of_the_body_is_in_it(place, yaw, fence):
    pose = Pose(*place, yaw_rad=yaw)
    nearest_m = min(fence.distance_m(tuple(point)) for point in body(pose, 0.05).tolist())
    if nearest_m == 0.0:
        assert entered((fence,), pose, ROVER) == fence.name
    if nearest_m > 0.05:
        assert entered((fence,), pose, ROVER) == ""


def test_a_keep_out_smaller_than_the_rover_and_one_around_it_are_entered():
    nail = Fence("nail", KEEP_OUT, ((0.1, 0.0), (0.12, 0.0), (0.1, 0.02)))
    field = Fence("field", KEEP_OUT, ((-9.0, -9.0), (9.0, -9.0), (0.0, 9.0)))
    assert entered((nail,), Pose(0.0, 0.0), ROVER) == "nail" and entered((field,), Pose(0.0, 0.0), ROVER) == "field"
    assert entered((replace(field, kind=GOAL),), Pose(0.0, 0.0), ROVER) == ""


# -- the planner -----------------------------------------------------------------------------------------------


@given(PLACES, st.integers(0, ORIENTATIONS - 1), st.sampled_from([SQUARE, CONCAVE]))
@settings(max_examples=60, deadline=None, derandomize=True)
def test_no_pose_that_is_left_free_touches_a_keep_out_whatever_its_heading_within_the_orientation(place, o, fence):
    grid = Grid(-1.95, -1.95, 0.1, 80, 80)
    free = np.full((ORIENTATIONS, 80, 80), Freedom.FREE, np.uint8)
    out = fenced(free, (fence,), grid, ROVER, (-100.0, -100.0))
    j, i = grid.cell(*place)
    if out[o, j, i] == Freedom.FREE:
        for off in (-math.pi / 16, 0.0, math.pi / 16):
            assert entered((fence,), Pose(*grid.centre(j, i), yaw_rad=o * math.pi / 8 + off), ROVER) == ""
    if fence.distance_m(grid.centre(j, i)) > math.hypot(0.475 + MARGIN_M, 0.28 + MARGIN_M) + 0.15:
        assert out[o, j, i] == Freedom.FREE


def test_beside_the_rover_the_margin_does_not_count_so_that_it_can_leave_where_it_backed_off_to():
    grid, here_m = Grid(-1.95, -1.95, 0.1, 80, 80), (1.35, 2.0)  # its bow 0.17 m before the edge, half a cell counts
    free = np.full((ORIENTATIONS, 80, 80), Freedom.FREE, np.uint8)
    j, i = grid.cell(*here_m)
    assert fenced(free, (SQUARE,), grid, ROVER, here_m)[0, j, i] == Freedom.FREE
    assert fenced(free, (SQUARE,), grid, ROVER, (here_m[0] - STAND_M - 0.2, 2.0))[0, j, i] == Freedom.BLOCKED


def test_cells_of_a_keep_out_are_those_its_polygon_touches():
    grid = Grid(0.05, 0.05, 0.1, 60, 60)
    cells = keep_out((SQUARE, replace(SQUARE, kind=GOAL)), grid)
    for j, i in np.ndindex(cells.shape):
        distance_m = SQUARE.distance_m(grid.centre(j, i))
        assert cells[j, i] == (distance_m <= 0.071) or abs(distance_m - 0.071) < 1e-6


def test_the_orbiters_map_is_closed_where_a_keep_out_holds_a_cells_centre_and_stays_itself_without_one():
    gdem = Gdem(Grid(0.5, 0.5, 1.0, 6, 6), np.zeros((6, 6), np.float32))
    shut = closed(gdem, (SQUARE,))
    assert np.argwhere(np.isnan(shut.heights_m)).tolist() == [[1, 2], [1, 3], [2, 2], [2, 3]]
    assert closed(gdem, ()) is gdem and not np.isnan(gdem.heights_m).any()


# -- orders ----------------------------------------------------------------------------------------------------


def add(rover, name, kind, *corners_m):
    request = rover.order("fence_add", fence=name, kind=kind, corners_m=corners_m)
    rover.run(0.05)
    return request


@pytest.fixture(scope="module")
def known():
    return first_map()


@pytest.fixture
def standing(known):
    rover = CoreBench(memory=known)
    rover.settle()
    return rover


def test_a_goal_outside_the_goal_fence_or_in_a_keep_out_is_refused_with_its_name(standing):
    add(standing, "site", GOAL, -5, -5, 5, -5, 5, 5, -5, 5)
    add(standing, "pit", KEEP_OUT, 2, 1, 4, 1, 4, 3, 2, 3)
    outside, inside = standing.goto(6.0, 0.0), standing.order("mission", goals_m=(1.0, 0.0, 3.0, 2.0))
    standing.run(0.05)
    assert standing.text(outside) == "(6.0, 0.0) is outside the goal fence (site)"
    assert standing.text(inside) == "(3.0, 2.0) is in keep-out `pit`"
    assert standing.mode is Mode.STANDBY


def test_a_fence_whose_edges_cross_is_refused(standing):
    request = add(standing, "bow", KEEP_OUT, 0, 0, 2, 2, 2, 0, 0, 2)
    assert standing.states(request) == [RequestState.FAILED] and standing.rover.fences.fences == ()
    assert standing.text(request) == "the edges of bow cross: give its corners in their order around it"
    assert not CONCAVE.crosses_itself


def test_a_cleared_fence_is_no_longer_in_force(standing):
    add(standing, "site", GOAL, -1, -1, 1, -1, 1, 1)
    wrong = standing.order("fence_clear", fence="sight")
    standing.order("fence_clear", fence="site")
    standing.run(0.05)
    assert standing.text(wrong) == "unknown fence `sight`; did you mean `site`?"
    assert standing.rover.fences.fences == () and goal_refused((), (6.0, 0.0)) == ""


def test_the_17th_fence_is_refused_and_one_of_a_known_name_is_replaced(standing):
    for n in range(16):
        add(standing, f"f{n}", KEEP_OUT, 50, 50 + n, 51, 50 + n, 51, 51 + n)
    refused = add(standing, "f16", KEEP_OUT, 0, 0, 1, 0, 1, 1)
    replaced = add(standing, "f3", KEEP_OUT, 60, 60, 61, 60, 61, 61)
    assert standing.states(refused) == [RequestState.FAILED] and standing.states(replaced) == [RequestState.COMPLETED]
    assert len(standing.rover.fences.fences) == 16


def test_fences_are_kept_at_each_change_and_in_force_at_the_next_start():
    rover = CoreBench(settings=quick(state=config.State(folder="somewhere")))
    rover.settle()
    request = rover.order("fence_add", fence="pit", kind=KEEP_OUT, corners_m=(2, 1, 4, 1, 4, 3))
    (save,) = rover.step().saves
    rover.saved = (SaveResult("fences"),)
    rover.run(0.05)
    assert rover.text(request) == "pit, keep_out of 3 corners; kept"
    again = Rover(config.Config(), None, None, {"fences": save.data})
    assert again.fences.fences == rover.rover.fences.fences == from_json(to_json(again.fences.fences))


@pytest.mark.parametrize("kept", [b"[", b"{}x", b'[{"name": 1}]', b'[{"name": "a", "kind": "no", "corners_m": []}]'])
def test_kept_fences_that_cannot_be_read_are_said(kept):
    assert [event.name for event in Rover(config.Config(), None, None, {"fences": kept}).fences.events] == ["FENCE"]


def test_a_keep_out_drawn_across_the_way_backs_the_rover_off_and_it_goes_round(known):
    rover = CoreBench(memory=known)
    rover.settle()
    request = rover.goto(2.5, 0.0)
    rover.until(lambda: rover.pose[0] > 0.5, 60.0)
    x_m = rover.pose[0] + 0.475
    rover.order("fence_add", fence="pit", kind=KEEP_OUT, corners_m=(x_m + 0.1, -0.3, x_m + 0.4, -0.3, x_m + 0.25, 0.3))
    rover.until_phase(Phase.BACKING_OFF)
    stood = rover.pose[0]
    fence = rover.rover.fences.fences
    truth = Pose(rover.pose[0] + 0.02, rover.pose[1], yaw_rad=rover.pose[2])
    assert entered(fence, truth, ROVER) == "pit" and rover.told("FAULT")[-1][1].startswith("KEEP_OUT")
    rover.until_phase(Phase.SCANNING)
    assert stood - rover.pose[0] > 0.2
    touched = []

    def done():
        touched.append(entered(fence, Pose(*rover.pose[:2], yaw_rad=rover.pose[2]), ROVER))
        return bool(rover.states(request)) and RequestState(rover.states(request)[-1]).final

    rover.until(done, 300.0)
    assert rover.states(request)[-1] is RequestState.COMPLETED and not any(touched)
    assert len(rover.told("FAULT")) == 1 <= BY_NAME["KEEP_OUT"].tries


def test_the_operators_drive_ends_at_a_keep_out_and_may_leave_it(standing):
    add(standing, "wall", KEEP_OUT, 0.9, -1, 1.2, -1, 1.2, 1, 0.9, 1)
    request = standing.order("drive", vx_mps=0.1, vy_mps=0.0, yaw_radps=0.0, duration_s=30.0, distance_m=3.0)
    assert standing.until_final(request) is RequestState.FAILED and standing.text(request).startswith("KEEP_OUT")
    assert 0.4 < standing.pose[0] < 0.45
    away = standing.order("drive", vx_mps=-0.1, vy_mps=0.0, yaw_radps=0.0, duration_s=30.0, distance_m=0.3)
    assert standing.until_final(away) is RequestState.COMPLETED
    assert entered(standing.rover.fences.fences, Pose(*standing.pose[:2]), ROVER) == "" and standing.pose[0] < 0.3
