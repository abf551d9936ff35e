"""Eq. 27 and 28, corrected: the choice is the optimum of an exhaustive search, with its reasons."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onboard.planning.sensing import next_position as nsp
from onboard.planning.sensing import visibility
from onboard.planning.sensing.gain import GAINS, Eyes, Sight
from onboard.planning.sensing.next_position import Criterion, Question
from onboard.records import Grid
from tests.oracles import next_position as plain

SIDE = 16
GRID = Grid(0.05, 0.05, 0.1, SIDE, SIDE)
EYES = Eyes(range_m=0.6, beams=36, sector_rad=math.radians(65))
HALF = 6  # beams of 10 degrees within 65 of the middle one
GOAL = (1.37, 0.71)


def question(seed=0, grid=GRID):
    """Rough ground, unknown at the right; some cells not free, some without a way, an earlier stop."""
    rng = np.random.default_rng(seed)
    shape = (grid.rows, grid.columns)
    z = rng.normal(0, 0.15, shape).astype(np.float32)
    z[:, 3 * grid.columns // 4 :] = np.nan
    free = (rng.random(shape) < 0.6) & ~np.isnan(z)
    cost = rng.uniform(0.5, 3.0, shape).astype(np.float32)
    cost[:3] = np.inf
    return Question(grid, z, free, cost, GOAL, ((0.3, 0.6),))


def flat(side, cost, **changes):
    """Free flat ground; everything is seen from everywhere."""
    grid = Grid(0.0, 0.0, 0.1, side, side)
    cost = np.broadcast_to(np.asarray(cost, np.float32), (side, side)).copy()
    return replace(
        Question(grid, np.zeros((side, side), np.float32), np.ones((side, side), bool), cost, (0.0, 9.0)), **changes
    )


def by_hand(asked, criterion):
    """Every E by the plain twin, {cell: E}, and headings of the gain, {cell: beam}."""
    table = visibility.beams(EYES.range_m, 0.1, EYES.beams)
    fill, gain, beam = visibility.predicted(asked.z_mean), {}, {}
    cells = [
        (j, i)
        for j in range(SIDE)
        for i in range(SIDE)
        if asked.free[j, i]
        and np.isfinite(asked.cost_m[j, i])
        and all(math.dist(GRID.centre(j, i), stop) >= 0.5 for stop in asked.stops_m)
    ]
    for cell in cells:
        x, y = GRID.centre(*cell)
        if criterion.gain == "newly-seen":
            gain[cell], beam[cell] = plain.newly_seen(asked.z_mean, fill, table, cell, EYES.height_m, HALF)
        else:
            beam[cell] = round(math.degrees(math.atan2(GOAL[1] - y, GOAL[0] - x)) / 10)
            gain[cell] = plain.facing_goal(asked.z_mean, fill, table, cell, EYES.height_m, beam[cell], HALF)
    weights = (criterion.weight_occlusion, criterion.weight_distance)
    return plain.scores(gain, asked.cost_m, cells, weights), beam


@pytest.mark.parametrize("gain", GAINS)
@pytest.mark.parametrize("seed", range(3))
def test_choice_and_every_score_are_those_of_the_plain_loop(seed, gain):
    asked, criterion = question(seed), Criterion(gain, 1.0, 0.3)
    found = nsp.choose(asked, EYES, criterion)
    wanted, beam = by_hand(asked, criterion)
    assert {tuple(c) for c in np.argwhere(np.isfinite(found.score_map)).tolist()} == set(wanted)
    for cell, score in wanted.items():
        assert found.score_map[cell] == pytest.approx(score, abs=1e-12)
    best = min(wanted, key=lambda c: (-wanted[c], asked.cost_m[c], c))
    assert found.best.cell == best
    turned = math.degrees(found.best.heading_rad) - 10 * beam[best]
    assert abs(math.remainder(turned, 360)) < (1e-9 if gain == "newly-seen" else 5.0 + 1e-9)


def test_scores_of_nine_cells_worked_by_hand():
    """A pillar on the middle cell hides what lies straight behind it; beams of 45 degrees, two cells long, all round.

    6 7 8   cost-to-go, m; the span is 8. From (1, 0) the cells in range are its eight neighbours on the map and
    3 4 5   (1, 2): five of six are seen, for (1, 2) is hidden. From the corner (0, 0): the row, the column and the
    0 1 2   diagonal, of which (2, 2) is not reached: round(2 cos 45) = 1. All five are seen.
    """
    z = np.zeros((3, 3), np.float32)
    z[1, 1] = 5.0
    free = z == 0
    asked = flat(3, np.arange(9).reshape(3, 3), z_mean=z, free=free)
    found = nsp.choose(asked, Eyes(range_m=0.2, beams=8, sector_rad=math.pi), Criterion("visibility", 2.0, 0.8))
    assert found.score_map[0, 0] == pytest.approx(2.0)
    assert found.score_map[1, 0] == pytest.approx(2.0 * 5 / 6 - 0.8 * 3 / 8)
    assert found.score_map[1, 2] == pytest.approx(2.0 * 5 / 6 - 0.8 * 5 / 8)
    assert found.score_map[2, 2] == pytest.approx(2.0 - 0.8)
    assert np.isnan(found.score_map[1, 1])
    assert found.best.cell == (0, 0)


def test_terms_are_named_and_add_up_to_the_score():
    for gain in GAINS:
        found = nsp.choose(question(), EYES, Criterion(gain, 0.9, 0.4))
        costs = question().cost_m[np.isfinite(found.score_map)].astype(float)
        for place in (found.best, *found.alternatives):
            assert place.score == place.gain_term + place.distance_term == found.score_map[place.cell]
            assert 0.0 <= place.gain_term <= 0.9
            far = (place.cost_m - costs.min()) / np.ptp(costs)
            assert place.distance_term == pytest.approx(-0.4 * far)
            assert (place.x_m, place.y_m) == GRID.centre(*place.cell)
    assert found.reason.startswith(f"E = {found.best.gain_term:.3f} - ")


def test_ties_go_to_the_lowest_cost_then_row_then_column():
    level = Criterion("visibility", 1.0, 0.0)
    cost = np.full((3, 3), 2.0)
    cost[2, 1] = cost[1, 2] = 1.0
    around = Eyes(range_m=0.2, beams=8, sector_rad=math.pi)
    assert nsp.choose(flat(3, cost), around, level).best.cell == (1, 2)
    assert nsp.choose(flat(3, 2.0), around, level).best.cell == (0, 0)


@pytest.mark.parametrize(("step", "term"), [(4e-7, 0.0), (4e-6, -0.5)])
def test_a_span_below_a_micrometre_makes_no_distance_term(step, term):
    cost = np.full((3, 3), 1e-5)
    cost[0, 0] += step
    found = nsp.choose(flat(3, cost), EYES, Criterion())
    assert found.score_map[0, 0] - found.score_map[2, 2] == pytest.approx(term)


def test_alternatives_are_a_metre_apart_and_in_falling_order():
    found = nsp.choose(question(grid=replace(GRID, rows=60, columns=60)), EYES, Criterion())
    places = [found.best, *found.alternatives]
    assert len(places) == 6
    for n, a in enumerate(places):
        assert all(a.score <= b.score for b in places[:n])
        assert all(math.dist((a.x_m, a.y_m), (b.x_m, b.y_m)) >= 1.0 - 1e-9 for b in places[:n])
    better = np.argwhere(found.score_map > places[1].score).tolist()
    assert all(math.dist(GRID.centre(*cell), (found.best.x_m, found.best.y_m)) < 1.0 for cell in better)


def test_each_cell_that_is_no_candidate_is_counted_under_the_first_rule_that_refused_it():
    asked = question()
    found = nsp.choose(asked, EYES, Criterion())
    assert found.scored + sum(found.rejections.values()) == SIDE * SIDE
    assert found.rejections["not free"] == (~asked.free).sum()
    assert found.rejections["no way to the goal"] == (asked.free[:3]).sum()
    assert found.rejections["near an earlier stop"] > 0
    assert f"{found.scored} of 256 cells scored" in found.reason


NAN, INF = np.full((SIDE, SIDE), np.nan, np.float32), np.full((SIDE, SIDE), np.inf, np.float32)


@pytest.mark.parametrize("search", ["choose", "choose_by_climb"])
@pytest.mark.parametrize(
    ("changes", "rule", "count"),
    [
        ({"free": np.zeros((SIDE, SIDE), bool)}, "not free", SIDE * SIDE),
        ({"free": np.ones((SIDE, SIDE), bool), "cost_m": INF}, "no way to the goal", SIDE * SIDE),
        ({"free": np.ones((SIDE, SIDE), bool), "cost_m": NAN}, "no way to the goal", SIDE * SIDE),
    ],
)
def test_no_candidate_is_reported_with_the_rule_and_is_no_choice(search, changes, rule, count):
    asked = replace(question(), **changes)
    generator = () if search == "choose" else (np.random.default_rng(0),)
    found = getattr(nsp, search)(asked, EYES, Criterion(), *generator)
    assert found.best is None
    assert found.alternatives == ()
    assert np.isnan(found.score_map).all()
    assert found.rejections[rule] == count
    assert found.reason == f"no candidate: 0 of 256 cells scored ({count} {rule})"
    assert nsp.regret(found, np.random.default_rng(0)) is None


@pytest.mark.parametrize("gain", GAINS)
def test_ground_of_which_nothing_is_known_is_scored_by_the_way_alone(gain):
    cost = np.tile(np.arange(SIDE, dtype=np.float32), (SIDE, 1))
    asked = replace(question(), z_mean=NAN, free=np.ones((SIDE, SIDE), bool), cost_m=cost, stops_m=())
    found = nsp.choose(asked, EYES, Criterion(gain))
    assert found.best.cell == (0, 0)
    assert found.best.gain_term == 1.0


def test_a_goal_far_beyond_the_map_is_looked_at():
    found = nsp.choose(flat(9, 1.0, goal_m=(0.4, 500.0)), EYES, Criterion())
    assert found.best.heading_rad == pytest.approx(math.pi / 2, abs=0.01)
    line = nsp.straight_line_m(Grid(0.0, 0.0, 0.1, 9, 9), np.zeros((9, 9), np.float32), (0.4, 500.0))
    assert line[0, 4] == pytest.approx(500.0)


def test_heading_of_newly_seen_looks_at_the_unknown_else_at_the_goal():
    z = np.zeros((41, 41), np.float32)
    only = np.zeros((41, 41), bool)
    only[20, 20] = True
    explore = Criterion("newly-seen")
    found = nsp.choose(flat(41, 1.0, z_mean=z, free=only, goal_m=(2.0, 40.0)), EYES, explore)
    assert found.best.heading_rad == pytest.approx(math.pi / 2)
    assert found.best.new_cells == found.best.gain_term == 0.0
    z[:, :17] = np.nan
    found = nsp.choose(flat(41, 1.0, z_mean=z, free=only, goal_m=(2.0, 40.0)), EYES, explore)
    assert abs(math.remainder(found.best.heading_rad - math.pi, math.tau)) < math.radians(65)
    assert found.best.new_cells > 10


def test_ground_beyond_the_map_is_new():
    found = nsp.choose(flat(9, 1.0), EYES, Criterion("newly-seen"))
    assert found.score_map[4, 0] > found.score_map[4, 4] > 0.0
    assert found.best.cell[0] in (0, 8)
    assert found.best.cell[1] in (0, 8)


@pytest.mark.parametrize("gain", GAINS)
def test_one_cell_has_the_gain_that_it_has_among_all(gain):
    asked = question(5)
    sight = Sight(GRID, asked.z_mean, GOAL, EYES, gain)
    whole = sight.gains(np.ones((SIDE, SIDE), bool))[0]
    for cell in [(0, 0), (7, 9), (15, 3), (8, 15)]:
        assert sight.gain_from(cell) == whole[cell]


def test_straight_line_is_the_distance_in_space_where_both_heights_are_known():
    z = np.zeros((5, 9), np.float32)
    z[0, 4], z[4, 0] = 1.2, np.nan
    line = nsp.straight_line_m(Grid(0.0, 0.0, 0.1, 5, 9), z, (0.0, 0.0))
    assert line[0, 4] == pytest.approx(math.hypot(0.4, 1.2))
    assert line[4, 0] == pytest.approx(0.4)
    assert line[3, 4] == pytest.approx(0.5)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000))
def test_regret_of_the_climb_is_never_negative_and_zero_where_it_finds_the_optimum(seed):
    found = nsp.choose(question(seed % 7), EYES, Criterion())
    lost = nsp.regret(found, np.random.default_rng(seed))
    assert 0.0 <= lost.ratio <= 1.0
    assert lost.score == found.score_map[lost.cell]
    assert lost.evaluations <= found.scored
    assert (lost.ratio == 0.0) == (lost.score == found.best.score)
    worst = np.nanmin(found.score_map)
    assert lost.ratio == pytest.approx((found.best.score - lost.score) / (found.best.score - worst))


def test_one_hill_leaves_no_regret_and_several_leave_some():
    hill = nsp.choose(flat(20, np.hypot(*np.mgrid[-9:11, -4:16])), EYES, Criterion())
    assert nsp.regret(hill, np.random.default_rng(1)).ratio == 0.0
    lost = [nsp.regret(nsp.choose(question(n), EYES, Criterion()), np.random.default_rng(n)).ratio for n in range(7)]
    assert max(lost) > 0.05


def test_climb_scores_what_it_looks_at_and_finds_what_the_regret_says():
    asked = question(3)
    whole = nsp.choose(asked, EYES, Criterion())
    lost = nsp.regret(whole, np.random.default_rng(4))
    found = nsp.choose_by_climb(asked, EYES, Criterion(), np.random.default_rng(4))
    looked_at = np.isfinite(found.score_map)
    assert np.array_equal(found.score_map[looked_at], whole.score_map[looked_at])
    assert (found.scored, found.best.score) == (lost.evaluations, lost.score)
    assert found.rejections == whole.rejections
    with pytest.raises(ValueError, match="every candidate scored"):
        nsp.regret(found, np.random.default_rng(4))


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"z_mean": np.zeros((3, 3), np.float32)}, r"z_mean: expected float32 \(16, 16\), given float32 \(3, 3\)"),
        ({"z_mean": np.zeros((SIDE, SIDE))}, "z_mean: expected float32"),
        ({"free": np.ones((SIDE, SIDE), np.uint8)}, "free: expected bool"),
        ({"cost_m": np.zeros((SIDE, SIDE), np.float32).T[:, ::-1]}, "cost_m: expected contiguous rows"),
        ({"z_mean": INF}, "z_mean: expected finite heights"),
        ({"goal_m": (math.nan, 0.0)}, "goal_m: expected finite"),
    ],
)
def test_a_bad_question_is_refused_by_name(changes, told):
    with pytest.raises(ValueError, match=told):
        replace(question(), **changes)


@pytest.mark.parametrize(
    ("values", "told"),
    [
        (("vis",), "gain: expected one of visibility, newly-seen, given 'vis'"),
        (("visibility", -1.0), "weights: expected finite"),
        (("visibility", 1.0, math.nan), "weights: expected finite"),
    ],
)
def test_a_bad_criterion_is_refused_by_name(values, told):
    with pytest.raises(ValueError, match=told):
        Criterion(*values)
