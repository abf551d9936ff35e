"""Questions to an archive: rows by name and time, what is missing, how large it is, chains of commands. Reads only.

A row's time for people is UTC: the run's start plus `at_ns`. A run in lock-step has no UTC; its times count from 1970.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from ground.archive.checks import RowCheck, check_state, check_time, damaged
from ground.archive.schema import TABLES, VERSION, ArchiveError, open_checked, told
from protocol.transactions import Code, State

_SILENT_NS = 3_000_000_000  # housekeeping comes twice a second


class Span(NamedTuple):
    """Which rows: UTC from and before, ns; names of items or events; one run; the newest so many (0: all)."""

    since_ns: int = 0
    until_ns: int = 1 << 62
    names: tuple[str, ...] = ()
    run: int = 0
    last: int = 0


ALL = Span()


class Gap(NamedTuple):
    """Something that was sent and not heard, or nothing heard. first, last: counters, serials or seconds of the run.

    station_open: a run of a station heard what came before and after; else none was open, and nothing was lost.
    """

    kind: str
    boot_id: int
    first: float
    last: float
    missing: int
    utc_ns: int
    station_open: bool = True


class Chain(NamedTuple):
    """A request and all that was heard of it. reports: (at_ns of the run, state, text) by their serials.

    asked_by: who, as the station knew it; "": not known, of an archive before version 5.
    """

    request_id: int
    station: int
    name: str
    arguments: str
    utc_ns: int
    reports: tuple[tuple[int, str, str], ...]
    asked_by: str = ""

    @property
    def state(self) -> str:
        """The newest reported one."""
        return self.reports[-1][1] if self.reports else "REQUESTED"


@contextmanager
def reading(path: Path | str) -> Iterator[sqlite3.Connection]:
    """An archive for reading; an old one is brought up to date first. Raises ArchiveError, also for later errors."""
    db = open_checked(path, create=False)
    try:
        yield db
    except sqlite3.Error as error:
        raise told(path, error) from error
    except ArchiveError as error:
        raise ArchiveError(f"{path}: {error}", error.code) from None
    finally:
        db.close()


def columns(db: sqlite3.Connection, table: str) -> list[str]:
    """Names of a table's columns, with utc_ns in front. Raises ValueError for an unknown table."""
    if table not in TABLES:
        raise ValueError(f"no table `{table}`; known: {', '.join(TABLES)}")
    return ["utc_ns", *(row[1] for row in db.execute(f"pragma table_info({table})"))]


def select(db: sqlite3.Connection, table: str, span: Span = ALL) -> sqlite3.Cursor:
    """Rows of a table in the order of their times, `columns` each. Values and events heard twice come once."""
    names = columns(db, table)
    where, given = ["utc + t.at_ns >= ?", "utc + t.at_ns < ?"], [span.since_ns, span.until_ns]
    if span.run:
        where.append("t.run = ?")
        given.append(span.run)
    if span.names:
        if "name" not in names:
            raise ValueError(f"{table} have no names")
        where.append(f"t.name in ({', '.join('?' * len(span.names))})")
    fields = ", ".join(f"t.{name}" for name in names[1:])
    once = {"items": "group by t.boot_id, t.name, t.onboard_ns, ifnull(t.boot_id, t.rowid)",
            "events": "group by t.boot_id, t.number, ifnull(t.boot_id, t.rowid)"}.get(table, "")
    source = f"(select *, utc_ns as utc from runs) r join {table} t on t.run = r.run where {' and '.join(where)} {once}"
    text = f"select utc + t.at_ns, {fields} from {source} order by utc + t.at_ns, t.rowid"
    if span.last:
        text = (f"select * from (select utc + t.at_ns as u, t.rowid as n, {fields} from {source} "
                f"order by u desc, n desc limit {int(span.last)}) order by u, n")
    return db.execute(text, (*given, *span.names))


def rows(db: sqlite3.Connection, table: str, span: Span = ALL) -> Iterator[dict[str, Any]]:
    """`select`, each row by the names of its columns, checked. Raises ArchiveError at a damaged one."""
    names = columns(db, table)
    checked = RowCheck(db, table, names)
    for row in select(db, table, span):
        yield checked((row[0], *row[-len(names) + 1 :]))


def boots(db: sqlite3.Connection) -> dict[int, int]:
    """UTC in ns at which each boot's onboard time was 0, as near as the quickest of its housekeeping tells.

    Boots that were heard in lock-step only, and rows of a version that kept no boot, are not among them.
    """
    found = db.execute(
        "select i.boot_id, min(r.utc_ns + i.at_ns - i.onboard_ns) from items i join runs r on r.run = i.run "
        "where i.name = 'mode' and i.boot_id is not null and i.filled is null and i.onboard_ns is not null "
        "and r.utc_ns > 0 group by i.boot_id")  # one item: the others come with it, and an archive has millions
    return {boot: zero for boot, zero in found if type(boot) is int and type(zero) is int}


