"""Eq. 27, 28 and Algorithm 2 as printed; the flight version is `onboard.planning.sensing.next_position`.

Line numbers in comments are the chapter's. E depends on the node alone, so the climb reads it from a map.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.records import F64, I32, Bool

LARGE = 1e6  # "arbitrary high value"
NEIGHBOURS = ((-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1))  # (dj, di); no order is printed


def eq_27(nodes_m: F64, goal_m: F64) -> F64:
    """L of each node: straight-line distance to the goal, (...,).

    nodes_m: (..., 3).
    goal_m: (3,).
    """
    return np.asarray(np.sqrt(((goal_m - nodes_m) ** 2).sum(axis=-1)))


def eq_28(vis: F64, length: F64, obs: F64, weights: tuple[float, float]) -> F64:
    """E of each node; the highest is taken.

    weights: W_occ, W_L.
    length: of Eq. 27, in any unit.
    """
    return weights[0] * vis + weights[1] * length + obs


def obs_of_the_text(in_obstacle: Bool) -> F64:
    """Penalty of Eq. 28 as in the text: "takes large values if the inspected node is contained in chi_obs"."""
    return np.where(in_obstacle, LARGE, 0.0)


def obs_of_algorithm_2(in_obstacle: Bool) -> F64:
    """Penalty of Eq. 28 as in lines 10 to 14, which is the opposite: low within chi_obs, high elsewhere."""
    return np.where(in_obstacle, 0.0, LARGE)


@dataclass(frozen=True, slots=True)
class Mended:
    """Corrected faults; none: as printed.

    compares_with_current: line 22 compares the best neighbour with the current node, not with the neighbour visited
        last.
    tries_every_seed: line 23 ends the climb, not the algorithm.
    keeps_the_better: the result of a climb is its last node, not the neighbour that was no better.
    """

    compares_with_current: bool = False
    tries_every_seed: bool = False
    keeps_the_better: bool = False


@dataclass(frozen=True, slots=True)
class Search:
    """Result of a search.

    node: (j, i) found, None if a climb did not end.
    climbs: visited nodes of each climb in order, (k, 2) int32 each.
    endless: a climb was ended at the step limit.
    """

    node: tuple[int, int] | None
    climbs: tuple[I32, ...]
    endless: bool


AS_PRINTED = Mended()


def algorithm_2(
    score: F64, free: Bool, starts: NDArray[np.integer], mended: Mended = AS_PRINTED, step_limit: int = 1000
) -> Search:
    """Hill climbing over E.

    score: (rows, columns) E of every node, obstacles included.
    free: (rows, columns); the algorithm uses it only to check the starts.
    starts: (k, 2) the random nodes of line 2, each in `free`.
    step_limit: the printed `while TRUE` has none.

    Raises ValueError for a start outside chi_free.
    """
    best, best_eval, climbs = None, -np.inf, []
    for start in starts:  # 1, 2
        if not free[start[0], start[1]]:
            raise ValueError(f"starts: expected nodes of chi_free, given {tuple(map(int, start))}")
        climb, found = _climb(score, (int(start[0]), int(start[1])), mended, step_limit)
        climbs.append(np.array(climb, np.int32))
        if found is None:
            return Search(None, tuple(climbs), endless=True)
        if not mended.tries_every_seed:
            return Search(found, tuple(climbs), endless=False)  # 23
        if score[found] > best_eval:  # 27
            best, best_eval = found, float(score[found])  # 28, 29
    return Search(best, tuple(climbs), endless=False)  # 32


def _climb(
    score: F64, start: tuple[int, int], mended: Mended, step_limit: int
) -> tuple[list[tuple[int, int]], tuple[int, int] | None]:
    """The visited nodes from one start, and the node of line 23; None after too many steps."""
    current, stood = start, [start]  # 3
    while len(stood) <= step_limit:  # 4
        following, following_eval, last_eval = current, -np.inf, -np.inf  # 6
        for dj, di in NEIGHBOURS:  # 7
            node = (current[0] + dj, current[1] + di)
            if not (0 <= node[0] < score.shape[0] and 0 <= node[1] < score.shape[1]):
                continue
            last_eval = float(score[node])  # 15
            if last_eval > following_eval:  # 16
                following, following_eval = node, last_eval  # 17, 18
        if following_eval <= (score[current] if mended.compares_with_current else last_eval):  # 22
            return stood, current if mended.keeps_the_better else following  # 23
        current = following  # 25
        stood.append(current)
    return stood, None
