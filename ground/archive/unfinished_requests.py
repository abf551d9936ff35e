"""Requests whose station process ended before their outcome: how a later session finds and settles them.

If the newest report comes from the present boot of the rover, the session asks for the outcome again (the rover does
not execute a request twice). If the rover never answered, a late report is still accepted. All others end as FAILED
with a text that states what is known (`fate`).
"""

from __future__ import annotations

import fcntl
import sqlite3
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from ground.archive.schema import private
from protocol import WireError
from protocol.link.transactions import RequestState
from protocol.tables import commands

_ENDED = "its station ended before the outcome"
_GRACE_NS = 600_000_000_000  # allows for datagrams on their way and for clock differences between computers
_FINAL = ", ".join(f"'{state.name}'" for state in RequestState if state.final)


class Orphan(NamedTuple):
    """Request without an outcome.

    request_id, name, payload: of the request.
    asked_utc_ns: UTC of the request.
    serial, state, text: of its newest report; serial -1: no report.
    boot_id: boot of the rover during that report; 0: not known.
    """

    request_id: int
    name: str
    payload: bytes
    asked_utc_ns: int
    serial: int = -1
    state: str = RequestState.REQUESTED.name
    text: str = ""
    boot_id: int = 0


def fate(orphan: Orphan, boot_id: int, utc_ns: int) -> str | None:
    """Return the text with which the request ends; None if its outcome may still arrive.

    boot_id: present boot of the rover.
    """
    heard = orphan.state != RequestState.REQUESTED.name
    if heard and orphan.boot_id:
        told = f"; the rover has been restarted since (boot {boot_id}); until then: {orphan.state.lower()}"
        return _ENDED + told if boot_id > orphan.boot_id else None
    if utc_ns <= orphan.asked_utc_ns + _lifetime_ns(orphan.payload) + _GRACE_NS:
        return None
    more = "nothing more was heard of it" if heard else "nothing was heard of it, it may have been done"
    return f"{_ENDED}; {more}"


def _lifetime_ns(payload: bytes) -> int:
    """Return the time in ns from issue until the request may no longer begin; 0 if it has no limit."""
    try:
        asked = commands.decode(payload)
    except WireError:
        return 0
    return max(0, asked.expiry_ns - asked.issued_ns, asked.start_ns - asked.issued_ns)


def find(db: sqlite3.Connection, station: int, own_run: int, lives: Callable[[int], bool]) -> list[Orphan]:
    """Return the open requests of a station from runs with a UTC whose process has ended, the oldest first."""
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
    """Process locks of archive runs: each run locks one byte of a file next to the archive while its process lives."""

    def __init__(self, path: Path | str, run: int) -> None:
        self._file = None
        with suppress(OSError):  # without the file no run counts as dead
            if str(path) != ":memory:":
                self._file = open(f"{path}.runs", "ab", opener=private)  # noqa: SIM115  (open as long as the archive)
                fcntl.lockf(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, run)

    def lives(self, run: int) -> bool:
        """Return whether another process has the lock of this run; True also where this cannot be determined."""
        if self._file is None:
            return True
        try:
            fcntl.lockf(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, run)
        except OSError:
            return True
        fcntl.lockf(self._file, fcntl.LOCK_UN, 1, run)
        return False

    def close(self) -> None:
        """Release the lock."""
        if self._file is not None:
            self._file.close()
