"""Cells that no beam told of: kept until a near scan tells of them, occluded for whoever plans."""

import math
from dataclasses import replace

import numpy as np
import pytest

from onboard.perception.map import unseen_cells
from onboard.perception.map.cell_classes import classify
from onboard.perception.map.ldem import REPLACING_HITS, window
from onboard.perception.map.stop_map import look, remember
from onboard.perception.map.unseen_cells import updated, without_unseen
from onboard.planning.cycle import freedom_of, surface_of
from onboard.planning.local.poses import Freedom
from onboard.planning.mission_rule import MissionState
from onboard.planning.plan_records import PlanRequest
from onboard.planning.prediction import settings_of, shown
from onboard.records import CellClass, Cloud, Pose
from tests.onboard.loss_rig import CONFIG, TRACK, beams_from, sweep
from tests.onboard.perception.scan.test_dark_regions import box

HERE, BOX_M = np.eye(4), (3.06, 0.13)
NO_DARK = np.empty((0, 3))


def scan_of(points_m, origin_m=(0.0, 0.0, 0.7), hit=True):
    points = np.array(points_m, np.float32).reshape(-1, 3)
    return Cloud(np.array(origin_m), points, np.full(len(points), hit))


def after(unseen, seen, dark_m=NO_DARK):
    return updated(unseen, np.asarray(dark_m, np.float64), seen, 0.1, 5.0)


@pytest.fixture(scope="module")
def memory():
    """One sweep over level ground with a dark box."""
    beams = beams_from()
    seen = look(sweep(beams, box(*BOX_M, beams=beams)), TRACK, HERE, None, CONFIG)
    return remember(None, seen.cloud_base, HERE, 0, CONFIG, seen.dark_base_m)


def request_of(memory):
    pose = Pose(0.0, 0.0)
    return PlanRequest(
        window(memory.cells, 0.0, 0.0, CONFIG.mapping.size_m),
        pose,
        (6.0, 0.0),
        None,
        MissionState(),
        settings_of(CONFIG),
        np.zeros((1, 3)),
        unseen_m=memory.unseen_m,
    )


def test_the_cells_of_dark_points_are_kept_once_each_and_sorted():
    cells = after((), scan_of([]), [(1.01, 0.02, 0), (1.09, 0.08, 0), (-0.01, 2.0, 0)])
    assert np.array(cells) == pytest.approx(np.array([(-0.05, 2.05), (1.05, 0.05)]))
    assert after(cells, scan_of([]), [(1.05, 0.05, 0)]) == cells


@pytest.mark.parametrize(("hits", "at_m", "dark", "kept"), [
    (REPLACING_HITS, 1.05, False, False), (REPLACING_HITS - 1, 1.05, False, True), (REPLACING_HITS, 1.05, True, True),
    (REPLACING_HITS, 1.15, False, True),
])  # fmt: skip
def test_a_cell_leaves_when_a_near_scan_hits_it_and_does_not_find_it_dark(hits, at_m, dark, kept):
    cells = after((), scan_of([]), [(1.05, 0.05, 0)])
    seen = scan_of([(at_m, 0.05, 0)] * hits)
    assert bool(after(cells, seen, [(1.05, 0.05, 0)] if dark else NO_DARK)) == kept


@pytest.mark.parametrize("seen", [
    scan_of([(1.05, 0.05, 0)] * 9, origin_m=(8.0, 0.0, 0.7)), scan_of([(1.05, 0.05, 0)] * 9, hit=False),
])  # fmt: skip
def test_hits_from_afar_and_beams_without_a_hit_do_not_free_a_cell(seen):
    cells = after((), scan_of([]), [(1.05, 0.05, 0)])
    assert after(cells, seen) == cells


def test_no_more_than_so_many_are_kept_and_the_nearest_are(monkeypatch):
    monkeypatch.setattr(unseen_cells, "MOST", 3)
    cells = after((), scan_of([]), [(x + 0.05, 0.05, 0) for x in (6.0, 1.0, 3.0, 2.0, 9.0)])
    assert [x for x, _ in cells] == pytest.approx([1.05, 2.05, 3.05])


def test_an_unseen_cell_is_occluded_and_none_changes_nothing(memory):
    surface = classify(memory.cells, CONFIG.mapping)
    place = surface.grid.centre(*surface.grid.cell(2.0, 0.0))
    changed = without_unseen(surface, (place, (1e6, 0.0)))
    at = surface.grid.cell(*place)
    assert surface.cell_class[at] >= CellClass.HIT and changed.cell_class[at] == CellClass.OCCLUDED
    assert np.isnan([changed.z_mean[at], changed.z_top[at], changed.z_bot[at]]).all() and changed.z_ray[at] == np.inf
    assert (changed.cell_class != surface.cell_class).sum() == 1
    assert without_unseen(surface, ()) is surface


def test_no_pose_over_a_dark_box_is_free_in_the_plan_nor_in_what_the_ground_is_shown(memory):
    request = request_of(memory)
    surface = surface_of(request)
    grid, freedom = surface.grid, freedom_of(request, surface)
    centres = np.array([grid.centre(j, i) for j, i in np.ndindex(grid.rows, grid.columns)]).reshape(
        grid.rows, grid.columns, 2
    )
    rover = CONFIG.rover
    over = 0
    for o, j, i in np.argwhere(freedom == Freedom.FREE):
        yaw = o * math.pi / 8
        c, s = math.cos(yaw), math.sin(yaw)
        x, y = BOX_M[0] - centres[j, i, 0], BOX_M[1] - centres[j, i, 1]
        over += abs(c * x + s * y) < rover.half_wheelbase_m and abs(c * y - s * x) < rover.half_track_m
    assert over == 0
    assert (freedom == Freedom.FREE).sum() > 10_000
    product, poses = shown(request, True)
    assert np.array_equal(poses.freedom, freedom)
    assert all(np.isnan(product.heights_m[grid.cell(*place)]) for place in memory.unseen_m)
    assert (freedom_of(replace(request, unseen_m=()), surface) != freedom).sum() == 0


def test_the_map_keeps_the_cells_while_the_box_is_dark_and_forgets_them_when_it_is_gone(memory):
    assert 4 <= len(memory.unseen_m) <= 30
    assert min(math.dist(place, BOX_M) for place in memory.unseen_m) < 0.1
    beams = beams_from()
    again = look(sweep(beams, box(*BOX_M, beams=beams)), TRACK, HERE, None, CONFIG)
    kept = remember(memory, again.cloud_base, HERE, 1, CONFIG, again.dark_base_m)
    assert kept.unseen_m == memory.unseen_m
    bare = look(sweep(beams, np.zeros(beams.range_m.shape, bool)), TRACK, HERE, None, CONFIG)
    assert remember(kept, bare.cloud_base, HERE, 2, CONFIG, bare.dark_base_m).unseen_m == ()
