"""Queries of an archive: rows by name and time, gaps, sizes, histories of commands. Read only.

The time shown for a row is UTC: the run's start plus `at_ns`. A run in lock-step has no UTC; its times count from 1970.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from ground.archive.checks import RowCheck, check_state, check_time, damaged
from ground.archive.schema import TABLES, VERSION, ArchiveError, open_checked, told
from protocol.link.transactions import Code, RequestState

_SILENT_NS = 3_000_000_000  # housekeeping is sent twice a second


class Span(NamedTuple):
    """Selection of rows.

    since_ns, until_ns: UTC in ns; rows from `since_ns` and before `until_ns`.
    names: names of items or events; empty: all.
    run: one run; 0: all.
    last: only the newest rows, this many; 0: all.
    """

    since_ns: int = 0
    until_ns: int = 1 << 62
    names: tuple[str, ...] = ()
    run: int = 0
    last: int = 0


ALL = Span()


class Gap(NamedTuple):
    """Missing datagrams or events, or a silence.

    kind: "datagrams", "events" or "silence".
    boot_id: boot of the rover.
    first, last: first and last missing counter or serial; of a silence, seconds of the run.
    missing: number of missing datagrams or events; 0 for a silence.
    utc_ns: UTC at which reception went on.
    station_open: True if one station run received both what came before and what came after. False: no station was
        open,
        so the link lost nothing.
    """

    kind: str
    boot_id: int
    first: float
    last: float
    missing: int
    utc_ns: int
    station_open: bool = True


class Chain(NamedTuple):
    """Request with all its reports.

    reports: (at_ns of the run, state, text), by serial.
    asked_by: origin of the request, as the station knew it; "": not known (an archive before version 5).
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
        """State of the newest report; "REQUESTED" without one."""
        return self.reports[-1][1] if self.reports else "REQUESTED"


@contextmanager
def reading(path: Path | str) -> Iterator[sqlite3.Connection]:
    """Open an archive for reading; an old one is migrated first.

    Raises ArchiveError, also for later database errors.
    """
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
    """Return the column names of a table, `utc_ns` first. Raises ValueError for an unknown table."""
    if table not in TABLES:
        raise ValueError(f"no table `{table}`; known: {', '.join(TABLES)}")
    return ["utc_ns", *(row[1] for row in db.execute(f"pragma table_info({table})"))]


def select(db: sqlite3.Connection, table: str, span: Span = ALL) -> sqlite3.Cursor:
    """Return rows of a table in time order, in the order of `columns`. Values and events received twice appear once."""
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
    once = {
        "items": "group by t.boot_id, t.name, t.onboard_ns, ifnull(t.boot_id, t.rowid)",
        "events": "group by t.boot_id, t.number, ifnull(t.boot_id, t.rowid)",
    }.get(table, "")
    source = f"(select *, utc_ns as utc from runs) r join {table} t on t.run = r.run where {' and '.join(where)} {once}"
    text = f"select utc + t.at_ns, {fields} from {source} order by utc + t.at_ns, t.rowid"
    if span.last:
        text = (
            f"select * from (select utc + t.at_ns as u, t.rowid as n, {fields} from {source} "
            f"order by u desc, n desc limit {int(span.last)}) order by u, n"
        )
    return db.execute(text, (*given, *span.names))


def rows(db: sqlite3.Connection, table: str, span: Span = ALL) -> Iterator[dict[str, Any]]:
    """Yield the rows of `select` as checked dictionaries by column name. Raises ArchiveError at a damaged row."""
    names = columns(db, table)
    checked = RowCheck(db, table, names)
    for row in select(db, table, span):
        yield checked((row[0], *row[-len(names) + 1 :]))


def boots(db: sqlite3.Connection) -> dict[int, int]:
    """Return by boot id the UTC in ns at onboard time 0, estimated from the housekeeping message with the least delay.

    Boots received only in lock-step, and rows of a version that stored no boot, are not included.
    """
    found = db.execute(
        "select i.boot_id, min(r.utc_ns + i.at_ns - i.onboard_ns) from items i join runs r on r.run = i.run "
        "where i.name = 'mode' and i.boot_id is not null and i.filled is null and i.onboard_ns is not null "
        # one item is enough: the others come with it, and an archive has millions
        "and r.utc_ns > 0 group by i.boot_id"
    )
    return {boot: zero for boot, zero in found if type(boot) is int and type(zero) is int}


