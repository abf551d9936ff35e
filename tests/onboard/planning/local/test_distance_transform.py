"""The chapter's local planner against raster sweeps."""

import numpy as np
import pytest

from onboard.planning.local import distance_transform as dt


def sweeps(free, goals, cell_m):
    """Raster sweeps forth and back until nothing changes."""
    rows, columns = free.shape
    cost = np.where(goals & free, 0.0, np.inf)
    changed = True
    while changed:
        before = cost.copy()
        for order in (1, -1):
            for j in range(rows)[::order]:
                for i in range(columns)[::order]:
                    if not free[j, i]:
                        continue
                    for dj, di in dt.NEIGHBOURS:
                        a, b = j + dj, i + di
                        if not (0 <= a < rows and 0 <= b < columns) or not free[a, b]:
                            continue
                        if dj and di and not (free[a, i] or free[j, b]):
                            continue
                        cost[j, i] = min(cost[j, i], cost[a, b] + cell_m * np.hypot(dj, di))
        changed = not np.array_equal(cost, before)
    return cost


@pytest.mark.parametrize("seed", range(4))
def test_field_equals_the_raster_sweeps_on_random_ground(seed):
    rng = np.random.default_rng(seed)
    free = rng.random((24, 30)) < 0.65
    goals = np.zeros_like(free)
    goals[12, 15:17] = True
    free[12, 15] = True
    np.testing.assert_allclose(dt.cost_to_go(free, goals, 0.1), sweeps(free, goals, 0.1), rtol=1e-5)


def test_no_way_leads_diagonally_between_two_obstacles():
    free = np.ones((4, 4), dtype=bool)
    free[0, 1] = free[1, 0] = False
    goals = np.zeros_like(free)
    goals[0, 0] = True
    cost = dt.cost_to_go(free, goals, 1.0)
    assert np.isinf(cost[1, 1])
    free[0, 1] = True
    assert dt.cost_to_go(free, goals, 1.0)[1, 1] == pytest.approx(np.sqrt(2))


def test_descent_falls_strictly_to_the_goal_over_free_cells():
    rng = np.random.default_rng(7)
    free = rng.random((40, 40)) < 0.75
    goals = np.zeros_like(free)
    goals[35, 35] = free[35, 35] = free[2, 2] = True
    cost = dt.cost_to_go(free, goals, 0.1)
    cells = dt.descend(cost, free, (2, 2))
    along = cost[cells[:, 0], cells[:, 1]]
    assert tuple(cells[-1]) == (35, 35)
    assert np.all(np.diff(along) < 0)
    assert free[cells[:, 0], cells[:, 1]].all()


def test_an_unreachable_goal_has_an_infinite_cost_and_no_way():
    free = np.ones((10, 10), dtype=bool)
    free[:, 5] = False
    goals = np.zeros_like(free)
    goals[5, 8] = True
    cost = dt.cost_to_go(free, goals, 0.1)
    assert np.isinf(cost[5, 1])
    assert len(dt.descend(cost, free, (5, 1))) == 0


def test_closeness_is_paid_per_length():
    free = np.ones((1, 3), dtype=bool)
    goals = np.array([[True, False, False]])
    cost = dt.cost_to_go(free, goals, 0.1, np.array([[0.0, 1.0, 1.0]], np.float32))
    np.testing.assert_allclose(cost, [[0.0, 0.15, 0.35]], rtol=1e-5)


def test_headings_point_along_the_way():
    np.testing.assert_allclose(dt.headings(np.array([[0, 0], [0, 1], [1, 1]])), [0.0, np.pi / 2, np.pi / 2])
