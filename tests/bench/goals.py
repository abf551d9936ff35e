"""Rows of the performance table: their goals, and the form of a measurement."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median
from typing import Any, NamedTuple


class Goal(NamedTuple):
    """Goal of a row.

    text: for people.
    limit: bound of the ratio; of an absolute goal the ratio is measured / limit.
    at_least: True: `ratio` must be at or above `limit`; False: at or below.
    """

    text: str
    limit: float
    at_least: bool = False


GOALS: dict[str, Goal] = {
    "visibility-total": Goal(">= 20 (AVX2), bit-identical", 20, True),
    "visibility-numpy": Goal(">= 200", 200, True),
    "visibility-limit": Goal("<= 1.6", 1.6),
    "nsp-cycle": Goal("<= 5 x its time, regret 0", 5),
    "pose-field": Goal(">= 12", 12, True),
    "cell-classes": Goal(">= 10", 10, True),
    "scan-to-map": Goal(">= 20", 20, True),
    "local-cycle": Goal("<= 200 ms", 1),
    "distance-200": Goal(">= 12", 12, True),
    "distance-2000": Goal(">= 12", 12, True),
    "distance-maze": Goal("<= 2 x", 2),
    "distance-mcp": Goal(">= 20", 20, True),
    "global-50": Goal(">= 15", 15, True),
    "global-500": Goal(">= 12", 12, True),
    "global-2000": Goal(">= 20", 20, True),
    "rasterise-200k": Goal(">= 8", 8, True),
    "rasterise-scan": Goal(">= 20", 20, True),
    "fbm-1024": Goal("<= 1.6", 1.6),
    "registration-100k": Goal("<= 1.3; <= 10 mm, <= 0.05 deg", 1.3),
    "scip-decode": Goal(">= 30", 30, True),
    "scip-poll": Goal("<= 60 us (context)", 1),
    "can-codec": Goal(">= 8, bit-equal", 8, True),
    "tick-cost": Goal("mean <= 5 %, p99.9 <= 20 % of 10 ms", 1),
    "tick-jitter": Goal("p50 <= 2.5, p99.9 <= 3", 1),
    "hil-rtf": Goal(">= 6", 6, True),
    "hil-rtf-memory": Goal(">= 10", 10, True),
    "hil-rtf-scan": Goal(">= 4", 4, True),
    "replay-rtf": Goal(">= 20", 20, True),
    "link-codec": Goal(">= 50,000 /s", 1, True),
    "start": Goal("<= 1.5", 1.5),
    "memory": Goal("<= 200 MB, flat over 10 missions", 1),
}


ENOUGH_S, MOST_PAIRS = 0.05, 25


@dataclass(frozen=True, slots=True)
class Measured:
    """Measurement of one row. also: True if the goal's other conditions are met (accuracy, equal bits)."""

    ratio: float
    ours_s: float
    reference_s: float
    reference: str
    note: str = ""
    also: bool = True

    def row(self, name: str) -> dict[str, Any]:
        """Return the entry of bench.json."""
        goal = GOALS[name]
        holds = self.also and (self.ratio >= goal.limit if goal.at_least else self.ratio <= goal.limit)
        return {
            "name": name,
            "ratio": float(self.ratio),
            "goal": goal.text,
            "holds": bool(holds),
            "ours_s": float(self.ours_s),
            "reference_s": float(self.reference_s),
            "reference": self.reference,
            "note": self.note,
        }


MISSING = Measured(0.0, 0.0, 0.0, "", "missing: part not built", False)


def seconds(work: Callable[[], object], repeats: int, inner: int = 1) -> float:
    """Return the median wall time of one call over `repeats` of `inner` calls each, after one to warm up."""
    work()
    return median(_once(work, inner) for _ in range(repeats))


def against(
    ours: Callable[[], object], theirs: Callable[[], object], reference: str, repeats: int, inner: int = 1
) -> Measured:
    """Measure reference time over our time: the median over pairs, each measured one right after the other.

    A varying clock rate, as on a shared machine, then affects both of a pair alike. Pairs are measured until there are
    `repeats` of them and ENOUGH_S of ours, at most MOST_PAIRS.
    """
    ours(), theirs()
    pairs = [(_once(ours, inner), _once(theirs, inner)) for _ in range(repeats)]
    while inner * sum(pair[0] for pair in pairs) < ENOUGH_S and len(pairs) < MOST_PAIRS:
        pairs.append((_once(ours, inner), _once(theirs, inner)))
    ratio = median(theirs_s / ours_s for ours_s, theirs_s in pairs)
    return Measured(ratio, median(p[0] for p in pairs), median(p[1] for p in pairs), reference)


def _once(work: Callable[[], object], inner: int) -> float:
    began = time.perf_counter()
    for _ in range(inner):
        work()
    return (time.perf_counter() - began) / inner
