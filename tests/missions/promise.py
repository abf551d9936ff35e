"""Promises of the default rule, the check of a campaign against them, and the table in Markdown."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from tests.missions.campaign import Summary

WHOLE = 60  # seeds of a full set: the number of reachable ones is a promise too
LEAST_REACHABLE = 40
HEADS = ("rule and fields", "missions", "reached / reachable", "beyond", "reported", "endless", "stops",
         "way / optimum", "hard", "soft", "unseen",
         "on rocks")  # fmt: skip


@dataclass(frozen=True)
class Promise:
    """Promise of one set of fields.

    reached_ratio: of the reachable goals.
    Medians and p90: upper limits; None: not promised.
    all_reachable: True: every field of the set.
    unreachable: True: every goal must be reported so.
    off_rocks: True: no tyre touches a rock over 0.08 m.
    """

    reached_ratio: float = 1.0
    median_ratio: float | None = None
    p90_ratio: float | None = None
    median_stops: float | None = None
    all_reachable: bool = False
    unreachable: bool = False
    off_rocks: bool = False


PROMISES: Mapping[str, Promise] = {
    "optimistic": Promise(median_ratio=1.05, p90_ratio=1.2, median_stops=3),
    "optimistic, fresh seeds": Promise(median_ratio=1.05, p90_ratio=1.2, median_stops=3),
    "pose error 5 cm + 1 deg": Promise(reached_ratio=0.95),
    "legs of 4 m, as flown": Promise(reached_ratio=0.95, off_rocks=True),
    "demo fields 101 to 130, as flown": Promise(reached_ratio=0.95, off_rocks=True),
    "U-traps": Promise(all_reachable=True),
    "ringed goals": Promise(unreachable=True),
    "36 to 42 m": Promise(all_reachable=True),
    "36 to 42 m, map from orbit": Promise(all_reachable=True),
}


def shortfalls(lines: Sequence[Summary]) -> list[str]:
    """Return each promise that a line of the table breaks, in words; runs without a promise must only end."""
    return [f"{line.name}: {text}" for line in lines for text in _broken(line, PROMISES.get(line.name))]


def _broken(s: Summary, promise: Promise | None) -> Iterator[str]:
    if s.unseen:
        yield f"{s.unseen} missions with a wheel on ground that nobody had seen"
    if s.endless and "unguarded" not in s.name:
        yield f"{s.endless} endless"
    if promise is None:
        return
    if s.hard:
        yield f"{s.hard} missions with a hard contact"
    if promise.off_rocks and s.on_rocks:
        yield f"{s.on_rocks} missions with a wheel on a rock"
    if s.reached < promise.reached_ratio * s.reachable:
        yield f"reached {s.reached} of {s.reachable} reachable goals"
    if s.name.startswith("optimistic") and s.missions == WHOLE and s.reachable < LEAST_REACHABLE:
        yield f"only {s.reachable} of {s.missions} goals are reachable"
    if promise.all_reachable and s.reachable < s.missions:
        yield f"only {s.reachable} of {s.missions} goals are reachable"
    if promise.unreachable and s.reported < s.missions:
        yield f"reported {s.reported} of {s.missions} goals unreachable"
    for what, found, most in (
        ("median stops", s.stops[0], promise.median_stops),
        ("median way / optimum", s.ratio[0], promise.median_ratio),
        ("p90 of way / optimum", s.ratio[1], promise.p90_ratio),
    ):
        if most is not None and found > most:
            yield f"{what} {found:.2f} is over {most:g}"


def cells(s: Summary) -> tuple[str, ...]:
    """Return a line of the table as text, in the order of HEADS."""
    stops, ratio = (
        " / ".join(f"{v:{form}}" for v in of) if of[0] == of[0] else "-"
        for of, form in ((s.stops, ".0f"), (s.ratio, ".2f"))
    )
    return (
        s.name,
        str(s.missions),
        f"{s.reached} / {s.reachable}",
        str(s.beyond),
        str(s.reported),
        str(s.endless),
        stops,
        ratio,
        str(s.hard),
        str(s.soft),
        str(s.unseen),
        str(s.on_rocks),
    )


def markdown(lines: Sequence[Summary]) -> str:
    """Return the table as Markdown."""
    rows = [HEADS, ("---",) + ("---:",) * (len(HEADS) - 1), *(cells(line) for line in lines)]
    return "\n".join("| " + " | ".join(row) + " |" for row in rows) + "\n"
