"""From lattice poses to stations: every station is free, the way is short, the scanner's end leads."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.config import Planning
from onboard.planning.local import path
from onboard.planning.local.pose_field import cost_to_go, descend
from onboard.planning.local.poses import Freedom, closeness, orientation
from onboard.records import Grid

GRID = Grid(0.05, 0.05, 0.1, 40, 40)


def everywhere_free(rows=40, columns=40):
    return np.full((8, rows, columns), Freedom.FREE, dtype=np.uint8)


def solved(freedom, start_cell, goal_cell, start_yaw=0.0):
    seeds = np.array([[*goal_cell, -1]])
    cost = cost_to_go(freedom, seeds, Planning(), GRID.cell_m, False)
    start = (*start_cell, orientation(start_yaw))
    reached = np.isfinite(cost[start[2], start[0], start[1]])
    chain = descend(cost, start, Planning(), GRID.cell_m) if reached else np.empty((0, 3), np.int32)
    x, y = GRID.centre(*start_cell)
    return chain, (x + 0.02, y - 0.03, start_yaw)


def test_open_ground_is_crossed_in_one_straight_line():
    freedom = everywhere_free()
    chain, start = solved(freedom, (5, 5), (20, 36))
    way = path.drivable(chain, start, path.ground_of(freedom, GRID))
    assert way.length_m == pytest.approx(math.dist(start[:2], GRID.centre(20, 36)), abs=1e-6)
    np.testing.assert_allclose(way.stations[0], start)
    np.testing.assert_allclose(way.stations[-1, :2], GRID.centre(20, 36))


def test_stations_are_5_cm_and_11_25_degrees_apart_at_most_and_never_turn_while_moving():
    freedom = everywhere_free()
    freedom[:, 18, :30] = Freedom.BLOCKED
    chain, start = solved(freedom, (5, 5), (30, 5), start_yaw=1.0)
    stations = path.drivable(chain, start, path.ground_of(freedom, GRID)).stations
    steps = np.diff(stations, axis=0)
    moves = np.hypot(steps[:, 0], steps[:, 1])
    turns = np.abs(np.remainder(steps[:, 2] + math.pi, math.tau) - math.pi)
    assert moves.max() <= 0.05 + 1e-9
    assert turns.max() <= math.radians(11.25) + 1e-9
    assert np.all((moves < 1e-9) | (turns < 1e-9))
    assert path.is_free(stations, freedom, GRID)


def test_a_goal_behind_is_turned_to_and_a_short_retreat_is_backed():
    freedom = everywhere_free()
    chain, start = solved(freedom, (20, 30), (20, 5))
    way = path.drivable(chain, start, path.ground_of(freedom, GRID)).stations
    assert abs(way[-1, 2]) == pytest.approx(math.pi, abs=0.1)  # 2.5 m: it turned round
    chain, start = solved(freedom, (20, 30), (20, 22))
    way = path.drivable(chain, start, path.ground_of(freedom, GRID)).stations
    assert abs(way[-1, 2]) < 0.1  # 0.8 m: backwards


def test_without_room_to_turn_round_the_rover_backs_out():
    freedom = everywhere_free()
    freedom[3:6] = Freedom.BLOCKED  # no pose across the corridor
    chain, start = solved(freedom, (20, 30), (20, 5))
    stations = path.drivable(chain, start, path.ground_of(freedom, GRID)).stations
    assert path.is_free(stations, freedom, GRID)
    assert np.abs(stations[:, 2]).max() < 1.0


def test_a_line_of_sight_does_not_graze_what_the_chain_kept_away_from():
    freedom = everywhere_free()
    freedom[:, 18:22, 18:22] = Freedom.BLOCKED
    near = closeness(freedom, Planning(closeness_weight=5.0), GRID.cell_m)
    cost = cost_to_go(freedom, np.array([[22, 36, -1]]), Planning(), GRID.cell_m, False, near)
    chain = descend(cost, (22, 3, 0), Planning(), GRID.cell_m, near)
    start = (*GRID.centre(22, 3), 0.0)
    careful = path.drivable(chain, start, path.ground_of(freedom, GRID, near)).stations
    careless = path.drivable(chain, start, path.ground_of(freedom, GRID)).stations
    assert path.is_free(careful, freedom, GRID)
    assert careless[:, 1].max() < 2.3 < careful[:, 1].max() - 0.1


def test_an_end_inside_the_last_cell_is_met_exactly():
    freedom = everywhere_free()
    chain, start = solved(freedom, (5, 5), (20, 20))
    x, y = GRID.centre(20, 20)
    way = path.drivable(chain, start, path.ground_of(freedom, GRID), end=(x + 0.04, y - 0.02))
    np.testing.assert_allclose(way.stations[-1, :2], (x + 0.04, y - 0.02))


def test_an_empty_chain_is_refused():
    with pytest.raises(ValueError, match="empty chain"):
        path.drivable(np.empty((0, 3), np.int32), (0.0, 0.0, 0.0), path.ground_of(everywhere_free(), GRID))


def test_a_station_outside_the_grid_or_on_an_unknown_pose_is_not_free():
    freedom = everywhere_free()
    assert path.is_free(np.array([[1.0, 1.0, 0.0]]), freedom, GRID)
    assert not path.is_free(np.array([[-0.2, 1.0, 0.0]]), freedom, GRID)
    freedom[0, 9:11, 9:11] = Freedom.UNKNOWN
    assert not path.is_free(np.array([[1.0, 1.0, 0.0]]), freedom, GRID)
    assert path.is_free(np.array([[1.0, 1.0, 0.4]]), freedom, GRID)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10_000), yaw=st.floats(-3.1, 3.1))
def test_every_path_over_random_ground_stays_on_free_poses(seed, yaw):
    rng = np.random.default_rng(seed)
    freedom = np.where(rng.random((8, 40, 40)) < 0.12, Freedom.BLOCKED, Freedom.FREE).astype(np.uint8)
    freedom[orientation(yaw), 4, 4] = Freedom.FREE
    chain, start = solved(freedom, (4, 4), (33, 35), yaw)
    if len(chain) == 0:
        return
    end = tuple(np.array(GRID.centre(33, 35)) + rng.uniform(-0.049, 0.049, 2))
    way = path.drivable(chain, start, path.ground_of(freedom, GRID), end)
    assert path.is_free(way.stations, freedom, GRID)
    np.testing.assert_allclose(way.stations[-1, :2], end)
    again = path.drivable(chain, start, path.ground_of(freedom, GRID), end)
    assert np.array_equal(way.stations, again.stations)
