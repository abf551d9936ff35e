"""Row of the next sensing position: nsp-cycle."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import maximum_filter, minimum_filter

from onboard.planning.sensing.gain import Eyes, Sight
from onboard.planning.sensing.hill_climb import Climb, climb, draw_seeds
from onboard.planning.sensing.next_position import Criterion, Question, choose, regret, straight_line_m
from onboard.records import Grid
from tests.bench.goals import Measured, seconds
from tests.bench.visibility import CELL_M, RANGE_M, SIDE, workload

CLIMBS = 10
GRID = Grid(-9.95, -9.95, CELL_M, SIDE, SIDE)
GOAL_M = (9.0, 2.0)


def ground() -> tuple[np.ndarray, np.ndarray]:
    """Return heights of the visibility rows, and the free cells: less than 20 cm of height within 30 cm."""
    z = workload()[0].height_m
    return z, maximum_filter(z, 7) - minimum_filter(z, 7) < 0.2


def nsp_cycle(repeats: int) -> Measured:
    """Measure every free node with the sector facing the goal: score map, best, alternatives.

    The reference is a climb that looks from one node at a time, and from none twice; its time is the mean over draws of
    the start nodes.
    """
    z, free = ground()
    asked = Question(GRID, z, free, straight_line_m(GRID, z, GOAL_M), GOAL_M)
    eyes, criterion = Eyes(range_m=RANGE_M), Criterion()
    exact = choose(asked, eyes, criterion)
    assert exact.best is not None
    term = exact.score_map - Sight(GRID, z, GOAL_M, eyes, criterion.gain).gains(free)[0]  # known before any look

    def algorithm_2(number: int) -> Climb:
        sight = Sight(GRID, z, GOAL_M, eyes, criterion.gain)

        def score(cells: np.ndarray) -> np.ndarray:
            gains = np.array([sight.gain_from((j, i)) for j, i in cells.tolist()])
            return np.asarray(gains + term[cells[:, 0], cells[:, 1]])

        return climb(score, free, draw_seeds(free, np.random.default_rng(number)))

    def climbs() -> list[Climb]:
        return [algorithm_2(number) for number in range(CLIMBS)]

    tops = [top.score for top in climbs()]
    ours_s, theirs_s = seconds(lambda: choose(asked, eyes, criterion), repeats), seconds(climbs, repeats) / CLIMBS
    lost = [found for n in range(CLIMBS) if (found := regret(exact, np.random.default_rng(n)))]
    note = (
        f"{exact.scored} nodes against {np.mean([one.evaluations for one in lost]):.0f}; regret 0 against "
        f"{np.median([one.ratio for one in lost]):.0%} (median of {CLIMBS})"
    )
    equal = np.allclose(tops, [one.score for one in lost], rtol=0, atol=1e-12) and exact.best.score >= max(tops)
    return Measured(ours_s / theirs_s, ours_s, theirs_s, "one 5-seed climb, node by node", note, bool(equal))


ROWS = {"nsp-cycle": nsp_cycle}
