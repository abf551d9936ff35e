"""Export of archive tables for other programs: CSV, Parquet (DuckDB), MCAP (Foxglove). Rows are streamed."""

from __future__ import annotations

import csv
import json
import sqlite3
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import CompressionType, Writer

from ground.archive.read import Span, columns, rows

_AT_ONCE = 20_000
_TYPES = {"integer": "bigint", "text": "varchar", "blob": "blob", "": "double"}


def to_csv(db: sqlite3.Connection, tables: Sequence[str], span: Span, folder: Path) -> list[Path]:
    """Write FOLDER/TABLE.csv for each table, column names first; bytes as hexadecimal digits. Returns the paths."""
    made = []
    for table in tables:
        path = folder / f"{table}.csv"
        names = columns(db, table)
        with path.open("w", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(names)
            for row in rows(db, table, _of(table, names, span)):
                writer.writerow([value.hex() if isinstance(value, bytes) else value for value in row.values()])
        made.append(path)
    return made


def to_parquet(db: sqlite3.Connection, tables: Sequence[str], span: Span, folder: Path) -> list[Path]:
    """Write FOLDER/TABLE.parquet for each table, compressed with zstd. Returns the paths."""
    import duckdb

    made = []
    for table in tables:
        path, names = folder / f"{table}.parquet", columns(db, table)
        kinds = {row[1]: _TYPES[row[2].lower()] for row in db.execute(f"pragma table_info({table})")}
        fields = ", ".join(f"{name} {kinds.get(name, 'bigint')}" for name in names)
        with duckdb.connect() as duck:
            duck.execute(f"create table rows ({fields})")
            part: list[list[Any]] = []
            for row in rows(db, table, _of(table, names, span)):
                part.append(list(row.values()))
                if len(part) == _AT_ONCE:
                    _take(duck, names, part)
            _take(duck, names, part)
            duck.execute("copy rows to ? (format parquet, compression zstd)", [str(path)])
        made.append(path)
    return made


def _take(duck: Any, names: Sequence[str], part: list[list[Any]]) -> None:
    """Insert rows into DuckDB column by column: a thousand times faster than row by row."""
    if not part:
        return
    data = {}
    for name, column in zip(names, zip(*part)):
        data[name] = np.empty(len(column), object)
        data[name][:] = column
    duck.register("part", data)
    duck.execute("insert into rows select * from part")
    duck.unregister("part")
    part.clear()


def to_mcap(db: sqlite3.Connection, tables: Sequence[str], span: Span, folder: Path) -> list[Path]:
    """Write FOLDER/archive.mcap: /items/NAME with `value`, /events, /requests, /reports ... as JSON. Returns the path.

    Log time is ground time (UTC); publish time is onboard time where it is known.
    """
    path = folder / "archive.mcap"
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD)
        writer.start(profile="", library="el-dorado ground")
        known: dict[str, int] = {}
        for table in tables:
            names = columns(db, table)
            for row in rows(db, table, _of(table, names, span)):
                topic = f"/items/{row['name']}" if table == "items" else f"/{table}"
                if topic not in known:
                    known[topic] = _channel(writer, topic, row)
                body = {"value": row["value"]} if table == "items" else row
                data = json.dumps({k: v.hex() if isinstance(v, bytes) else v for k, v in body.items()}).encode()
                at_ns = max(0, row["utc_ns"])
                writer.add_message(known[topic], at_ns, data, max(0, row.get("onboard_ns") or at_ns))
        writer.finish()
    return [path]


def _channel(writer: Writer, topic: str, row: dict[str, Any]) -> int:
    kinds: dict[type, str] = {int: "integer", float: "number", str: "string", bytes: "string"}
    of = {"value": 0.0} if topic.startswith("/items/") else row
    fields = {name: {"type": kinds.get(type(value), "null")} for name, value in of.items()}
    schema = json.dumps({"type": "object", "properties": fields}).encode()
    schema_id = writer.register_schema(topic.strip("/").replace("/", "."), "jsonschema", schema)
    return int(writer.register_channel(topic, "json", schema_id))


def _of(table: str, names: Sequence[str], span: Span) -> Span:
    """Return the span for one table: names select items only, other tables are exported whole."""
    return span if table == "items" else span._replace(names=())


FORMATS: dict[str, Callable[[sqlite3.Connection, Sequence[str], Span, Path], list[Path]]] = {
    "csv": to_csv, "parquet": to_parquet, "mcap": to_mcap,
}  # fmt: skip
