"""The contract of planning.local.planners.PLANNERS, run over the whole table."""

import dataclasses
import math

import numpy as np
import pytest

from onboard.config import Planning
from onboard.planning.local.contract import Problem
from onboard.planning.local.path import is_free
from onboard.planning.local.planners import PLANNERS
from onboard.planning.local.poses import Freedom
from onboard.records import Grid

GRID = Grid(0.05, 0.05, 0.1, 60, 50)


def problem(freedom, start=(0.55, 0.55, 0.3), goal=(50, 40)):
    goals = np.zeros(freedom.shape, dtype=bool)
    goals[:, goal[0], goal[1]] = True
    return Problem(freedom, GRID, start, goals, Planning())


def wall_with_gap():
    freedom = np.full((8, 60, 50), Freedom.FREE, dtype=np.uint8)
    freedom[:, 25:30, :35] = Freedom.BLOCKED
    freedom[:, 40:44, 30:] = Freedom.UNKNOWN
    return freedom


def test_table_and_configuration_name_the_same_planners():
    row = next(f for f in dataclasses.fields(Planning) if f.name == "planner")
    assert set(row.metadata["one_of"]) == set(PLANNERS)


@pytest.mark.parametrize("name", PLANNERS)
def test_reaches_the_goal_over_free_poses_only(name):
    asked = problem(wall_with_gap())
    plan = PLANNERS[name]().plan(asked)
    assert plan.path is not None
    np.testing.assert_allclose(plan.path.stations[0], asked.start)
    assert math.dist(plan.path.stations[-1, :2], GRID.centre(50, 40)) < 1e-6
    assert is_free(plan.path.stations, asked.freedom, GRID)
    straight = math.dist(asked.start[:2], GRID.centre(50, 40))
    assert straight < plan.path.length_m <= plan.cost_m + 0.2


@pytest.mark.parametrize("name", PLANNERS)
def test_reports_an_unreachable_goal_with_a_reason(name):
    freedom = wall_with_gap()
    freedom[:, 25:30] = Freedom.BLOCKED
    plan = PLANNERS[name]().plan(problem(freedom))
    assert plan.path is None
    assert plan.cost_m == math.inf
    assert plan.reason


@pytest.mark.parametrize("name", PLANNERS)
def test_never_plans_over_unknown_poses(name):
    freedom = wall_with_gap()
    freedom[:, 25:30, 35:] = Freedom.UNKNOWN
    assert PLANNERS[name]().plan(problem(freedom)).path is None


@pytest.mark.parametrize("name", PLANNERS)
def test_a_start_off_the_grid_or_not_free_is_reported(name):
    freedom = wall_with_gap()
    assert PLANNERS[name]().plan(problem(freedom, start=(-3.0, 0.0, 0.0))).path is None
    assert PLANNERS[name]().plan(problem(freedom, start=(0.55, 2.75, 0.0))).path is None


@pytest.mark.parametrize("name", PLANNERS)
@pytest.mark.parametrize("seed", range(3))
def test_random_ground_gives_the_same_free_path_each_time(name, seed):
    rng = np.random.default_rng(seed)
    blocked = np.kron(rng.random((12, 10)) < 0.15, np.ones((5, 5), dtype=bool))
    freedom = np.where(blocked, Freedom.BLOCKED, Freedom.FREE).astype(np.uint8) * np.ones((8, 1, 1), np.uint8)
    freedom[:, 4:7, 4:7] = Freedom.FREE
    asked = problem(freedom, goal=(55, 45))
    first, second = PLANNERS[name]().plan(asked), PLANNERS[name]().plan(asked)
    if first.path is None:
        assert second.path is None
        return
    assert is_free(first.path.stations, freedom, GRID)
    assert np.array_equal(first.path.stations, second.path.stations)
