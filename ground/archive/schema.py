"""Tables of the archive and their versions. Opening migrates an old file and refuses a newer one.

`pragma user_version` has the version, `application_id` identifies the program. A migration is one transaction: if the
station is killed in it, the next one finds the old version intact. A new version is a new row of MIGRATIONS; existing
rows never change.
"""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from protocol.link.datagrams import numbers

APPLICATION_ID = 0x454C4452  # "ELDR"
_OPEN_S = 5.0
_DAY_NS, _MOST_CHUNKS = 86_400_000_000_000, 8192  # limits of `recent_chunks`: it takes a tenth of a second and 9 MB
DATA, CANNOT_CREATE, LOCKED = 65, 73, 75

_FIRST = """
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
_SECOND = """
alter table datagrams add column counter integer;
alter table datagrams add column boot_id integer;
alter table items add column boot_id integer;
alter table items add column filled integer;
alter table events add column boot_id integer;
alter table events add column filled integer;
create index datagrams_by_counter on datagrams (boot_id, counter) where direction = 'down' and verdict = 'ok';
create index items_by_onboard on items (name, boot_id, onboard_ns);
create index events_by_serial on events (boot_id, number);
create index reports_by_request on reports (station, request_id);
create index products_by_name on products (name, run, at_ns);
update datagrams set counter = counter_of(data), boot_id = boot_of(data);
update items set boot_id = (select max(d.boot_id) from datagrams d where d.run = items.run and d.direction = 'down'
    and d.verdict = 'ok');
update events set boot_id = (select max(d.boot_id) from datagrams d where d.run = events.run and d.direction = 'down'
    and d.verdict = 'ok');