def gaps(db: sqlite3.Connection, span: Span = ALL) -> list[Gap]:
    """Return what is missing, in time order: downlink datagrams by counter, events by serial, silences over 3 s.

    Datagrams and events that arrive late, over the link or by `fill`, are not missing.
    """
    bounds = (span.since_ns, span.until_ns)
    found = [
        Gap(kind, *row[:-1], bool(row[-1]))
        for kind, number, where in _NUMBERED
        for row in db.execute(_HOLES.format(number=number, source=kind, where=where), bounds)
    ]
    for boot, *at_ns, utc in db.execute(_SILENCE, bounds):
        if not all(isinstance(value, int | float) for value in at_ns):
            raise damaged("datagrams", "at_ns", at_ns)
        found.append(Gap("silence", boot, at_ns[0] / 1e9, at_ns[1] / 1e9, 0, utc))
    for gap in found:
        if not all(isinstance(value, int | float) for value in gap[1:6]):
            raise damaged("datagrams" if gap.kind == "silence" else gap.kind, "numbers", gap[1:6])
    return sorted((gap for gap in found if not span.run or gap.kind != "silence"), key=lambda gap: gap.utc_ns)


_NUMBERED = (
    ("datagrams", "t.counter", "t.direction = 'down' and t.verdict = 'ok'"),
    ("events", "t.number", "t.boot_id is not null"),
)
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
    """Return every request of every station in the archive, in the order of the requests."""
    heard: dict[tuple[int, int], dict[tuple[int, bool], tuple[int, str, str]]] = {}
    for at_ns, request_id, station, serial, state, text, code in db.execute(
        "select at_ns, request_id, station, serial, state, text, code from reports order by rowid"
    ):
        check_state(state)
        if not all(type(number) is int for number in (at_ns, request_id, station, serial)):
            raise damaged("reports", "numbers", (at_ns, request_id, station, serial))
        own = code == Code.RESTARTED
        heard.setdefault((station, request_id), {}).setdefault((serial, own), (at_ns, state, str(text)))
    found = []
    for row in rows(db, "requests", span):
        reports = heard.get((row["station"], row["request_id"]), {})
        if any(RequestState[state].final for (_, own), (_, state, _) in reports.items() if not own):
            # the rover's own report replaces the station's guess
            reports = {key: report for key, report in reports.items() if not key[1]}
        found.append(
            Chain(
                row["request_id"],
                row["station"],
                row["name"],
                row["arguments"],
                row["utc_ns"],
                tuple(reports[key] for key in sorted(reports)),
                row["asked_by"] or "",
            )
        )
    return found


def newest_product(db: sqlite3.Connection, name: str) -> tuple[int, str, bytes] | None:
    """Return UTC in ns, codec and bytes of the newest product of a name; None if there is none."""
    row = db.execute(
        "select r.utc_ns + p.at_ns, p.codec, p.data from products p join runs r on r.run = p.run "
        "where p.name = ? order by r.run desc, p.at_ns desc, p.rowid desc limit 1",
        (name,),
    ).fetchone()
    if row is not None and tuple(map(type, row)) != (int, str, bytes):
        raise damaged("products", name, row[:2])
    return row


def info(db: sqlite3.Connection) -> dict[str, Any]:
    """Return row counts of each table, first and last time, sizes in bytes, version."""
    counts = {table: int(db.execute(f"select count(*) from {table}").fetchone()[0]) for table in ("runs", *TABLES)}
    first, last = db.execute(
        "select min(r.utc_ns + d.at_ns), max(r.utc_ns + d.at_ns) from datagrams d join runs r on r.run = d.run"
    ).fetchone()
    for at_ns in (first, last):
        check_time("datagrams", at_ns)
    return {"version": VERSION, "rows": counts, "first_utc_ns": first, "last_utc_ns": last, **sizes(db)}


def sizes(db: sqlite3.Connection) -> dict[str, int]:
    """Return the bytes of the file's pages: in use, and free for new rows."""
    page, count, free = (
        int(db.execute(f"pragma {name}").fetchone()[0]) for name in ("page_size", "page_count", "freelist_count")
    )
    return {"used_bytes": page * (count - free), "free_bytes": page * free}
