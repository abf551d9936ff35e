"""Algorithm 2 with its three faults fixed: steepest ascent over the eight neighbours from each of several seeds.

    printed                                      here
    compares with the last neighbour listed      with the node it stands on
    `return` leaves the search at seed one       every seed is climbed, the highest top is the result
    may step to a neighbour that is worse        steps only where it is strictly better, so every climb ends

It scores each node that it visits once, and finds a top near a seed. `next_position` scores all nodes and computes the
loss of this search (the regret).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.records import F64, Bool

Cell = tuple[int, int]
Score = Callable[[NDArray[np.int64]], F64]  # (n, 2) cells (j, i) -> (n,) scores, higher is better

SEEDS = 5  # as in the chapter's Fig. 9


@dataclass(frozen=True, slots=True)
class Climb:
    """Result of the search.

    cell, score: the highest top; of equal ones the lowest (j, i).
    tops: the end of each seed's climb.
    evaluated: every node scored, with its score.
    """

    cell: Cell
    score: float
    tops: tuple[Cell, ...]
    evaluated: dict[Cell, float]


def draw_seeds(candidates: Bool, generator: np.random.Generator, count: int = SEEDS) -> tuple[Cell, ...]:
    """`count` nodes drawn from the candidates (rows, columns) with equal chance, repeats allowed; () without any."""
    cells = np.argwhere(candidates)
    if len(cells) == 0:
        return ()
    return tuple((int(j), int(i)) for j, i in cells[generator.integers(len(cells), size=count)])


def climb(score: Score, candidates: Bool, seeds: tuple[Cell, ...]) -> Climb:
    """The highest of the tops above the seeds.

    candidates: (rows, columns), the allowed nodes; no other node is scored.

    Raises ValueError without seeds and for a seed that is no candidate.
    """
    rows, columns = candidates.shape
    bad = [(j, i) for j, i in seeds if not (0 <= j < rows and 0 <= i < columns and candidates[j, i])]
    if bad or not seeds:
        raise ValueError(f"seeds: expected cells of candidates, given {bad or 'none'}")
    evaluated: dict[Cell, float] = {}
    tops = tuple(_top(score, candidates, seed, evaluated) for seed in seeds)
    best = min(tops, key=lambda cell: (-evaluated[cell], cell))
    return Climb(best, evaluated[best], tops, evaluated)


def _top(score: Score, candidates: Bool, seed: Cell, evaluated: dict[Cell, float]) -> Cell:
    """End of the climb from a seed; new scores go into `evaluated`."""
    _evaluate(score, [seed], evaluated)
    current = seed
    while True:
        beside = _neighbours(candidates, current)
        _evaluate(score, beside, evaluated)
        following = min(beside, key=lambda cell: (-evaluated[cell], cell), default=current)
        if not evaluated[following] > evaluated[current]:
            return current
        current = following


def _evaluate(score: Score, cells: list[Cell], evaluated: dict[Cell, float]) -> None:
    fresh = [cell for cell in cells if cell not in evaluated]
    if fresh:
        evaluated.update(zip(fresh, score(np.array(fresh, dtype=np.int64)).tolist()))


def _neighbours(candidates: Bool, cell: Cell) -> list[Cell]:
    """The candidates among the eight cells around one."""
    j0, i0 = max(cell[0] - 1, 0), max(cell[1] - 1, 0)
    around = candidates[j0 : cell[0] + 2, i0 : cell[1] + 2]
    return [(j0 + j, i0 + i) for j, i in np.argwhere(around).tolist() if (j0 + j, i0 + i) != cell]
