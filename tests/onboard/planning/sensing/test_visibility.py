"""Algorithm 1 and Eq. 6, corrected: what a scanner sees from a place."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.planning.sensing import visibility
from onboard.planning.sensing.visibility import Sector, VisibilityRequest
from tests.oracles import visibility as oracles

LAW = settings(max_examples=25, deadline=None, derandomize=True)
BEAMS = visibility.beams(0.9, 0.1, 60)


def rough(seed: int, shape: tuple[int, int], holes: float = 0.1) -> np.ndarray:
    rng = np.random.default_rng(seed)
    z = rng.normal(0, 0.15, shape).astype(np.float32)
    z[rng.random(shape) < holes] = np.nan
    return z


@pytest.mark.parametrize("optimistic", [True, False])
@pytest.mark.parametrize("shape", [(1, 1), (1, 23), (24, 19)])
def test_every_node_equals_the_plain_loop_on_rough_ground_with_unknown_cells(shape, optimistic):
    z = rough(1, shape)
    ground = visibility.scene(z, optimistic=optimistic)
    found = visibility.total(ground, BEAMS, 0.7)
    for node in np.ndindex(shape):
        sees, cells, seen = oracles.algorithm_1(z, visibility.predicted(z), node, (60, 9, 0.1), optimistic)
        view = visibility.from_node(ground, BEAMS, 0.7, node)
        assert {(int(j), int(i)) for j, i in np.argwhere(view.seen)} == seen
        assert found.range_cells[node] == view.range_cells == cells
        assert found.seen_cells[node] == view.seen_cells == pytest.approx(float(sees), abs=1e-3)
        assert found.index[node] == view.index == pytest.approx(float(sees) / max(cells, 1), abs=1e-6)


@pytest.mark.parametrize(("shape", "height_m"), [((1, 1), 0.0), ((7, 90), -3.3), ((80, 61), 1234.567)])
def test_flat_ground_is_seen_whole_from_everywhere(shape, height_m):
    z = np.full(shape, height_m, dtype=np.float32)
    found = visibility.total(visibility.scene(z), visibility.beams(4.0, 0.1), 0.7)
    if shape != (1, 1):
        assert (found.index == 1.0).all()
    np.testing.assert_array_equal(found.seen_cells, found.range_cells)


def test_a_lone_cell_has_nothing_to_see_and_no_ratio_of_it():
    found = visibility.total(visibility.scene(np.zeros((1, 1), np.float32)), BEAMS, 0.7)
    assert found.range_cells[0, 0] == found.seen_cells[0, 0] == found.index[0, 0] == 0.0


def test_distinct_cells_are_counted_once():
    table = visibility.beams(2.0, 0.1, 720)
    found = visibility.total(visibility.scene(np.zeros((61, 61), np.float32)), table, 0.7)
    offsets = {(int(j), int(i)) for j, i in zip(table.dj.ravel(), table.di.ravel())}
    assert found.range_cells[30, 30] == len(offsets) == table.cells


def test_a_wall_hides_what_lies_behind_it():
    low, high = np.zeros((80, 80), np.float32), np.zeros((80, 80), np.float32)
    low[:, 50], high[:, 50] = 0.05, 1.5
    table = visibility.beams(4.0, 0.1)
    over_low, over_high = (visibility.from_node(visibility.scene(z), table, 0.7, (40, 40)) for z in (low, high))
    assert not over_high.seen[40, 51:].any()
    assert over_high.seen[40, 41:51].all()
    assert over_low.seen[40, 70]
    assert over_high.index < over_low.index


def test_unknown_cells_hide_only_for_the_pessimist():
    z = np.zeros((60, 60), dtype=np.float32)
    z[:, 40] = np.nan
    table = visibility.beams(2.5, 0.1)
    assert visibility.total(visibility.scene(z), table, 0.7).index[30, 30] == 1.0
    behind = visibility.from_node(visibility.scene(z, optimistic=False), table, 0.7, (30, 30))
    assert behind.seen[30, 40]
    assert not behind.seen[30, 41:].any()


def test_a_prediction_stands_in_for_unknown_heights():
    z = np.zeros((40, 40), dtype=np.float32)
    z[20, 25:] = np.nan
    pit = np.full((40, 40), -5.0, np.float32)
    table = visibility.beams(1.5, 0.1)
    assert visibility.from_node(visibility.scene(z), table, 0.7, (20, 20)).seen[20, 26]
    assert not visibility.from_node(visibility.scene(z, pit), table, 0.7, (20, 20)).seen[20, 26]


@pytest.mark.parametrize("half_deg", [0.0, 30.0, 65.0, 180.0])
def test_newly_seen_cells_and_their_best_heading_equal_those_of_every_heading_tried(half_deg):
    ground = visibility.scene(rough(3, (23, 31), 0.4))
    half_rad = math.radians(half_deg)
    found = visibility.total(ground, BEAMS, 0.7, VisibilityRequest(new_half_rad=half_rad))
    look = oracles.Look(ground, BEAMS, 0.7)
    for node in [(0, 0), (11, 16), (22, 30), (5, 29)]:
        fresh = look.sums(node)[2]
        best = oracles.best_heading(fresh, 60, half_deg)
        assert found.new_cells[node] == best[1] / BEAMS.whole
        assert math.degrees(found.heading_rad[node]) % 360 == pytest.approx(6.0 * best[0])


def test_equal_headings_take_the_smallest_azimuth():
    z = np.zeros((21, 21), np.float32)
    z[2, 10] = z[18, 10] = z[10, 2] = z[10, 18] = np.nan
    found = visibility.total(visibility.scene(z), BEAMS, 0.7, VisibilityRequest(new_half_rad=0.0))
    assert found.heading_rad[10, 10] == 0.0
    assert found.new_cells[10, 10] > 0.0


def test_gain_counts_the_cells_beyond_the_map_in_its_denominator():
    z = np.full((9, 9), np.nan, np.float32)
    z[4, 4] = 0.0
    found = visibility.total(visibility.scene(z), BEAMS, 0.7, VisibilityRequest(new_half_rad=math.pi))
    assert found.index[4, 4] == 1.0
    assert found.new_cells[4, 4] == found.range_cells[4, 4]
    assert found.gain[4, 4] == pytest.approx(found.range_cells[4, 4] / BEAMS.cells)
    assert found.gain[4, 4] < 0.5


def test_targets_take_the_place_of_unknown_cells():
    ground = visibility.scene(rough(4, (20, 20)))
    targets = np.zeros((20, 20), bool)
    targets[10, 12] = True
    found = visibility.total(ground, BEAMS, 0.7, VisibilityRequest(new_half_rad=math.pi, targets=targets))
    for node in [(10, 10), (3, 12), (19, 19)]:
        view = visibility.from_node(ground, BEAMS, 0.7, node)
        assert (found.new_cells[node] > 0.0) == view.seen[10, 12]


@pytest.mark.parametrize("heading_deg", [-170.0, 0.0, 42.0, 90.0, 1000.0])
def test_a_sector_sees_only_what_lies_within_it(heading_deg):
    ground = visibility.scene(np.zeros((41, 41), np.float32))
    table, sector = visibility.beams(1.5, 0.1, 360), Sector(math.radians(heading_deg), math.radians(30))
    view = visibility.from_node(ground, table, 0.7, (20, 20), sector)
    j, i = np.nonzero(view.seen)
    off = np.degrees(np.arctan2(j - 20, i - 20)) - heading_deg
    far = np.hypot(j - 20, i - 20) > 10
    assert np.abs((off + 180) % 360 - 180)[far].max() <= 30 + math.degrees(math.atan(0.71 / 10))
    assert view.index == 1.0
    assert view.range_cells == pytest.approx(table.cells / 6, rel=0.05)
    assert visibility.total(ground, table, 0.7, VisibilityRequest(sector=sector)).seen_cells[20, 20] == view.seen_cells


@LAW
@given(st.integers(0, 10_000), st.booleans())
def test_sectors_that_share_the_circle_share_its_cells(seed, optimistic):
    ground = visibility.scene(rough(seed, (15, 26)), optimistic=optimistic)
    whole = visibility.total(ground, BEAMS, 0.7)
    parts = [  # 20 headings with one beam each side: 3 of 60 beams
        visibility.total(ground, BEAMS, 0.7, VisibilityRequest(sector=Sector(math.radians(18 * n), math.radians(7))))
        for n in range(20)
    ]
    np.testing.assert_array_equal(sum(part.seen_cells for part in parts), whole.seen_cells)
    np.testing.assert_array_equal(sum(part.range_cells for part in parts), whole.range_cells)


@LAW
@given(st.integers(0, 10_000))
def test_an_optimist_sees_no_less_than_a_pessimist(seed):
    z = rough(seed, (18, 27), 0.2)
    hope, doubt = (visibility.total(visibility.scene(z, optimistic=o), BEAMS, 0.7) for o in (True, False))
    assert (hope.seen_cells >= doubt.seen_cells).all()
    np.testing.assert_array_equal(hope.range_cells, doubt.range_cells)


@LAW
@given(st.integers(0, 10_000))
def test_who_can_see_further_sees_no_less(seed):
    ground = visibility.scene(rough(seed, (18, 27)))
    near, far = visibility.beams(0.5, 0.1, 60), BEAMS
    for node in [(0, 0), (9, 13), (17, 26)]:
        seen_near = visibility.from_node(ground, near, 0.7, node).seen
        assert not (seen_near & ~visibility.from_node(ground, far, 0.7, node).seen).any()


@LAW
@given(st.integers(0, 10_000), st.floats(0.01, 2.0))
def test_lowering_a_cell_hides_no_other(seed, by_m):
    rng = np.random.default_rng(seed)
    z = rough(seed, (16, 16), 0.0)
    dug = z.copy()
    j, i = rng.integers(0, 16, 2)
    dug[j, i] -= np.float32(by_m)
    for node in [(0, 0), (8, 7), (15, 9)]:
        before, after = (visibility.from_node(visibility.scene(g), BEAMS, 0.7, node).seen for g in (z, dug))
        if node != (j, i):
            before[j, i] = False
            assert not (before & ~after).any()


def test_nodes_not_asked_are_nan_and_the_others_unchanged():
    ground, where = visibility.scene(rough(5, (40, 33))), np.random.default_rng(0).random((40, 33)) < 0.1
    every, some = (visibility.total(ground, BEAMS, 0.7, VisibilityRequest(w, new_half_rad=1.0)) for w in (None, where))
    for name in ("index", "seen_cells", "range_cells", "new_cells", "heading_rad", "gain"):
        got, all_ = getattr(some, name), getattr(every, name)
        assert np.isnan(got[~where]).all(), name
        np.testing.assert_array_equal(got[where], all_[where], err_msg=name)


def test_what_is_not_asked_is_nan():
    found = visibility.total(visibility.scene(np.zeros((3, 4), np.float32)), BEAMS, 0.7)
    assert np.isnan(found.new_cells).all() and np.isnan(found.heading_rad).all() and np.isnan(found.gain).all()


def test_a_map_where_nothing_is_known_is_predicted_flat():
    z = np.full((30, 30), np.nan, np.float32)
    assert not visibility.predicted(z).any()
    assert (visibility.total(visibility.scene(z), BEAMS, 0.7).index == 1.0).all()
    assert visibility.total(visibility.scene(z, optimistic=False), BEAMS, 0.7).index[15, 15] < 0.1


@pytest.mark.parametrize("range_m", [0.05, 0.0, -1.0, math.nan, math.inf])
def test_a_range_below_a_cell_is_refused_by_name(range_m):
    with pytest.raises(ValueError, match="range_m: expected at least one cell"):
        visibility.beams(range_m, 0.1)


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        (VisibilityRequest(where=np.zeros((3, 3), bool)), r"where: expected bool \(4, 5\), given bool \(3, 3\)"),
        (VisibilityRequest(where=np.zeros((4, 5))), "where: expected bool"),
        (VisibilityRequest(new_half_rad=1.0, targets=np.zeros((5, 4), bool)), r"target: expected bool \(4, 5\)"),
        (VisibilityRequest(new_half_rad=math.nan), "half width of a sector: expected >= 0 rad"),
        (
            VisibilityRequest(sector=Sector(np.zeros((2, 2)), 1.0)),
            r"heading_rad: expected one or \(4, 5\), given \(2, 2\)",
        ),
        (VisibilityRequest(sector=Sector(math.nan, 1.0)), "heading_rad: expected finite angles"),
        (VisibilityRequest(sector=Sector(0.0, -1.0)), "half width of a sector"),
    ],
)
def test_a_question_that_does_not_fit_the_map_is_refused_by_name(asked, words):
    with pytest.raises(ValueError, match=words):
        visibility.total(visibility.scene(np.zeros((4, 5), np.float32)), BEAMS, 0.7, asked)


@pytest.mark.parametrize("value", [np.inf, -np.inf, 3e38])
def test_heights_that_are_not_of_this_world_are_refused(value):
    z = np.zeros((4, 5), np.float32)
    z[2, 2] = value
    with pytest.raises(ValueError, match="height_m: expected finite heights within 1e"):
        visibility.total(visibility.scene(z), BEAMS, 0.7)


def test_an_empty_map_and_a_node_off_the_map_are_refused():
    with pytest.raises(ValueError, match="height_m: expected 1 to"):
        visibility.total(visibility.scene(np.zeros((0, 5), np.float32)), BEAMS, 0.7)
    with pytest.raises(ValueError, match="node: expected one on the map"):
        visibility.from_node(visibility.scene(np.zeros((4, 5), np.float32)), BEAMS, 0.7, (4, 0))
