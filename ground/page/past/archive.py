"""Content of the archive: last values, events and commands of earlier runs, the trail, and the history of an item."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ground.archive.read import Span, chains, reading, rows
from ground.archive.schema import ArchiveError
from ground.page.view.snapshot import CommandRow, EventRow, OldValue
from protocol.link.reports import RequestState
from protocol.tables.telemetry import TABLE
from protocol.visible import visible

_NEWEST_ROWS = 50_000  # rows of items that are searched for last values: an hour and more of telemetry
_EVENTS, _COMMANDS = 200, 40
_TRAIL_ROWS, _TRAIL_STEP_M = 40_000, 0.05
F64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Past:
    """Content of the archive at one instant.

    trouble: why it could not be read; "": it could, or there is none.
    """

    values: Mapping[str, OldValue] = field(default_factory=dict)
    events: tuple[EventRow, ...] = ()
    commands: tuple[CommandRow, ...] = ()
    trouble: str = ""


def read_past(path: str) -> Past:
    """Return what an archive has; empty if there is none. For an unreadable file: `trouble` says why."""
    if not path or not Path(path).is_file():
        return Past()
    try:
        with reading(path) as db:
            return Past(_values(db), _events(db), _commands(db))
    except ArchiveError as error:
        return Past(trouble=str(error))


def _values(db: sqlite3.Connection) -> dict[str, OldValue]:
    """Return the newest value of each item of the present boot, by the time of measurement on board."""
    newest = db.execute("select max(rowid) from items").fetchone()[0] or 0
    found = db.execute(
        "select i.name, i.value, r.utc_ns, i.at_ns, i.onboard_ns, i.boot_id, max(i.rowid) from items i "
        "join runs r on r.run = i.run where i.rowid > ? and i.filled is null group by i.name",
        (newest - _NEWEST_ROWS,),
    )
    known = {row.name for row in TABLE}
    heard = [row for row in found.fetchall() if row[0] in known and isinstance(row[1], int | float)]
    boot = max((row[5] or 0 for row in heard), default=0)
    return {
        name: OldValue(float(value), utc_ns + at_ns if utc_ns else 0)
        for name, value, utc_ns, at_ns, _, boot_id, _ in heard
        if (boot_id or 0) == boot and isinstance(utc_ns, int) and isinstance(at_ns, int)
    }


def _events(db: sqlite3.Connection) -> tuple[EventRow, ...]:
    found = []
    for row in rows(db, "events", Span(last=_EVENTS)):
        found.append(
            EventRow(
                row["utc_ns"],
                row["boot_id"] or 0,
                row.get("number") or 0,
                row["severity"],
                visible(row["name"]),
                visible(row["text"] or ""),
            )
        )
    return tuple(found)


def _commands(db: sqlite3.Connection) -> tuple[CommandRow, ...]:
    found = []
    for chain in chains(db, Span(last=_COMMANDS)):
        with suppress(ValueError, KeyError):
            state, text = (chain.reports[-1][1], chain.reports[-1][2]) if chain.reports else ("REQUESTED", "")
            ended = RequestState[state].final
            arguments = json.loads(chain.arguments)
            found.append(
                CommandRow(
                    chain.request_id,
                    chain.station,
                    chain.name,
                    arguments,
                    visible(chain.asked_by),
                    chain.utc_ns,
                    None,
                    None,
                    None,
                    None,
                    0 if ended else None,
                    state,
                    visible(text),
                )
            )
    return tuple(found)


def trail(path: str) -> F64:
    """Return (n, 2) x, y of the newest boot's way in the archive, m, a place every 5 cm; empty without an archive."""
    if not path or not Path(path).is_file():
        return np.empty((0, 2))
    try:
        with reading(path) as db:
            newest = db.execute("select max(rowid) from items").fetchone()[0] or 0
            found = db.execute(
                "select a.value, b.value from items a join items b on b.run = a.run and b.at_ns = a.at_ns and "
                "b.onboard_ns = a.onboard_ns and b.name = 'y_m' where a.name = 'x_m' and a.rowid > ? and "
                "ifnull(a.boot_id, 0) = (select ifnull(boot_id, 0) from items where rowid = ?) order by a.rowid",
                (newest - _TRAIL_ROWS * 10, newest),
            ).fetchall()
    except ArchiveError:
        return np.empty((0, 2))
    places = [row for row in found if all(isinstance(value, int | float) for value in row)]
    return thinned(np.array(places, float).reshape(-1, 2))


def thinned(places_m: F64, step_m: float = _TRAIL_STEP_M) -> F64:
    """Return (n, 2) places at least `step_m` apart, in order; the first stays."""
    kept: list[F64] = []
    for place in places_m:
        if np.isfinite(place).all() and (not kept or np.hypot(*(place - kept[-1])) >= step_m):
            kept.append(place)
    return np.array(kept, float).reshape(-1, 2)


def history(path: str, names: tuple[str, ...], since_utc_ns: int, most: int = 600) -> dict[str, list[list[float]]]:
    """Return UTC in s and value of each item since an instant, at most `most` of each, evenly left out."""
    found: dict[str, list[list[float]]] = {name: [] for name in names}
    if not path or not Path(path).is_file():
        return found
    try:
        with reading(path) as db:
            for row in rows(db, "items", Span(since_ns=since_utc_ns, names=names)):
                if isinstance(row["value"], int | float):
                    found[row["name"]].append([row["utc_ns"] / 1e9, float(row["value"])])
    except ArchiveError:
        return found
    return {name: series[:: max(1, -(-len(series) // most))] for name, series in found.items()}
