"""The archive of a station: every datagram, value, request, report, event and product, in one SQLite file.

Write-ahead log, committed once a turn: a killed station loses at most the turn it was in. All times are int64 ns:
`at_ns` is ground time of the run, `onboard_ns` the rover's own, `utc_ns` in `runs` the wall clock of the run's start
(0 in lock-step, so that a repeated run makes the same rows).
"""

from __future__ import annotations

import sqlite3
from pathlib import Path
from types import TracebackType
from typing import Any, Self

_SCHEMA = """
create table if not exists runs (run integer primary key, utc_ns integer, note text);
create table if not exists datagrams (run integer, at_ns integer, direction text, verdict text, data blob);
create table if not exists items (run integer, at_ns integer, onboard_ns integer, name text, value);
create table if not exists requests (run integer, at_ns integer, request_id integer, station integer, name text,
    arguments text);
create table if not exists reports (run integer, at_ns integer, request_id integer, station integer, serial integer,
    state text, code integer, text text, data text);
create table if not exists events (run integer, at_ns integer, onboard_ns integer, number integer, severity text,
    name text, text text);
create table if not exists products (run integer, at_ns integer, object_id integer, name text, codec text, data blob);
create index if not exists items_by_name on items (name, at_ns);
"""
TABLES = ("datagrams", "items", "requests", "reports", "events", "products")


class Archive:
    """One file, opened for one run. Use it inside `with`. `path` ":memory:" keeps nothing."""

    def __init__(self, path: Path | str, utc_ns: int = 0, note: str = "") -> None:
        if str(path) != ":memory:":
            Path(path).parent.mkdir(parents=True, exist_ok=True)
        self._db = sqlite3.connect(path)
        self._db.execute("pragma journal_mode=wal")
        self._db.execute("pragma synchronous=normal")
        self._db.executescript(_SCHEMA)
        self.run = self._db.execute("insert into runs (utc_ns, note) values (?, ?)", (utc_ns, note)).lastrowid
        self._db.commit()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def add(self, table: str, *values: Any) -> None:
        """One row of a table, its columns in the order of the schema without `run`."""
        if table not in TABLES:
            raise ValueError(f"no table `{table}`; known: {', '.join(TABLES)}")
        marks = ", ".join("?" * (len(values) + 1))
        self._db.execute(f"insert into {table} values ({marks})", (self.run, *values))

    def commit(self) -> None:
        """Makes this turn's rows safe."""
        if self._db.in_transaction:
            self._db.commit()

    def rows(self, table: str) -> list[tuple[Any, ...]]:
        """All rows of this run in the order they were added, without `run`."""
        if table not in TABLES:
            raise ValueError(f"no table `{table}`; known: {', '.join(TABLES)}")
        found = self._db.execute(f"select * from {table} where run = ? order by rowid", (self.run,))
        return [row[1:] for row in found]

    def close(self) -> None:
        """Commits and closes."""
        self.commit()
        self._db.close()
