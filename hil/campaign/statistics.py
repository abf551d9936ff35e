"""Statistics of a campaign's table: shares with Wilson intervals, by class of a knob; failures grouped by reason.

A share's interval is Wilson's (95 %): it also holds for 0 or all of a few cases. A goal counts as reachable if the
truth planner finds a path on a perfect map.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from scipy.stats import binomtest

from hil.campaign.case import COLUMNS, OUTCOMES, reason_class
from hil.campaign.table import Row

CONFIDENCE = 0.95
BINS = 4  # classes of a knob with many numbers, of equal width
MOST_CLASSES = 6


@dataclass(frozen=True, slots=True)
class Share:
    """Share of some cases, with its interval."""

    count: int
    total: int
    low: float
    high: float

    @property
    def ratio(self) -> float:
        """Count over total; 0 of none."""
        return self.count / self.total if self.total else 0.0

    def __str__(self) -> str:
        if not self.total:
            return "-"
        percent = f"{100 * self.ratio:.1f} % ({100 * self.low:.1f} to {100 * self.high:.1f})"
        return f"{self.count} of {self.total}: {percent}"


def share(count: int, total: int) -> Share:
    """Share with Wilson's interval."""
    if not total:
        return Share(0, 0, 0.0, 1.0)
    interval = binomtest(count, total).proportion_ci(CONFIDENCE, method="wilson")
    return Share(count, total, float(interval.low), float(interval.high))


def share_of(rows: Sequence[Row], holds: Callable[[Row], bool]) -> Share:
    """Share of the rows for which something holds."""
    return share(sum(map(holds, rows)), len(rows))


def arrived(row: Row) -> bool:
    """At the goal, by its own report and by truth."""
    return bool(row["outcome"] == "arrived")


def reachable(row: Row) -> bool:
    """A path leads to the goal. A case whose ground was never made counts as such: its failure is not explained."""
    return row.get("reachable") is not False


def flown(row: Row) -> bool:
    """It has the figures of a flight: the bench has flown it."""
    return row.get("contacts") is not None


def touched(row: Row) -> bool:
    """It had a contact."""
    return bool(row.get("contacts"))


def touched_of(rows: Sequence[Row]) -> Share:
    """Share of the flights that had a contact."""
    return share_of([row for row in rows if flown(row)], touched)


HEADLINES: Mapping[str, Callable[[Sequence[Row]], Share]] = {
    "at the goal, of all": lambda rows: share_of(rows, arrived),
    "at the goal, of the reachable ones": lambda rows: share_of([row for row in rows if reachable(row)], arrived),
    "stopped with a reason, of those out of reach": lambda rows: share_of(
        [row for row in rows if not reachable(row)], lambda row: row["outcome"] == "stopped"
    ),
    "a contact, of the flights": touched_of,
    "reported an arrival that was none": lambda rows: share_of(rows, lambda row: row["outcome"] == "silent"),
    "ended by the bench: tipped, or beside the ground": lambda rows: share_of(
        rows, lambda row: row["outcome"] == "aborted"
    ),
    "a fault raised, of the flights": lambda rows: share_of(
        [row for row in rows if flown(row)], lambda row: bool(row.get("faults_raised"))
    ),
}


@dataclass(frozen=True, slots=True)
class ClassRow:
    """Class of a knob: arrivals of its reachable cases, its contacts."""

    name: str
    cases: int
    arrivals: Share
    contacts: Share


@dataclass(frozen=True, slots=True)
class ReasonGroup:
    """Failures with the same reason, numbers aside. example: the reason of the first one."""

    outcome: str
    example: str
    cases: tuple[int, ...]


def knobs_of(rows: Sequence[Row]) -> list[str]:
    """Knobs of a table that differ between its cases."""
    known = {column.name for column in COLUMNS}
    names = sorted({name for row in rows for name in row} - known)
    return [name for name in names if len({_key(row.get(name)) for row in rows}) > 1]


def by_class(rows: Sequence[Row], knob: str) -> list[ClassRow]:
    """Cases by the classes of a knob."""
    return [_class_row(name, members) for name, members in classes(rows, knob)]


def _class_row(name: str, members: Sequence[Row]) -> ClassRow:
    near = [row for row in members if reachable(row)]
    return ClassRow(name, len(members), share_of(near, arrived), touched_of(members))


def classes(rows: Sequence[Row], knob: str) -> list[tuple[str, list[Row]]]:
    """Classes of a knob with their rows: each value of a few, else BINS of equal width."""
    values = {_key(row.get(knob)) for row in rows}
    numbers = [row[knob] for row in rows if isinstance(row.get(knob), int | float)]
    if len(values) <= MOST_CLASSES or not numbers:
        names = sorted(values, key=_order)
        return [(_shown(name), [row for row in rows if _key(row.get(knob)) == name]) for name in names]
    low, high = min(numbers), max(numbers)
    width = (high - low) / BINS
    found: list[tuple[str, list[Row]]] = []
    for k in range(BINS):
        begin, end, last = low + k * width, low + (k + 1) * width, k == BINS - 1
        members = [row for row in rows if _is_in(row.get(knob), begin, high if last else end, last)]
        found.append((f"{begin:.3g} to {end:.3g}", members))
    none = [row for row in rows if row.get(knob) is None]
    return [*found, *([("none", none)] if none else [])]


def _is_in(item: Any, begin: float, end: float, closed: bool) -> bool:
    return isinstance(item, int | float) and begin <= item and (item <= end if closed else item < end)


def _key(item: Any) -> Any:
    return tuple(item) if isinstance(item, list) else item


def _order(item: Any) -> tuple[int, float, str]:
    if item is None:
        return 2, 0.0, ""
    return (0, float(item), "") if isinstance(item, int | float) else (1, 0.0, str(item))


def _shown(item: Any) -> str:
    if isinstance(item, float):
        return f"{item:.4g}"
    return "none" if item is None else str(item)


def failures(rows: Iterable[Row]) -> list[ReasonGroup]:
    """Cases that did not arrive or had a contact, grouped by outcome and reason, the most frequent first."""
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        if not arrived(row):
            groups.setdefault((row["outcome"], reason_class(row.get("reason") or "")), []).append(row)
        elif touched(row):
            groups.setdefault(("contact", ""), []).append(row)
    made = [
        ReasonGroup(
            outcome,
            (of[0].get("first_contact") if outcome == "contact" else of[0].get("reason")) or "",
            tuple(row["case_number"] for row in of),
        )
        for (outcome, _), of in groups.items()
    ]
    return sorted(made, key=lambda group: (-len(group.cases), group.cases))


def spread(rows: Iterable[Row], name: str) -> tuple[float, float, float] | None:
    """Median, nine of ten, and largest of a column; None without values."""
    values = sorted(float(row[name]) for row in rows if row.get(name) is not None)
    if not values:
        return None
    return statistics.median(values), values[math.ceil(0.9 * len(values)) - 1], values[-1]


def counts(rows: Iterable[Row]) -> dict[str, int]:
    """Number of rows of each outcome."""
    found = [row["outcome"] for row in rows]
    return {name: found.count(name) for name in OUTCOMES if name in found}
