"""Door of the archive: a file whose rows or bytes are damaged, or of another program, and every verb that reads it."""

from __future__ import annotations

import io
import sqlite3
import tempfile
from contextlib import closing, redirect_stderr, redirect_stdout, suppress
from functools import cache, partial
from pathlib import Path

import typer

from ground.archive.schema import TABLES, ArchiveError
from ground.archive.store import Archive
from ground.products import preview
from ground.verbs import archive, look
from tests.doors.damage import Rng, damaged

_HOSTILE = (None, "", "\x1b[2J\nx", "{}", "[]", "[" * 50_000, '{"a": [1]}', "NaN", "STARTED", "warning", b"\xff\x00",
            b"", 0, 1, -1, 2**62, 2**63 - 1, -(2**63), 1e300, float("inf"), 0.5, "1e5")  # fmt: skip
_UTC_NS = 1_700_000_000_000_000_000
_ASKED = (
    *(partial(verb, as_json=as_json) for verb in (look.events, look.requests, archive.info, archive.gaps)
      for as_json in (False, True)),
    partial(look.link, since="2020-01-01"),
    *(partial(archive.show, table, as_json=as_json) for table in TABLES for as_json in (False, True)),
    lambda file: preview.settings_for(preview.newest_map(file), None, file),
)


@cache
def sound() -> bytes:
    """An archive with some rows in each table."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.db"
        with Archive(path, _UTC_NS) as made:
            for n in range(3):
                made.add("datagrams", n * 10**10, "down", "ok", bytes(60), n * 3, 1)
                made.add("items", n * 10**9, n * 10**9, "mode", 1.0, 1)
                made.add("events", n * 10**9, n * 10**9, 2 * n, "warning", "FAULT", "text", 1)
                made.add("requests", n * 10**9, n, 1, "goto", '{"x_m": 1.0}')
                made.add("reports", n * 10**9, n, 1, n, "STARTED", 0, "text", "[]", 1)
                made.add("products", n * 10**9, n, "ldem", "ldem-2", b"LDM1")
        return path.read_bytes()


def one(rng: Rng) -> None:
    """One damaged archive: every question ends with an answer or an error that says so."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.db"
        data = sound()
        path.write_bytes(damaged(data, rng) if rng.random() < 0.2 else data)
        if rng.random() < 0.9:
            _spoil(path, rng)
        out, beside = io.StringIO(), io.StringIO()
        with redirect_stdout(out), redirect_stderr(beside), suppress(ArchiveError, typer.Exit, preview.NoMapError):
            _ASKED[int(rng.integers(0, len(_ASKED)))](file=path)
        assert all(c.isprintable() or c in "\n\t" for c in out.getvalue() + beside.getvalue())


def _spoil(path: Path, rng: Rng) -> None:
    """Some cells get values that no station writes."""
    with suppress(sqlite3.Error), closing(sqlite3.connect(path)) as db, db:  # the bytes may be damaged
        for _ in range(int(rng.integers(1, 4))):
            table = str(rng.choice([*TABLES, "runs"]))
            names = [row[1] for row in db.execute(f"pragma table_info({table})")]
            if not names:  # the schema itself is damaged
                continue
            value = _HOSTILE[int(rng.integers(0, len(_HOSTILE)))]
            db.execute(f"update {table} set {names[int(rng.integers(0, len(names)))]} = ? where rowid % 2 = ?",
                       (value, int(rng.integers(0, 2))))
