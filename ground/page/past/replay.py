"""Past runs: what the station knew at an instant of a run of the archive, as the same records that the live page reads.

A run is one session of a station. Its times are ns of the station's clock since the run's beginning; `at_ns` is such a
time. Values that were filled in later are left out: the page shows what was known then.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ground.archive.read import Span, reading, rows
from ground.archive.schema import ArchiveError
from ground.link.news import Item
from ground.link.rover_clock import Correlation
from ground.page.map import buffers, drawn, layers
from ground.page.past.archive import thinned
from ground.page.view.snapshot import CommandRow, EventRow, Snapshot
from protocol import WireError
from protocol.link.reports import RequestState
from protocol.products import decode_ldem, poses_of
from protocol.tables.telemetry import TABLE
from protocol.visible import visible

_MOST_RUNS, _EVENTS, _COMMANDS, _PLOT_VALUES = 200, 400, 40, 1500
F64 = NDArray[np.float64]


class RunRow(NamedTuple):
    """One run of the archive.

    utc_ns: UTC of its beginning; 0: a run in lock-step, which has no UTC.
    first_ns, last_ns: times of its first value, and of its last value or product.
    note: who ran it.
    """

    run: int
    utc_ns: int
    first_ns: int
    last_ns: int
    note: str


class Instant(NamedTuple):
    """State of page and map at an instant of a past run.

    maps: as `maps.Maps.tree`; its `revision` is the number of the product.
    trail_m: (n, 2) x, y of the run so far.
    """

    shot: Snapshot
    maps: dict[str, Any]
    trail_m: F64


class Replay:
    """Reader of the runs of one archive. path: None: there is none. All methods raise ArchiveError."""

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self._trail = lru_cache(maxsize=8)(self._whole_trail)
        self._map = lru_cache(maxsize=8)(self._decoded)
        self._picture = lru_cache(maxsize=32)(self._drawn)

    def runs(self) -> list[RunRow]:
        """Return the runs in which something was received, the newest first."""
        if self._path is None or not self._path.is_file():
            return []
        with self._reading() as db:
            found = db.execute(
                "select r.run, r.utc_ns, min(i.at_ns), max(max(i.at_ns), ifnull((select max(p.at_ns) from products p "
                "where p.run = r.run), 0)), r.note from items i join runs r on r.run = i.run "
                "where i.name = 'mode' and i.filled is null group by r.run order by r.run desc limit ?",
                (_MOST_RUNS,),
            ).fetchall()
        return [
            RunRow(run, utc_ns, first, last, visible(str(note or "")))
            for run, utc_ns, first, last, note in found
            if all(type(number) is int for number in (run, utc_ns, first, last))
        ]

    def at(self, row: RunRow, at_ns: int) -> Instant:
        """Return what was known at a time of a run."""
        with self._reading() as db:
            items = _items(db, row.run, at_ns)
            heard_ns = max((item.at_ns for item in items.values()), default=None)
            boot_id = _boot(db, row.run, at_ns)
            shot = Snapshot(
                now_ns=at_ns,
                mono_ns=0,
                utc_ns=row.utc_ns,
                items=items,
                clock=_clock(db, row.run, boot_id, at_ns),
                heard_ns=heard_ns,
                boot_id=boot_id,
                linked=True,
                commands=_commands(db, row, at_ns),
                events=_events(db, row, at_ns),
            )
            maps = self._maps(db, row, at_ns)
        trail = self._trail(row.run)
        return Instant(shot, maps, thinned(trail[trail[:, 0] <= at_ns, 1:]))

    def series(self, row: RunRow, name: str, at_ns: int) -> F64:
        """Return (n, 2) UTC in s and value of an item up to a time, at most 1500 rows, evenly left out."""
        with self._reading() as db:
            found = db.execute(
                "select at_ns, value from items where name = ? and at_ns <= ? and run = ? and filled is "
                "null order by at_ns",
                (name, at_ns, row.run),
            ).fetchall()
        values = np.array(_numbers(found), float).reshape(-1, 2)[:: max(1, -(-len(found) // _PLOT_VALUES))]
        return values * [1e-9, 1.0] + [row.utc_ns / 1e9, 0.0]

    def picture(self, product: int, layer: str, age_of_s: float) -> bytes:
        """Return a layer of the map of a product's row as PNG. age_of_s: UTC of the instant, for the layer of ages.

        Raises LookupError if there is no such map, ValueError for an unknown layer.
        """
        return self._picture(product, layer, int(age_of_s) if layer == "age" else 0)

    def terrain(self, product: int) -> bytes:
        """Return the buffer of the heights of the map of a product's row. Raises LookupError if there is none."""
        return buffers.terrain_buffer(self._map(product).product)

    def cloud(self, product: int) -> bytes:
        """Return the buffer of the scan of a product's row. Raises LookupError for none, WireError if it is damaged."""
        with self._reading() as db:
            found = db.execute(
                "select p.data, p.run, p.at_ns, r.utc_ns from products p join runs r on r.run = p.run "
                "where p.rowid = ? and p.name = 'scan'",
                (product,),
            ).fetchone()
            if found is None or tuple(map(type, found)) != (bytes, int, int, int):
                raise LookupError(f"the archive has no scan {product}")
            data, run, at_ns, utc_ns = found
            clock = _clock(db, run, _boot(db, run, at_ns), at_ns)
        return buffers.cloud_buffer(data, utc_ns + at_ns, None if clock is None else clock.onboard_ns)

    def _drawn(self, product: int, layer: str, utc_s: int) -> bytes:
        return layers.ldem_picture(self._map(product), layer, float(utc_s))

    def _decoded(self, product: int) -> layers.Seen:
        """Return the map of a product's row. Raises LookupError for none or one that cannot be decoded."""
        if self._path is None:
            raise LookupError("no archive")
        with self._reading() as db:
            found = db.execute(
                "select p.data, r.utc_ns + p.at_ns from products p join runs r on r.run = p.run "
                "where p.rowid = ? and p.name = 'ldem'",
                (product,),
            ).fetchone()
        if found is None or tuple(map(type, found)) != (bytes, int):
            raise LookupError(f"the archive has no map {product}")
        try:
            return layers.seen(decode_ldem(found[0]), poses_of(found[0]), found[1])
        except WireError as error:
            raise LookupError(f"map {product}: {error}") from error

    def _maps(self, db: sqlite3.Connection, row: RunRow, at_ns: int) -> dict[str, Any]:
        tree: dict[str, Any] = {"ldem": None, "gdem": None, "scan": None, "trouble": "", **dict.fromkeys(drawn.NAMES)}
        for name in ("ldem", "scan", *drawn.NAMES):
            found = db.execute(
                "select rowid, at_ns, data from products where name = ? and run = ? and at_ns <= ? "
                "order by at_ns desc, rowid desc limit 1",
                (name, row.run, at_ns),
            ).fetchone()
            if found is None or tuple(map(type, found)) != (int, int, bytes):
                continue
            utc_ns = row.utc_ns + found[1]
            try:
                tree[name] = self._part(name, found[0], found[2], utc_ns)
            except (WireError, LookupError) as error:
                tree["trouble"] = f"{name}: {error}"
        return tree

    def _part(self, name: str, product: int, data: bytes, utc_ns: int) -> Any:
        if name == "ldem":
            return self._map_tree(product, utc_ns)
        if name == "scan":
            return {"utc_s": utc_ns / 1e9, "buffer": f"/map/past-cloud.bin?product={product}"}
        return drawn.tree_of(name, data, utc_ns)

    def _map_tree(self, product: int, utc_ns: int) -> dict[str, Any]:
        seen = self._map(product)
        return {
            "bounds": layers.bounds(seen.grid),
            "revision": product,
            "utc_s": utc_ns / 1e9,
            "cells": list(seen.product.heights_m.shape),
            "picture": f"/map/past.png?product={product}",
            "terrain": f"/map/past-terrain.bin?product={product}",
        }

    def _whole_trail(self, run: int) -> F64:
        """Return (n, 3) at_ns, x, y of a run."""
        with self._reading() as db:
            found = db.execute(
                "select a.at_ns, a.value, b.value from items a join items b on b.name = 'y_m' and b.at_ns = a.at_ns "
                "and b.run = a.run and b.onboard_ns = a.onboard_ns where a.name = 'x_m' and a.run = ? and a.filled is "
                "null order by a.at_ns",
                (run,),
            ).fetchall()
        return np.array(_numbers(found), float).reshape(-1, 3)

    @contextmanager
    def _reading(self) -> Iterator[sqlite3.Connection]:
        if self._path is None:
            raise ArchiveError("no archive")
        with reading(self._path) as db:
            yield db