def gaps(db: sqlite3.Connection, span: Span = ALL) -> list[Gap]:
    """What is missing, in the order of time: downlink datagrams by counter, events by serial, silences over 3 s.

    What comes late, by the link or by `fill`, is not missing any more.
    """
    bounds = (span.since_ns, span.until_ns)
    found = [Gap(kind, *row[:-1], bool(row[-1])) for kind, number, where in _NUMBERED for row in db.execute(
        _HOLES.format(number=number, source=kind, where=where), bounds)]
    for boot, *at_ns, utc in db.execute(_SILENCE, bounds):
        if not all(isinstance(value, int | float) for value in at_ns):
            raise damaged("datagrams", "at_ns", at_ns)
        found.append(Gap("silence", boot, at_ns[0] / 1e9, at_ns[1] / 1e9, 0, utc))
    for gap in found:
        if not all(isinstance(value, int | float) for value in gap[1:6]):
            raise damaged("datagrams" if gap.kind == "silence" else gap.kind, "numbers", gap[1:6])
    return sorted((gap for gap in found if not span.run or gap.kind != "silence"), key=lambda gap: gap.utc_ns)


_NUMBERED = (("datagrams", "t.counter", "t.direction = 'down' and t.verdict = 'ok'"),
             ("events", "t.number", "t.boot_id is not null"))
_HOLES = """
with heard as (select t.run as run, t.boot_id as boot_id, min({number}) as low, max({number}) as high
  from {source} t join runs r on r.run = t.run where {where} and coalesce(r.note, '') not like 'filled %' group by 1, 2)
select boot_id, before + 1, number - 1, number - before - 1, utc,
  exists (select 1 from heard h where h.boot_id = holes.boot_id and h.low <= before and h.high >= number) from (
  select t.boot_id as boot_id, {number} as number, r.utc_ns + t.at_ns as utc,
    lag({number}) over (partition by t.boot_id order by {number}) as before
  from {source} t join runs r on r.run = t.run where {where} and {number} is not null) holes
where number > before + 1 and utc >= ? and utc < ? order by utc
"""
_SILENCE = f"""
select boot_id, before, at_ns, utc from (
  select t.boot_id as boot_id, t.at_ns as at_ns, r.utc_ns + t.at_ns as utc,
    lag(t.at_ns) over (partition by t.run order by t.at_ns) as before
  from datagrams t join runs r on r.run = t.run where t.direction = 'down' and t.verdict = 'ok')
where at_ns > before + {_SILENT_NS} and utc >= ? and utc < ? order by utc
"""


def chains(db: sqlite3.Connection, span: Span = ALL) -> list[Chain]:
    """Every request of every station that this archive knows, in the order asked."""
    heard: dict[tuple[int, int], dict[tuple[int, bool], tuple[int, str, str]]] = {}
    for at_ns, request_id, station, serial, state, text, code in db.execute(
            "select at_ns, request_id, station, serial, state, text, code from reports order by rowid"):
        check_state(state)
        if not all(type(number) is int for number in (at_ns, request_id, station, serial)):
            raise damaged("reports", "numbers", (at_ns, request_id, station, serial))
        own = code == Code.RESTARTED
        heard.setdefault((station, request_id), {}).setdefault((serial, own), (at_ns, state, str(text)))
    found = []
    for row in rows(db, "requests", span):
        reports = heard.get((row["station"], row["request_id"]), {})
        if any(State[state].final for (_, own), (_, state, _) in reports.items() if not own):
            reports = {key: report for key, report in reports.items() if not key[1]}  # the rover knows better
        found.append(Chain(row["request_id"], row["station"], row["name"], row["arguments"], row["utc_ns"],
                           tuple(reports[key] for key in sorted(reports)), row["asked_by"] or ""))
    return found


def newest_product(db: sqlite3.Connection, name: str) -> tuple[int, str, bytes] | None:
    """UTC ns, codec and bytes of the newest object of a name; None where none came."""
    row = db.execute("select r.utc_ns + p.at_ns, p.codec, p.data from products p join runs r on r.run = p.run "
                     "where p.name = ? order by r.run desc, p.at_ns desc, p.rowid desc limit 1", (name,)).fetchone()
    if row is not None and tuple(map(type, row)) != (int, str, bytes):
        raise damaged("products", name, row[:2])
    return row


def info(db: sqlite3.Connection) -> dict[str, Any]:
    """Rows of each table, first and last time, sizes in bytes, version."""
    counts = {table: int(db.execute(f"select count(*) from {table}").fetchone()[0]) for table in ("runs", *TABLES)}
    first, last = db.execute("select min(r.utc_ns + d.at_ns), max(r.utc_ns + d.at_ns) from datagrams d "
                             "join runs r on r.run = d.run").fetchone()
    for at_ns in (first, last):
        check_time("datagrams", at_ns)
    return {"version": VERSION, "rows": counts, "first_utc_ns": first, "last_utc_ns": last, **sizes(db)}


def sizes(db: sqlite3.Connection) -> dict[str, int]:
    """Bytes of the file's pages: used and free for new rows."""
    page, count, free = (int(db.execute(f"pragma {name}").fetchone()[0])
                         for name in ("page_size", "page_count", "freelist_count"))
    return {"used_bytes": page * (count - free), "free_bytes": page * free}
