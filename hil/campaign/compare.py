"""Comparison of two campaigns, case by case: which figures are better, the same or worse.

Pairs are cases of equal number and seed. A yes-or-no figure is compared by McNemar's exact test: of the pairs that
changed sides, as many should change to one side as to the other. A number is compared by the sign test, over the pairs
in which both have it and it differs by more than the figure's `least`. The test is exact (binomial, two-sided); the
verdicts of one comparison are wrong together with a probability of `alpha` at most, by Holm's rule.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from xml.etree import ElementTree

from scipy.stats import binomtest

from hil.campaign.statistics import arrived, flown, reachable, touched
from hil.campaign.table import Row
from protocol.visible import visible

ALPHA = 0.05


@dataclass(frozen=True, slots=True)
class Figure:
    """Figure to compare; less is better.

    of: value of a row, None where it has none; a bool is yes-or-no
    least: differences up to this are none
    """

    means: str
    of: Callable[[Row], float | bool | None]
    least: float = 0.0


def _number(name: str) -> Callable[[Row], float | None]:
    return lambda row: None if row.get(name) is None else float(row[name])


FIGURES: Mapping[str, Figure] = {
    "not_arrived": Figure("did not arrive, of the reachable goals", lambda r: not arrived(r) if reachable(r) else None),
    "contact": Figure("had a contact", lambda r: touched(r) if flown(r) else None),
    "silent": Figure("reported an arrival that was none", lambda r: r["outcome"] == "silent"),
    "aborted": Figure("ended by the bench, or not flown", lambda r: r["outcome"] in ("aborted", "error")),
    "fault": Figure("raised a fault", lambda r: bool(r.get("faults_raised")) if flown(r) else None),
    "way_ratio": Figure("way over optimum", _number("way_ratio"), 1e-3),
    "s_per_m": Figure("time per metre", _number("s_per_m"), 1e-2),
    "distance_to_goal_m": Figure("distance to the goal, of arrivals",
                                 lambda r: _number("distance_to_goal_m")(r) if arrived(r) else None, 1e-3),
    "max_position_error_m": Figure("largest error of the pose", _number("max_position_error_m"), 1e-3),
    "max_error_sigmas": Figure("largest error over its sigma", _number("max_error_sigmas"), 1e-2),
    "max_tilt_deg": Figure("largest tilt", _number("max_tilt_deg"), 1e-2),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Pair:
    """The same case in both tables."""

    number: int
    seed: int
    old: Row
    new: Row


@dataclass(frozen=True, slots=True)
class Change:
    """Comparison of one figure.

    verdict: better, same or worse
    pairs: pairs in which both have the figure
    better, worse: cases in which it fell, or rose
    p: probability of so unequal a division by chance
    """

    name: str
    verdict: str
    pairs: int
    better: tuple[int, ...]
    worse: tuple[int, ...]
    p: float
    is_count: bool


@dataclass(frozen=True, slots=True)
class Comparison:
    """Comparison of two tables.

    unpaired: cases in one of the tables only, or with another seed
    """

    pairs: int
    unpaired: int
    changes: tuple[Change, ...]

    @property
    def worse(self) -> bool:
        """True if any figure is worse."""
        return any(change.verdict == "worse" for change in self.changes)


def paired(old: Sequence[Row], new: Sequence[Row]) -> tuple[list[Pair], int]:
    """Pairs, and the number of cases without one."""
    others = {(row["case_number"], row["seed"]): row for row in new}
    keys = [(row["case_number"], row["seed"]) for row in old]
    pairs = [Pair(*key, row, others[key]) for key, row in zip(keys, old) if key in others]
    return pairs, len({*keys, *others}) - len(pairs)


def compare(old: Sequence[Row], new: Sequence[Row], alpha: float = ALPHA) -> Comparison:
    """Compare two tables."""
    pairs, unpaired = paired(old, new)
    tested = [_tested(name, figure, pairs) for name, figure in FIGURES.items()]
    return Comparison(len(pairs), unpaired, tuple(_judged(tested, alpha)))


def _tested(name: str, figure: Figure, pairs: Sequence[Pair]) -> Change:
    """Comparison of one figure without its verdict."""
    values = [(pair.number, figure.of(pair.old), figure.of(pair.new)) for pair in pairs]
    both = [(number, a, b) for number, a, b in values if a is not None and b is not None]
    better = tuple(number for number, a, b in both if a - b > figure.least)
    worse = tuple(number for number, a, b in both if b - a > figure.least)
    changed = len(better) + len(worse)
    p = float(binomtest(len(worse), changed).pvalue) if changed else 1.0
    return Change(name, "same", len(both), better, worse, p, any(isinstance(a, bool) for _, a, _ in both))


def _judged(changes: Sequence[Change], alpha: float) -> list[Change]:
    """Verdicts by Holm's rule: the smallest p against alpha / n, the next against alpha / (n - 1), until one fails."""
    order = sorted(changes, key=lambda change: change.p)
    real: set[str] = set()
    for k, change in enumerate(order):
        if change.p > alpha / (len(order) - k):
            break
        real.add(change.name)
    return [
        replace(change, verdict="better" if len(change.better) > len(change.worse) else "worse")
        if change.name in real
        else change
        for change in changes
    ]


def junit(comparison: Comparison, name: str) -> str:
    """JUnit's XML: one test for each figure; it fails if the figure is worse."""
    suite = ElementTree.Element(
        "testsuite",
        name=visible(name),
        tests=str(len(comparison.changes)),
        failures=str(sum(change.verdict == "worse" for change in comparison.changes)),
        errors="0",
        skipped="0",
    )
    for change in comparison.changes:
        case = ElementTree.SubElement(suite, "testcase", classname="hil.compare", name=change.name)
        if change.verdict == "worse":
            failure = ElementTree.SubElement(case, "failure", message=words(change))
            failure.text = f"cases: {', '.join(map(str, change.worse))}"
        else:
            ElementTree.SubElement(case, "system-out").text = words(change)
    ElementTree.indent(suite)
    return ElementTree.tostring(suite, encoding="unicode", xml_declaration=True) + "\n"


def words(change: Change) -> str:
    """One change in words."""
    return (
        f"{FIGURES[change.name].means}: {change.verdict}; better in {len(change.better)}, worse in "
        f"{len(change.worse)} of {change.pairs} pairs, p = {change.p:.3g}"
    )
