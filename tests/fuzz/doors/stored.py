"""Doors of stored files: archives and records that are damaged or from others, and every command that reads them."""

from __future__ import annotations

import io
import sqlite3
import struct
import tempfile
from collections.abc import Callable
from contextlib import closing, redirect_stderr, redirect_stdout, suppress
from functools import cache, partial
from pathlib import Path
from typing import Any

import click
import typer
from mcap.records import Attachment, Channel, Message, Metadata, Schema
from mcap.writer import Writer

from ground.archive.schema import TABLES, ArchiveError
from ground.archive.store import Archive
from ground.cli.verbs import archive
from ground.cli.verbs import history as look
from ground.products import preview
from ground.report import run_files
from onboard.bringup.records import record_command
from onboard.bringup.records.export import FORMATS
from onboard.record import replay_command
from onboard.record.reader import DamagedRecordError, open_record
from onboard.record.replay import last_map, replay
from tests.fuzz.damage import Rng, damaged
from tests.fuzz.door import Door, join, split
from tests.onboard import record_rig

_HOSTILE = (None, "", "\x1b[2J\nx", "{}", "[]", "[" * 50_000, '{"a": [1]}', "NaN", "STARTED", "warning", b"\xff\x00",
            b"", 0, 1, -1, 2**62, 2**63 - 1, -(2**63), 1e300, float("inf"), 0.5, "1e5")  # fmt: skip
_UTC_NS = 1_700_000_000_000_000_000
_ASKED = (
    *(
        partial(verb, as_json=as_json)
        for verb in (look.events, look.requests, archive.info, archive.gaps)
        for as_json in (False, True)
    ),
    partial(look.link, since="2020-01-01"),
    *(partial(archive.show, table, as_json=as_json) for table in TABLES for as_json in (False, True)),
    lambda file: preview.settings_for(preview.newest_map(file), None, file),
)


@cache
def sound() -> bytes:
    """Return an archive with some rows in each table."""
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


def _made_archive(rng: Rng) -> bytes:
    """Return a query, then cells that no station writes (table, column, value, row), then damage (place, bytes)."""
    parts = [rng.bytes(1)]
    for _ in range(int(rng.integers(0, 4))):
        parts.append(b"\0" + rng.bytes(4))
    if rng.random() < 0.2:
        parts.append(b"\1" + struct.pack("<I", int(rng.integers(0, len(sound())))) + rng.bytes(int(rng.integers(1, 9))))
    return join(parts)


def _feed_archive(data: bytes) -> None:
    question, *changes = split(data) or [b""]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.db"
        path.write_bytes(_patched(sound(), changes))
        for change in changes:
            if change[:1] == b"\0" and len(change) >= 5:
                _spoil(path, *change[1:5])
        verb = _ASKED[(question[:1] or b"\0")[0] % len(_ASKED)]
        _ask(partial(verb, file=path), ArchiveError, typer.Exit, preview.NoMapError)


def _patched(data: bytes, changes: list[bytes]) -> bytes:
    """Return the bytes with the damage of those changes that are of this kind: (place, bytes)."""
    raw = bytearray(data)
    for change in changes:
        if change[:1] == b"\1" and len(change) > 5:
            at = struct.unpack("<I", change[1:5])[0] % len(raw)
            raw[at : at + len(change) - 5] = change[5:]
    return bytes(raw)


def _ask(verb: Callable[[], object], *refused: type[BaseException]) -> None:
    """Assert that it ends with an answer or an error, and that its output has no control characters."""
    out, beside = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(beside), suppress(*refused):
        verb()
    assert all(c.isprintable() or c in "\n\t" for c in out.getvalue() + beside.getvalue())


def _spoil(path: Path, table: int, column: int, value: int, row: int) -> None:
    """Set some cells to a value that no station writes."""
    name = [*TABLES, "runs"][table % (len(TABLES) + 1)]
    with suppress(sqlite3.Error), closing(sqlite3.connect(path)) as db, db:  # the bytes may be damaged
        if names := [found[1] for found in db.execute(f"pragma table_info({name})")]:  # none: the schema is damaged
            db.execute(
                f"update {name} set {names[column % len(names)]} = ? where rowid % 2 = ?",
                (_HOSTILE[value % len(_HOSTILE)], row % 2),
            )


