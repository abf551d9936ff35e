"""Promises of the gate over the rows of its campaign, and the comparison with the committed baseline."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

from hil.campaign.compare import Comparison, words
from hil.campaign.statistics import arrived, reachable, touched
from hil.campaign.table import Row

PROMISES: Mapping[str, Callable[[Row], bool]] = {
    "a goal that can be reached is reached": lambda row: arrived(row) or not reachable(row),
    "no arrival is reported that is none": lambda row: row["outcome"] != "silent",
    "the bench flies every case to its end": lambda row: row["outcome"] not in ("aborted", "error"),
    "no wheel and no body touches a rock": lambda row: not touched(row),
    "no wheel comes into a trench that the drive guard could see": lambda row: not row.get("in_obstacle"),
}


# Cases of the baseline that break a promise, with the cause as far as it is known. A cured one is taken out here.
KNOWN: Mapping[str, Mapping[int, str]] = {
    "no wheel and no body touches a rock": {
        17: "soft soil: the pose is 0.18 m off before SLIP_HIGH is raised, and wheel 1 stands on a rock of 0.11 m"
    }
}


def broken(rows: Sequence[Row]) -> Iterator[str]:
    """Each broken promise, with its cases; without those of KNOWN."""
    for promise, cases in _cases(rows):
        new = [number for number in cases if number not in KNOWN.get(promise, {})]
        if new:
            yield f"not so: {promise}: case {', '.join(map(str, new))}"


def known(rows: Sequence[Row]) -> Iterator[str]:
    """Each entry of KNOWN, and whether it is still so."""
    flown, found = {row["case_number"] for row in rows}, dict(_cases(rows))
    for promise, cases in KNOWN.items():
        for number, why in cases.items():
            if number in flown:
                still = "known" if number in found.get(promise, ()) else "cured, take it out of KNOWN"
                yield f"{still}: case {number}: not so: {promise} ({why})"


def _cases(rows: Sequence[Row]) -> Iterator[tuple[str, list[int]]]:
    for promise, holds in PROMISES.items():
        if cases := [row["case_number"] for row in rows if not holds(row)]:
            yield promise, cases


def worse(comparison: Comparison) -> Iterator[str]:
    """Each figure that is worse than in the baseline; pairs that are missing."""
    if comparison.unpaired:
        yield f"{comparison.unpaired} cases have no pair in the baseline: it is of another plan"
    yield from (words(change) for change in comparison.changes if change.verdict == "worse")


def equal(old: Sequence[Row], new: Sequence[Row]) -> int:
    """Number of cases flown to the same bytes in both."""
    before = {
        row["case_number"]: (row["states_sha256"], row["wires_sha256"]) for row in old if row.get("states_sha256")
    }
    return sum(before.get(row["case_number"]) == (row.get("states_sha256"), row.get("wires_sha256")) for row in new)
