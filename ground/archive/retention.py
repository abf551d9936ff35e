"""Retention of archive rows by age and size, and later entry of missing rows from a rover record (`fill`).

The least needed rows are removed first: raw datagrams (their content is stored decoded), then values, products (never
the newest of a name), events. Runs, requests and reports are never removed, so each command's history stays whole.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from ground.archive.read import reading, sizes
from ground.link.telemetry import Event, Value

FIRST = ("datagrams", "items", "products", "events")
_PART = 20  # rows removed at once: one twentieth of a table


class RemovedRows(NamedTuple):
    """Result of `prune`.

    rows: number of removed rows, by table.
    used_bytes: bytes in use after the removal.
    """

    rows: dict[str, int]
    used_bytes: int


def prune(db: sqlite3.Connection, before_utc_ns: int = 0, most_bytes: int = 0) -> RemovedRows:
    """Remove rows older than `before_utc_ns` (0: none), then the oldest until `most_bytes` are in use (0: no limit).

    Rows without UTC (runs in lock-step) have no age. The file keeps its size until `pack`.
    """
    gone = dict.fromkeys(FIRST, 0)
    for table in FIRST:
        if before_utc_ns:
            gone[table] += _delete(db, table, f"{_old(table)} and {_NEWEST.get(table, '1')}", (before_utc_ns,))
    for table in FIRST:
        while most_bytes and sizes(db)["used_bytes"] > most_bytes:
            may_go = _NEWEST.get(table, "1")
            left = int(db.execute(f"select count(*) from {table} where {may_go}").fetchone()[0])
            if not left:
                break
            oldest = f"rowid in (select rowid from {table} where {may_go} order by rowid limit {left // _PART + 1})"
            gone[table] += _delete(db, table, oldest, ())
    return RemovedRows(gone, sizes(db)["used_bytes"])


def keep_within(path: str, days: float, most_mb: float, now_utc_ns: int) -> int:
    """Prune by the limits of the station file, at the start of a station. Returns the number of rows removed.

    Raises ArchiveError.
    """
    if not Path(path).is_file() or not (days or most_mb):
        return 0
    with reading(path) as db:
        if not days and sizes(db)["used_bytes"] <= most_mb * 1e6:
            return 0
        return sum(prune(db, now_utc_ns - round(days * 86_400e9) if days else 0, round(most_mb * 1e6)).rows.values())


def pack(db: sqlite3.Connection) -> None:
    """Give free pages back to the disk. Needs as much free disk space as the archive has in use."""
    db.execute("vacuum")
    db.execute("pragma wal_checkpoint(truncate)")


_NEWEST = {"products": "rowid not in (select max(rowid) from products group by name)"}


def _old(table: str) -> str:
    return (
        f"rowid in (select t.rowid from {table} t join runs r on r.run = t.run where r.utc_ns > 0 and "
        "r.utc_ns + t.at_ns < ?)"
    )


def _delete(db: sqlite3.Connection, table: str, which: str, given: tuple[int, ...]) -> int:
    return db.execute(f"delete from {table} where {which}", given).rowcount


def fill(db: sqlite3.Connection, boot_id: int, heard: Iterable[Value | Event], note: str) -> tuple[int, int]:
    """Enter values and events of a rover record that the archive lacks, as a run of its own.

    Returns the number of values and of events entered. Their `at_ns` is onboard time, `filled` is 1. Rows that exist
    already (same boot, onboard time and name, or same serial) do not change.
    """
    db.execute("begin immediate")
    try:
        run = db.execute("insert into runs (utc_ns, note) values (?, ?)", (_began(db, boot_id), note)).lastrowid
        values = events = 0
        for one in heard:
            if isinstance(one, Value):
                values += db.execute(_VALUE, {"run": run, "boot": boot_id, **one._asdict()}).rowcount
            else:
                events += db.execute(_EVENT, {"run": run, "boot": boot_id, **one._asdict()}).rowcount
        db.execute("commit" if values + events else "rollback")
    except BaseException:
        db.execute("rollback")
        raise
    return values, events


def _began(db: sqlite3.Connection, boot_id: int) -> int:
    """Return the UTC in ns at onboard time 0 of a boot, estimated from received items; 0 if none has a UTC."""
    row = db.execute(
        "select min(r.utc_ns + i.at_ns - i.onboard_ns) from items i join runs r on r.run = i.run "
        "where i.boot_id = ? and i.filled is null and r.utc_ns > 0",
        (boot_id,),
    ).fetchone()
    return int(row[0] or 0)


_VALUE = """
insert into items (run, at_ns, onboard_ns, name, value, boot_id, filled)
select :run, :onboard_ns, :onboard_ns, :name, :value, :boot, 1
where not exists (select 1 from items where boot_id = :boot and name = :name and onboard_ns = :onboard_ns)
"""
_EVENT = """
insert into events (run, at_ns, onboard_ns, number, severity, name, text, boot_id, filled)
select :run, :onboard_ns, :onboard_ns, :serial, :severity, :name, :text, :boot, 1
where not exists (select 1 from events where boot_id = :boot and number = :serial)
"""
