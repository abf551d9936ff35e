"""A plan becomes an .npz and comes back; bytes that are none are refused."""

import math

import numpy as np
import pytest

from onboard.planning import archive
from onboard.planning.mission_rule import MissionState, Stop
from onboard.planning.plan_records import PlanReport, PlanResult
from onboard.planning.sensing.next_position import Choice, NextPosition
from onboard.records import Decision, Grid, NodeSet, Path, Pose

GRID = Grid(-1.95, -0.95, 0.1, 20, 40)


def made(score=True, target=(1.0, 0.5)):
    heights = np.linspace(0, 1, 800, dtype=np.float32).reshape(20, 40)
    heights[3, 5] = np.nan
    sets = np.full((20, 40), NodeSet.FREE, np.uint8)
    sets[:, 30:] = NodeSet.OBSTACLE
    path = Path(np.array([[0, 0, 0], [1, 0, 0.5]]))
    decision = Decision("drive", "R5", "1.00 m to the last free pose", path, 0.25, {"target_m": target})
    found = NextPosition(
        Choice((3, 4), 0.5, -0.5, 1.0, 0.7, 0.8, -0.1, 0.8, 120.0, 4.0),
        (Choice((9, 4), 0.5, 1.5, -1.0, 0.5, 0.6, -0.1, 0.6, 20.0, 4.0),),
        heights.astype(np.float64) * 2,
        {"not free": 1},
    )
    report = PlanReport(
        GRID,
        sets,
        heights,
        np.array([[0.0, 0.0], [5.0, 1.0]]),
        np.zeros((0, 2)),
        found if score else None,
    )
    state = MissionState(number=1, stops=(Stop(0, 0, 0), Stop(0, 0, math.pi)), marked=((2.0, 1.0),))
    return PlanResult(decision, state, report, Pose(0.0, 0.1, 0.02, yaw_rad=0.3), (5.0, 1.0))


def test_every_key_comes_back_as_it_went_in():
    result = made()
    picture = archive.from_npz(archive.to_npz(result))
    assert picture.grid == GRID
    np.testing.assert_array_equal(picture.heights_m, result.report.z_mean)
    np.testing.assert_array_equal(picture.node_sets, result.report.node_sets)
    np.testing.assert_array_equal(picture.score_map, result.report.next_position.score_map.astype(np.float32))
    np.testing.assert_array_equal(picture.path, result.decision.path.stations)
    np.testing.assert_array_equal(picture.global_path, result.report.global_path)
    assert (picture.kind, picture.rule, picture.reason) == ("drive", "R5", "1.00 m to the last free pose")
    assert picture.heading_rad == 0.25
    assert picture.pose.tolist() == [0.0, 0.1, 0.02, 0.3]
    assert picture.goal_m.tolist() == [5.0, 1.0]
    assert picture.target_m.tolist() == [[1.0, 0.5]]
    assert picture.scoring == "E = 0.800 - 0.100 = 0.700, best of 799 of 800 cells scored (1 not free)"
    assert picture.choice.tolist() == [[0.5, -0.5, 1.0, 0.7]]
    assert picture.alternatives.tolist() == [[0.5, 1.5, -1.0, 0.5]]
    assert picture.stops.tolist() == [[0, 0, 0], [0, 0, math.pi]]
    assert picture.marked.tolist() == [[2.0, 1.0]]


def test_what_is_absent_has_no_rows():
    picture = archive.from_npz(archive.to_npz(made(score=False, target=None)))
    assert picture.score_map.shape == (0, 0)
    assert picture.choice.shape == picture.alternatives.shape == (0, 4)
    assert picture.scoring == ""
    assert picture.target_m.shape == picture.optimistic_path.shape == (0, 2)


def test_the_same_plan_gives_the_same_bytes():
    assert archive.to_npz(made()) == archive.to_npz(made())


@pytest.mark.parametrize("data", [b"", b"PK\x03\x04 cut", archive.to_npz(made())[:400]])
def test_bytes_that_are_no_archive_are_refused(data):
    with pytest.raises(ValueError, match="not the archive of a plan"):
        archive.from_npz(data)