def _numbers(found: list[tuple[Any, ...]]) -> list[tuple[Any, ...]]:
    return [row for row in found if all(type(value) in (int, float) for value in row)]


def _items(db: sqlite3.Connection, run: int, at_ns: int) -> dict[str, Item]:
    """Return the newest value of each item at a time."""
    found = {}
    for known in TABLE:
        row = db.execute(
            "select at_ns, onboard_ns, value from items where name = ? and at_ns <= ? and run = ? and "
            "filled is null order by at_ns desc limit 1",
            (known.name, at_ns, run),
        ).fetchone()
        if row is not None and _numbers([row]):
            found[known.name] = Item(row[0], int(row[1]), known.name, float(row[2]))
    return found


def _boot(db: sqlite3.Connection, run: int, at_ns: int) -> int:
    row = db.execute(
        "select boot_id from items where name = 'mode' and at_ns <= ? and run = ? and filled is null "
        "order by at_ns desc limit 1",
        (at_ns, run),
    ).fetchone()
    return row[0] if row is not None and type(row[0]) is int else 0


def _clock(db: sqlite3.Connection, run: int, boot_id: int, at_ns: int) -> Correlation | None:
    """Return onboard time by the quickest value of the boot in this run; its way down counts as none."""
    row = db.execute(
        "select min(at_ns - onboard_ns) from items where name = 'mode' and run = ? and at_ns <= ? and "
        "ifnull(boot_id, 0) = ? and filled is null",
        (run, at_ns, boot_id),
    ).fetchone()
    return Correlation(at_ns - row[0], None) if row is not None and type(row[0]) is int else None


