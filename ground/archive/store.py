"""The archive of a station: every datagram, value, request, report, event and product, in one SQLite file.

The rows of a turn are written in one transaction of a write-ahead log before anything of the turn is sent, so a killed
station loses nothing it has acted on. If the file cannot be written (locked, disk full), rows wait in memory until it
can be; `trouble` states the cause. Times are int64 ns: `at_ns` is ground time of the run, `onboard_ns` the rover's
time, `utc_ns` in `runs` the wall clock at the run's start (0 in lock-step, so that a repeated run makes the same rows).
Several stations may write one file. Tables and versions: `schema`.
"""

from __future__ import annotations

import sqlite3
from itertools import groupby
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from ground.archive.schema import LOCKED, open_checked, recent_chunks, told
from ground.archive.schema import TABLES as TABLES
from ground.archive.schema import ArchiveError as ArchiveError
from ground.archive.unfinished_requests import Living, Orphan, find
from protocol.tables import commands

_TURN_MS, _CLOSE_MS = 100, 5000
_RETRY = 50  # calls of `commit` between two attempts: a quarter of a second
_MOST_WAITING = 100_000
_HALT_AFTER = f"""select name from requests where station = ? and run != ? and name in {commands.HALTING} and
    rowid > (select rowid from requests where run = ? and request_id = ?) limit 1"""


class Archive:
    """One archive file, opened for one run. Use it inside `with`. `path` ":memory:" stores nothing.

    Raises ArchiveError.

    wait_s: time to wait on opening for another program that has the file locked; None: 5 s.
    later: True: a file that stays locked is opened later; until then rows wait in memory and queries find nothing.
    trouble: cause for which rows wait in memory; "": no rows wait.
    lost: number of datagrams dropped because too many rows waited.
    """

    def __init__(
        self, path: Path | str, utc_ns: int = 0, note: str = "", wait_s: float | None = None, *, later: bool = False
    ) -> None:
        self._path, self._utc_ns, self._note = path, utc_ns, note
        self._waiting: list[tuple[str, tuple[Any, ...]]] = []
        self.trouble, self.lost, self._calls, self.run = "", 0, 0, 0
        self._living: Living | None = None
        try:
            self._open(wait_s)
        except ArchiveError as error:
            if not later or error.code != LOCKED:
                raise
            self.trouble, self._db = str(error).partition(";")[0], open_checked(":memory:")
        self._marks = {table: len(self._db.execute(f"pragma table_info({table})").fetchall()) for table in TABLES}

    def _open(self, wait_s: float | None) -> None:
        db = open_checked(self._path, wait_s=wait_s)
        try:
            made = db.execute("insert into runs (utc_ns, note) values (?, ?)", (self._utc_ns, self._note))
        except sqlite3.Error as error:
            db.close()
            raise told(self._path, error, wait_s) from error
        self._db, self.run = db, int(made.lastrowid or 0)
        self._living = Living(self._path, self.run)
        self._db.execute(f"pragma busy_timeout = {_TURN_MS}")

    @property
    def late(self) -> bool:
        """True while the file could not be opened yet."""
        return self._living is None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        try:
            self.close()
        except ArchiveError as unwritten:
            if error is None:
                raise
            error.add_note(str(unwritten))

    def add(self, table: str, *values: Any) -> None:
        """Add one row to a table: columns in the order of the schema, without `run`; missing ones are null.

        Raises ValueError for an unknown table or too many values.
        """
        if table not in TABLES:
            raise ValueError(f"no table `{table}`; known: {', '.join(TABLES)}")
        rest = self._marks[table] - 1 - len(values)
        if rest < 0:
            raise ValueError(f"{table}: {len(values)} values for {self._marks[table] - 1} columns")
        self._waiting.append((table, (*values, *(None,) * rest)))

    def commit(self) -> None:
        """Write the rows so far if the file can be written; otherwise they wait and `trouble` states the cause."""
        if not self._waiting:
            return
        self._calls += 1
        if not self.trouble or self._calls % _RETRY == 0:
            self._write(0.0)

    def _write(self, wait_s: float) -> None:
        """Write the waiting rows. wait_s: time to wait for a file that could not be opened yet."""
        if self.late and not self._opened_now(wait_s):
            self._bound()
            return
        try:
            self._db.execute("begin immediate")
            for table, rows in groupby(self._waiting, lambda row: row[0]):
                marks = ", ".join("?" * self._marks[table])
                found = [(self.run, *values) for _, values in rows]
                self._db.executemany(f"insert into {table} values ({marks})", found)
            self._db.execute("commit")
        except sqlite3.Error as error:
            if self._db.in_transaction:
                self._db.execute("rollback")
            self.trouble = str(told(self._path, error))
            self._bound()
        else:
            self._waiting.clear()
            self.trouble = ""

    def _opened_now(self, wait_s: float) -> bool:
        empty = self._db
        try:
            self._open(wait_s)
        except ArchiveError as error:
            self.trouble = str(error) if error.code != LOCKED else self.trouble
            return False
        empty.close()
        return True

    def _bound(self) -> None:
        """Above the limit drop waiting raw datagrams: they are the most rows, and their content waits decoded."""
        if len(self._waiting) > _MOST_WAITING:
            kept = [row for row in self._waiting if row[0] != "datagrams"]
            self.lost += len(self._waiting) - len(kept)
            self._waiting = kept

    def rows(self, table: str) -> list[tuple[Any, ...]]:
        """Return all rows of this run in the order added, without `run`. Waiting rows are not included."""
        if table not in TABLES:
            raise ValueError(f"no table `{table}`; known: {', '.join(TABLES)}")
        self.commit()
        found = self._db.execute(f"select * from {table} where run = ? order by rowid", (self.run,))
        return [row[1:] for row in found]

    def halt_after(self, request_id: int, station: int) -> str:
        """Return the halting command that another process of the station requested after this request; "": none.

        "" also if the file cannot be read now, or does not have this request yet.
        """
        try:
            row = self._db.execute(_HALT_AFTER, (station, self.run, self.run, request_id)).fetchone()
        except sqlite3.Error:
            return ""
        return "" if row is None else str(row[0])

    def chunks(self) -> list[bytes]:
        """Return datagrams with chunks of products from the day before this run, the newest first; none in lock-step.

        Raises ArchiveError if the file cannot be read.
        """
        if self.late:
            raise ArchiveError(self.trouble, LOCKED)
        try:
            return recent_chunks(self._db, self._utc_ns) if self._utc_ns else []
        except sqlite3.Error as error:
            raise told(self._path, error) from error

    def orphans(self, station: int) -> list[Orphan]:
        """Return a station's requests whose process ended before their outcome; none if the file is unreadable now."""
        try:
            return [] if self._living is None else find(self._db, station, self.run, self._living.lives)
        except sqlite3.Error:
            return []

    def close(self) -> None:
        """Write the waiting rows and close. Raises ArchiveError with the number of lost rows if writing fails."""
        try:
            self._db.execute(f"pragma busy_timeout = {_CLOSE_MS}")
            if self._waiting:
                self._write(_CLOSE_MS / 1000)
        finally:
            self._db.close()
            if self._living is not None:
                self._living.close()
        if self._waiting or self.lost:
            why = self.trouble or f"{self._path}: could not be written for long"
            raise ArchiveError(f"{why}; {len(self._waiting) + self.lost} rows of this run are not in it")