"""  # a run has one boot, unless the rover reboots in it: then the newest, as it was received last
_CHUNKS = "direction = 'down' and verdict = 'ok' and substr(data, 1, 1) = x'02'"  # kind 2: a part of a product
_THIRD = f"create index chunks_by_time on datagrams (run, at_ns) where {_CHUNKS}"
_FOURTH = """
alter table requests add column payload blob;
alter table reports add column boot_id integer;
"""
_FIFTH = "alter table requests add column asked_by text"
MIGRATIONS: tuple[str, ...] = (_FIRST, _SECOND, _THIRD, _FOURTH, _FIFTH)
VERSION = len(MIGRATIONS)
TABLES = ("datagrams", "items", "requests", "reports", "events", "products")
FOR_EVER = ("runs", "requests", "reports")  # the history of every command


class ArchiveError(RuntimeError):
    """The archive cannot be used. The text is one line that names the file.

    code: exit code of sysexits.h.
    """

    def __init__(self, text: str, code: int = CANNOT_CREATE) -> None:
        super().__init__(text)
        self.code = code


def private(path: Path | str, flags: int) -> int:
    """Opener for new files with mode 0600: files that outlive a session contain commands and places."""
    return os.open(path, flags, 0o600)


def open_checked(path: Path | str, *, create: bool = True, wait_s: float | None = None) -> sqlite3.Connection:
    """Open the file at the present version. ":memory:" is an empty archive. Raises ArchiveError.

    create: False: a missing file is an error.
    wait_s: time to wait for another program that has the file locked; None: 5 s.
    """
    if str(path) != ":memory:":
        if not create and not Path(path).is_file():
            raise ArchiveError(f"{path}: no archive there; a station that has spoken to a rover makes one", 66)
        _folder(Path(path).parent)
        with suppress(OSError):  # SQLite reports the cause; its other files get the same mode
            os.close(private(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC))
    return guarded(path, lambda: _opened(path, wait_s), wait_s)


def recent_chunks(db: sqlite3.Connection, utc_ns: int) -> list[bytes]:
    """Return at most 8192 datagrams with parts of products, the newest first, none older than a day before `utc_ns`."""
    newest = (
        f"select run, at_ns, data from datagrams indexed by chunks_by_time where {_CHUNKS} "
        "order by run desc, at_ns desc limit ?"
    )
    found = db.execute(
        f"select d.data from ({newest}) d join runs r on r.run = d.run where r.utc_ns > 0 and "
        "r.utc_ns + d.at_ns > ? order by d.run desc, d.at_ns desc",
        (_MOST_CHUNKS, utc_ns - _DAY_NS),
    )
    return [row[0] for row in found]


def guarded(path: Path | str, work: Callable[[], sqlite3.Connection], waited_s: float | None) -> sqlite3.Connection:
    """Call `work`. Raises ArchiveError with the cause in plain words."""
    try:
        return work()
    except sqlite3.Error as error:
        raise told(path, error, waited_s) from error


def told(path: Path | str, error: sqlite3.Error, waited_s: float | None = None) -> ArchiveError:
    """Return the ArchiveError for a database error: cause and remedy, for the operator.

    waited_s: time waited for a lock; None: that of `open_checked`.
    """
    name = getattr(error, "sqlite_errorname", "")
    if "decode to UTF-8" in str(error):
        return ArchiveError(f"{path}: damaged: a text that is none: {str(error).partition(' with text')[0]}", DATA)
    if name.startswith(("SQLITE_BUSY", "SQLITE_LOCKED")):
        held_s = _OPEN_S if waited_s is None else waited_s
        return ArchiveError(f"{path}: locked by another program for {held_s:g} s; try again when that is done", LOCKED)
    if name.startswith(("SQLITE_NOTADB", "SQLITE_CORRUPT")):
        return ArchiveError(
            f"{path}: damaged, or no archive ({error}); move it away and a new one is begun; "
            "`sqlite3 FILE .recover` saves what can be read",
            DATA,
        )
    if name.startswith("SQLITE_FULL"):
        return ArchiveError(f"{path}: the disk is full; free some, or `ground archive prune`")
    return ArchiveError(f"{path}: {error}")


def _folder(folder: Path) -> None:
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as error:
        raise ArchiveError(f"{folder}: {error.strerror}") from error


def _opened(path: Path | str, wait_s: float | None) -> sqlite3.Connection:
    db = sqlite3.connect(path, timeout=_OPEN_S if wait_s is None else wait_s, isolation_level=None)
    try:
        _check(path, db)
        db.execute("pragma journal_mode = wal")
        db.execute("pragma synchronous = normal")
        db.create_function("counter_of", 1, lambda data: _numbers(data)[0], deterministic=True)
        db.create_function("boot_of", 1, lambda data: _numbers(data)[1], deterministic=True)
        _migrate(path, db)
    except BaseException:
        db.close()
        raise
    return db


def _numbers(data: bytes) -> tuple[int | None, int | None]:
    with suppress(ValueError, TypeError):
        return numbers(data)
    return None, None


def _check(path: Path | str, db: sqlite3.Connection) -> int:
    """Return the version of the file. Raises ArchiveError for a newer version and for a file of another program."""
    version = int(db.execute("pragma user_version").fetchone()[0])
    whose = int(db.execute("pragma application_id").fetchone()[0])
    tables = {row[0] for row in db.execute("select name from sqlite_master where type = 'table'")}
    if version > VERSION and whose == APPLICATION_ID:
        raise ArchiveError(
            f"{path}: of version {version}, this program writes version {VERSION}; "
            "use the program that made it, or name another file",
            DATA,
        )
    if whose not in (0, APPLICATION_ID) or (tables and "runs" not in tables):
        raise ArchiveError(f"{path}: a database of another program; name another file as archive", DATA)
    return version


def _migrate(path: Path | str, db: sqlite3.Connection) -> None:
    """Migrate the file one version at a time. If two stations open it, one migrates and the other waits."""
    while True:
        if _check(path, db) == VERSION:
            return
        db.execute("begin immediate")
        try:
            at = _check(path, db)
            if at < VERSION:
                for statement in MIGRATIONS[at].split(";\n"):
                    db.execute(statement)
                db.execute(f"pragma user_version = {at + 1}")
                db.execute(f"pragma application_id = {APPLICATION_ID}")
            db.execute("commit")
        except BaseException:
            db.execute("rollback")
            raise
