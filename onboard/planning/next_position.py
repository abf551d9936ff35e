"""The next sensing position (Eq. 27, 28, corrected): every candidate is scored, the optimum is exact.

    E(n) = W_occ * Vis(n) - W_L * (L(n) - L_min) / (L_max - L_min)

over every n-th cell of chi_free. L is the cost-to-go given (the optimistic one of the pose field; Eq. 27's straight
line is an option of the caller). The term of L is 0 where its span is below 1e-6 m. Ties: lowest (L, j, i).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.config import Mission
from onboard.planning import visibility
from onboard.records import F32, F64, Bool, Grid

I64 = NDArray[np.int64]
APART_M = 1.0
STOP_APART_M = 0.5
ALTERNATIVES = 5


@dataclass(frozen=True, slots=True)
class Question:
    """What is asked. z_mean: (rows, columns) NaN = unknown. free: bool, chi_free. cost_m: cost-to-go, inf = none.

    goal_m: where to look when no place shows anything new. stops_m: places of earlier stops; none is taken again.
    """

    grid: Grid
    z_mean: F32
    free: Bool
    cost_m: F32
    goal_m: tuple[float, float]
    stops_m: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, slots=True)
class Eyes:
    """The scanner for which the visibility is computed. sector_rad: half the usable sector."""

    height_m: float = 0.7
    range_m: float = 8.0
    sector_rad: float = math.radians(65)
    beams: int = 360
    optimistic: bool = True


@dataclass(frozen=True, slots=True)
class Choice:
    """One place with its terms: score E, Vis, L, and the newly seen cells in the sector of its heading."""

    cell: tuple[int, int]
    x_m: float
    y_m: float
    heading_rad: float
    score: float
    visibility: float
    cost_m: float
    new_cells: float


@dataclass(frozen=True, slots=True)
class NextPosition:
    """best: None where no candidate is left. alternatives: up to five next best, at least 1 m from each other and the
    best.

    score_map: (rows, columns) float32, NaN where no candidate. rejections: candidates refused, by rule.
    """

    best: Choice | None
    alternatives: tuple[Choice, ...]
    score_map: F32
    rejections: Mapping[str, int]


def choose(question: Question, eyes: Eyes, mission: Mission) -> NextPosition:
    """Score every candidate and take the best."""
    cells, rejections = _candidates(question, mission.candidate_stride)
    score_map = np.full(question.z_mean.shape, np.nan, dtype=np.float32)
    if len(cells) == 0:
        return NextPosition(None, (), score_map, rejections)
    table = visibility.beams(eyes.range_m, question.grid.cell_m, eyes.beams)
    ground = visibility.scene(question.z_mean, optimistic=eyes.optimistic)
    where = np.zeros(question.z_mean.shape, dtype=bool)
    where[cells[:, 0], cells[:, 1]] = True
    seen = visibility.total(ground, table, eyes.height_m, visibility.Asked(where, new_half_rad=eyes.sector_rad))
    index, new, heading = (layer[where] for layer in (seen.index, seen.new_cells, seen.heading_rad))
    cost = question.cost_m[cells[:, 0], cells[:, 1]].astype(np.float64)
    score = evaluate(index, cost, mission)
    score_map[cells[:, 0], cells[:, 1]] = score
    order = np.lexsort((cells[:, 1], cells[:, 0], cost, -score))
    choices = []
    for n in _apart(order, cells.astype(np.float64) * question.grid.cell_m):
        j, i = int(cells[n, 0]), int(cells[n, 1])
        x, y = question.grid.centre(j, i)
        towards = float(heading[n]) if new[n] > 0.0 else math.atan2(question.goal_m[1] - y, question.goal_m[0] - x)
        choices.append(
            Choice((j, i), x, y, towards, float(score[n]), float(index[n]), float(cost[n]), float(new[n]))
        )
    return NextPosition(choices[0], tuple(choices[1:]), score_map, rejections)


def evaluate(vis: F64, cost_m: F64, mission: Mission) -> F64:
    """Eq. 28 corrected: E of each candidate from its Vis and its cost-to-go (finite)."""
    span = float(cost_m.max() - cost_m.min())
    far = (cost_m - cost_m.min()) / span if span >= 1e-6 else np.zeros_like(cost_m)
    return np.asarray(mission.weight_occlusion * vis - mission.weight_distance * far)


def _candidates(question: Question, stride: int) -> tuple[I64, dict[str, int]]:
    """(n, 2) cells in rising (j, i), and how many were refused by which rule; a grid without any tries every cell."""
    lattice = np.zeros(question.free.shape, dtype=bool)
    lattice[::stride, ::stride] = True
    if not (lattice & question.free).any():
        lattice[:] = True
    cells = np.argwhere(lattice & question.free)
    finite = np.isfinite(question.cost_m[cells[:, 0], cells[:, 1]])
    x = question.grid.x0_m + cells[:, 1] * question.grid.cell_m
    y = question.grid.y0_m + cells[:, 0] * question.grid.cell_m
    fresh = np.ones(len(cells), dtype=bool)
    for stop_x, stop_y in question.stops_m:
        fresh &= np.hypot(x - stop_x, y - stop_y) >= STOP_APART_M
    rejections = {
        "not free": int((lattice & ~question.free).sum()),
        "no way to the goal": int((~finite).sum()),
        "near an earlier stop": int((finite & ~fresh).sum()),
    }
    return cells[finite & fresh], rejections


def _apart(order: I64, places_m: F64) -> list[int]:
    """The first of `order` and up to five next that are APART_M from all taken before."""
    taken: list[int] = []
    for n in order:
        if all(math.dist(places_m[n], places_m[m]) >= APART_M - 1e-9 for m in taken):
            taken.append(int(n))
            if len(taken) == 1 + ALTERNATIVES:
                break
    return taken