# -- records: which command, then messages and attachments in place of sound ones, then damage (place, bytes) --------


@cache
def _record() -> tuple[tuple[Any, ...], ...]:
    """Return a short run with data in every channel, as the arguments of the calls that write it."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "r.mcap"
        record_rig.fly(path, ticks=40, say=record_rig.of_everything)
        (file,) = open_record(path).files
        return tuple(file.records())


def _written(changes: dict[int, bytes]) -> bytes:
    """Return the record with other bytes in some of its messages and attachments, every checksum right."""
    out = io.BytesIO()
    writer, schemas, channels = Writer(out), dict[int, int](), dict[int, int]()
    writer.start(library="fuzz")
    for k, one in enumerate(_record()):
        match one:
            case Schema():
                schemas[one.id] = writer.register_schema(one.name, one.encoding, one.data)
            case Channel():
                schema = schemas.get(one.schema_id, 0)
                channels[one.id] = writer.register_channel(one.topic, one.message_encoding, schema)
            case Message():
                writer.add_message(
                    channels[one.channel_id], one.log_time, changes.get(k, one.data), one.publish_time, one.sequence
                )
            case Attachment():
                writer.add_attachment(one.create_time, one.log_time, one.name, one.media_type, changes.get(k, one.data))
            case Metadata():
                writer.add_metadata(one.name, one.metadata)
    writer.finish()
    return out.getvalue()


def _commands(path: Path, out: Path) -> tuple[Callable[[], object], ...]:
    """Return every command that reads a record."""
    export = record_command.export_command.callback
    return (
        partial(record_command.info_command.callback, path, False),
        partial(record_command.info_command.callback, path, True),
        partial(replay_command.print_verdict, path, True, replay),
        partial(replay_command.replay.callback, path, None, ("motion.cruise_mps=0.05",), True),
        partial(record_command.cut_command.callback, path, out / "cut.mcap", "2:9", None, True, True),
        *(
            partial(record_command.export_command.callback, path, out / f"x.{form}", "", False, True)
            for form in FORMATS
        ),
        partial(_by_callers, last_map, path),
        partial(_reported, path.parent),
        partial(export, path, out / "bag", "", True, True),
    )


def _reported(folder: Path) -> None:
    """Read the record as `ground report` does."""
    with suppress(run_files.NoRunError):
        run_files.read_run(folder)


def _by_callers(read: Callable[[Path], object], path: Path) -> None:
    with suppress(DamagedRecordError):
        read(path)


def _made_record(rng: Rng) -> bytes:
    parts = [rng.bytes(1)]
    bodies = [k for k, one in enumerate(_record()) if isinstance(one, Message | Attachment)]
    for _ in range(int(rng.integers(0, 4))):
        k = bodies[int(rng.integers(0, len(bodies)))] if rng.random() < 0.6 else bodies[int(rng.integers(0, 20))]
        parts.append(b"\0" + struct.pack("<H", k) + damaged(_record()[k].data, rng)[:60_000])
    if rng.random() < 0.3:
        parts.append(b"\1" + struct.pack("<I", int(rng.integers(0, 2**20))) + rng.bytes(int(rng.integers(1, 9))))
    return join(parts)


def _feed_record(data: bytes) -> None:
    verb, *changes = split(data) or [b""]
    made = _written(
        {
            struct.unpack("<H", one[1:3])[0] % len(_record()): one[3:]
            for one in changes
            if one[:1] == b"\0" and len(one) >= 3
        }
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "onboard.mcap"
        path.write_bytes(_patched(made, changes))
        verbs = _commands(path, Path(folder))
        _ask(verbs[(verb[:1] or b"\0")[0] % len(verbs)], SystemExit, click.exceptions.Exit)


ARCHIVE = Door(_made_archive, _feed_archive)
RECORD = Door(_made_record, _feed_record)
