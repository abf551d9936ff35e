"""Next sensing position (Eq. 27, 28, corrected): every candidate is scored, the optimum is exact.

    E(n) = W_occ * Gain(n) - W_L * (L(n) - L_min) / (L_max - L_min)

over every cell of chi_free with a finite L. Both terms run from 0 to 1, so the weights compare like quantities.

    Gain  "visibility": Vis, the cells seen of those in range (Eq. 6)
          "newly-seen": unknown cells seen in the sector of the best heading, of all cells of a sector
    L     the given cost-to-go (the pose field's), or `straight_line_m` of it (Eq. 27 as printed)

The term of L is 0 where its span is below 1e-6 m. Ties: the lowest (L, j, i). `choose` scores every candidate,
`choose_by_climb` is Algorithm 2 with its faults fixed, and `regret` computes the loss of that search.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.kernel_calls.checks import check_array
from onboard.native import each
from onboard.planning.sensing.gain import GAINS, Eyes, Sight, centres
from onboard.planning.sensing.hill_climb import climb, draw_seeds
from onboard.records import F32, F64, Bool, Grid

I64 = NDArray[np.int64]
APART_M = 1.0
STOP_APART_M = 0.5
ALTERNATIVES = 5
LEAST_SPAN_M = 1e-6


@dataclass(frozen=True, slots=True)
class Question:
    """Problem of the next sensing position on one grid, (rows, columns).

    grid: the grid.
    z_mean: float32 m, NaN = unknown.
    free: bool, chi_free.
    cost_m: float32, cost-to-go; not finite where there is no way.
    goal_m: direction to look in if no place shows anything new.
    stops_m: places of earlier stops; none is taken again.

    Raises ValueError for another shape or dtype, for infinite heights and for a goal that is not finite.
    """

    grid: Grid
    z_mean: F32
    free: Bool
    cost_m: F32
    goal_m: tuple[float, float]
    stops_m: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        shape = (self.grid.rows, self.grid.columns)
        check_array("z_mean", self.z_mean, shape, np.float32)
        check_array("free", self.free, shape, np.bool_)
        check_array("cost_m", self.cost_m, shape, np.float32)
        if np.isinf(self.z_mean).any():
            raise ValueError("z_mean: expected finite heights or NaN, given infinite ones")
        if not all(map(math.isfinite, self.goal_m)):
            raise ValueError(f"goal_m: expected finite metres, given {self.goal_m}")


@dataclass(frozen=True, slots=True)
class Criterion:
    """Score of a place.

    gain: one of GAINS.
    weight_occlusion, weight_distance: W_occ and W_L of Eq. 28, >= 0.

    Raises ValueError for other values.
    """

    gain: str = "visibility"
    weight_occlusion: float = 1.0
    weight_distance: float = 0.5

    def __post_init__(self) -> None:
        if self.gain not in GAINS:
            raise ValueError(f"gain: expected one of {', '.join(GAINS)}, given {self.gain!r}")
        if not (0 <= self.weight_occlusion < math.inf and 0 <= self.weight_distance < math.inf):
            raise ValueError(
                f"weights: expected finite numbers >= 0, given {self.weight_occlusion}, {self.weight_distance}"
            )


@dataclass(frozen=True, slots=True)
class Choice:
    """One place.

    cell: (j, i).
    x_m, y_m: its centre.
    heading_rad: heading to scan at.
    score: E = gain_term + distance_term.
    gain_term, distance_term: the two terms of Eq. 28 with their weights and signs.
    visibility, new_cells: Vis and the unknown cells seen, both in the sector of the heading; with the gain "newly-seen"
        beyond the map too.
    cost_m: L.
    """

    cell: tuple[int, int]
    x_m: float
    y_m: float
    heading_rad: float
    score: float
    gain_term: float
    distance_term: float
    visibility: float
    new_cells: float
    cost_m: float


@dataclass(frozen=True, slots=True)
class NextPosition:
    """Result of the search.

    best: the best place; None if no candidate is left.
    alternatives: up to five next best, at least 1 m from each other and from the best.
    score_map: E, (rows, columns) float64, NaN where not scored.
    rejections: number of cells that are no candidates, by the first rule that refused each.
    """

    best: Choice | None
    alternatives: tuple[Choice, ...]
    score_map: F64
    rejections: Mapping[str, int]

    @property
    def scored(self) -> int:
        """Number of scored candidates."""
        return int(np.isfinite(self.score_map).sum())

    @property
    def reason(self) -> str:
        """One line for people: the reason for this place, or for none."""
        refused = ", ".join(f"{count} {rule}" for rule, count in self.rejections.items() if count)
        cells = f"{self.scored} of {self.score_map.size} cells scored" + (f" ({refused})" if refused else "")
        if self.best is None:
            return f"no candidate: {cells}"
        terms = f"E = {self.best.gain_term:.3f} - {-self.best.distance_term:.3f} = {self.best.score:.3f}"
        return f"{terms}, best of {cells}"


@dataclass(frozen=True, slots=True)
class Regret:
    """Loss of one climb of Algorithm 2.

    ratio: (best E - its E) / (best E - worst E), 0 if all are equal.
    cell, score: its result.
    evaluations: number of distinct nodes it scored.
    """

    ratio: float
    cell: tuple[int, int]
    score: float
    evaluations: int


def choose(question: Question, eyes: Eyes, criterion: Criterion) -> NextPosition:
    """Score every candidate and take the best. Without candidates `best` is None and `rejections` give the reasons."""
    candidates, rejections = screen(question)
    term = _distance_term(question, candidates, criterion)
    return _ranked(question, _sight(question, eyes, criterion), criterion, term, rejections)


def choose_by_climb(
    question: Question, eyes: Eyes, criterion: Criterion, generator: np.random.Generator
) -> NextPosition:
    """Choose by Algorithm 2 with its faults fixed, from seeds of the generator; only the visited cells are scored."""
    candidates, rejections = screen(question)
    term, sight = _distance_term(question, candidates, criterion), _sight(question, eyes, criterion)

    def score(cells: I64) -> F64:
        gains = np.array([sight.gain_from((j, i)) for j, i in cells.tolist()])
        return np.asarray(criterion.weight_occlusion * gains + term[cells[:, 0], cells[:, 1]])

    looked_at = np.zeros_like(candidates)
    if candidates.any():
        found = climb(score, candidates, draw_seeds(candidates, generator))
        looked_at[tuple(np.array(list(found.evaluated)).T)] = True
    return _ranked(question, sight, criterion, np.where(looked_at, term, np.nan), rejections)


def regret(found: NextPosition, generator: np.random.Generator) -> Regret | None:
    """Loss of one climb of Algorithm 2 from seeds of the generator on the same scores; None without candidates.

    Raises ValueError for a result of `choose_by_climb`, because its map has unscored candidates.
    """
    if found.scored + sum(found.rejections.values()) != found.score_map.size:
        raise ValueError(f"found: expected every candidate scored (by `choose`), given {found.reason}")
    if found.best is None:
        return None
    e = found.score_map
    got = climb(lambda cells: e[cells[:, 0], cells[:, 1]], np.isfinite(e), draw_seeds(np.isfinite(e), generator))
    span = found.best.score - float(np.nanmin(e))
    lost = found.best.score - got.score
    return Regret(lost / span if span > 0.0 else 0.0, got.cell, got.score, len(got.evaluated))


def straight_line_m(grid: Grid, z_mean: F32, goal_m: tuple[float, float]) -> F32:
    """Eq. 27 as printed: the straight line from every cell to the goal, (rows, columns).

    Heights count where both ends are known; a goal beyond the map has none.
    """
    x, y = centres(grid)
    own = grid.cell(*goal_m)
    height = z_mean[own] if grid.contains(*own) else np.float32(np.nan)
    away = each.hypot(x - goal_m[0], y - goal_m[1])
    return np.asarray(each.hypot(away, np.nan_to_num(z_mean - height)), dtype=np.float32)


def screen(question: Question) -> tuple[Bool, dict[str, int]]:
    """The candidates (rows, columns), and the number of other cells by the first rule that refused each."""
    left, fresh = np.ones_like(question.free), np.ones_like(question.free)
    x, y = centres(question.grid)
    for stop_x, stop_y in question.stops_m:
        fresh &= each.hypot(x - stop_x, y - stop_y) >= STOP_APART_M
    rejections = {}
    way = np.isfinite(question.cost_m)
    rules = {"not free": question.free, "no way to the goal": way, "near an earlier stop": fresh}
    for rule, passes in rules.items():
        rejections[rule] = int((left & ~passes).sum())
        left &= passes
    return left, rejections


def _distance_term(question: Question, candidates: Bool, criterion: Criterion) -> F64:
    """-W_L * (L - L_min) / (L_max - L_min) of each candidate, NaN elsewhere."""
    cost = np.where(candidates, question.cost_m.astype(np.float64), np.nan)
    if not candidates.any():
        return cost
    span = np.nanmax(cost) - np.nanmin(cost)
    far = (cost - np.nanmin(cost)) / (span if span >= LEAST_SPAN_M else math.inf)
    return np.asarray(-criterion.weight_distance * far)


def _sight(question: Question, eyes: Eyes, criterion: Criterion) -> Sight:
    return Sight(question.grid, question.z_mean, question.goal_m, eyes, criterion.gain)


def _ranked(
    question: Question, sight: Sight, criterion: Criterion, term: F64, rejections: Mapping[str, int]
) -> NextPosition:
    """The result over the cells whose distance `term` is not NaN."""
    where = np.isfinite(term)
    if not where.any():
        return NextPosition(None, (), term, rejections)
    gain, heading = sight.gains(where)
    gain_term = criterion.weight_occlusion * gain
    score_map = gain_term + term
    cells = _apart(score_map, question)
    chosen = np.zeros_like(where)
    chosen[tuple(np.array(cells).T)] = True
    layers = (heading, score_map, gain_term, term, *sight.views(chosen, heading), question.cost_m)
    choices = [Choice(c, *question.grid.centre(*c), *(float(layer[c]) for layer in layers)) for c in cells]
    return NextPosition(choices[0], tuple(choices[1:]), score_map, rejections)


def _apart(score_map: F64, question: Question) -> list[tuple[int, int]]:
    """The best cell and up to five next best, each APART_M from all before it; ties: the lowest (L, j, i)."""
    left, (x, y) = np.where(np.isnan(score_map), -np.inf, score_map), centres(question.grid)
    reach = int(APART_M / question.grid.cell_m) + 1
    taken: list[tuple[int, int]] = []
    while len(taken) <= ALTERNATIVES and (highest := left.max()) > -np.inf:
        ties = np.argwhere(left == highest)
        j, i = (int(n) for n in ties[np.argmin(question.cost_m[ties[:, 0], ties[:, 1]])])
        taken.append((j, i))
        rows, columns = (np.s_[max(n - reach, 0) : n + reach + 1] for n in (j, i))
        left[rows, columns][each.hypot(x[:, columns] - x[0, i], y[rows] - y[j, 0]) < APART_M - 1e-9] = -np.inf
    return taken