def _events(db: sqlite3.Connection, row: RunRow, at_ns: int) -> tuple[EventRow, ...]:
    until = Span(until_ns=row.utc_ns + at_ns + 1, run=row.run, last=_EVENTS)
    return tuple(
        EventRow(
            one["utc_ns"],
            one["boot_id"] or 0,
            one.get("number") or 0,
            one["severity"],
            visible(one["name"]),
            visible(one["text"] or ""),
        )
        for one in rows(db, "events", until)
    )


def _commands(db: sqlite3.Connection, row: RunRow, at_ns: int) -> tuple[CommandRow, ...]:
    until = Span(until_ns=row.utc_ns + at_ns + 1, run=row.run, last=_COMMANDS)
    found = []
    for one in rows(db, "requests", until):
        with suppress(ValueError, KeyError):
            found.append(_command(db, row, one, at_ns))
    return tuple(found)


def _command(db: sqlite3.Connection, row: RunRow, one: dict[str, Any], at_ns: int) -> CommandRow:
    """Return a request and how far it was known to be at a time. Raises ValueError or KeyError for a damaged row."""
    requested_ns = one["utc_ns"] - row.utc_ns
    reports = db.execute(
        "select at_ns, state, text from reports where run = ? and station = ? and request_id = ? and "
        "at_ns <= ? order by serial",
        (row.run, one["station"], one["request_id"], at_ns),
    ).fetchall()
    states = [(int(at), RequestState[str(state)]) for at, state, _ in reports]
    accepted_ns = next((at for at, state in states if RequestState.ACCEPTED <= state <= RequestState.COMPLETED), None)
    ended_ns = states[-1][0] if states and states[-1][1].final else None
    return CommandRow(
        one["request_id"],
        one["station"],
        one["name"],
        json.loads(one["arguments"]),
        visible(one["asked_by"] or ""),
        one["utc_ns"],
        requested_ns,
        None,
        states[0][0] if states else None,
        accepted_ns,
        ended_ns,
        states[-1][1].name if states else "REQUESTED",
        visible(str(reports[-1][2] or "")) if reports else "",
    )
