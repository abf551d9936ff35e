"""Requests whose station process ended before their outcome: which they are, and what a later session makes of them.

What this boot of the rover is known to have is asked for again, which does nothing twice; of what it never answered a
late report is taken. The rest ends as FAILED, with words that say what is known: `fate`.
"""

from __future__ import annotations

import fcntl
import sqlite3
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from ground.archive.schema import private
from protocol import WireError, commands
from protocol.transactions import State

_ENDED = "its station ended before the outcome"
_GRACE_NS = 600_000_000_000  # for what is on its way, and for the clocks of computers
_FINAL = ", ".join(f"'{state.name}'" for state in State if state.final)


class Orphan(NamedTuple):
    """A request without an outcome. serial, state, text, boot_id: of its newest report; boot_id 0: not known."""

    request_id: int
    name: str
    payload: bytes
    asked_utc_ns: int
    serial: int = -1
    state: str = State.REQUESTED.name
    text: str = ""
    boot_id: int = 0


def fate(orphan: Orphan, boot_id: int, utc_ns: int) -> str | None:
    """The words that it ends with; None: its outcome may still be heard. boot_id: of the rover that is heard now."""
    heard = orphan.state != State.REQUESTED.name
    if heard and orphan.boot_id:
        told = f"; the rover has been restarted since (boot {boot_id}); until then: {orphan.state.lower()}"
        return _ENDED + told if boot_id > orphan.boot_id else None
    if utc_ns <= orphan.asked_utc_ns + _lifetime_ns(orphan.payload) + _GRACE_NS:
        return None
    more = "nothing more was heard of it" if heard else "nothing was heard of it, it may have been done"
    return f"{_ENDED}; {more}"


def _lifetime_ns(payload: bytes) -> int:
    """From when it was issued until it may not begin any more; 0 where nothing says so."""
    try:
        asked = commands.decode(payload)
    except WireError:
        return 0
    return max(0, asked.expiry_ns - asked.issued_ns, asked.start_ns - asked.issued_ns)


def find(db: sqlite3.Connection, station: int, own_run: int, lives: Callable[[int], bool]) -> list[Orphan]:
    """Those of a station, of runs with a UTC whose process is gone, the oldest first."""
    found = []
    for run, request_id, name, payload, utc_ns in db.execute(_OPEN, (station, own_run)).fetchall():
        if not lives(run):
            newest = db.execute(_NEWEST, (station, request_id)).fetchone()
            found.append(Orphan(request_id, name, payload or b"", utc_ns, *(newest or ())))
    return found


_OPEN = f"""
select q.run, q.request_id, q.name, q.payload, r.utc_ns + q.at_ns from requests q join runs r on r.run = q.run
where q.station = ? and q.run != ? and r.utc_ns > 0 and not exists (select 1 from reports p
  where p.station = q.station and p.request_id = q.request_id and p.state in ({_FINAL})) order by q.rowid
"""
_NEWEST = """
select serial, state, text, ifnull(boot_id, 0) from reports where station = ? and request_id = ?
order by rowid desc limit 1
"""


class Living:
    """Which runs of an archive have a process: each holds a lock of its own in a file beside it, while it lives."""

    def __init__(self, path: Path | str, run: int) -> None:
        self._file = None
        with suppress(OSError):  # without it nobody is taken for dead
            if str(path) != ":memory:":
                self._file = open(f"{path}.runs", "ab", opener=private)  # noqa: SIM115  (held as long as the archive)
                fcntl.lockf(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, run)

    def lives(self, run: int) -> bool:
        """Whether another process holds it, or nobody can tell."""
        if self._file is None:
            return True
        try:
            fcntl.lockf(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, run)
        except OSError:
            return True
        fcntl.lockf(self._file, fcntl.LOCK_UN, 1, run)
        return False

    def close(self) -> None:
        """Gives the lock back."""
        if self._file is not None:
            self._file.close()
