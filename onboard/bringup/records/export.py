"""`onboard record export`: export of a record's channels as CSV, JSON lines, or an MCAP file for Foxglove."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from onboard.bringup.records.foxglove import write_foxglove
from onboard.record.reader import Record, reading, time_ns_of
from onboard.record.rows import ROWS, Row

HEAD = ("t_s", "tick", "channel")


def rows(record: Record, channels: Sequence[str]) -> Iterator[Row]:
    """Yield the messages of some channels in the order of the record; each row with its time, tick and channel."""
    for number, messages in record.ticks():
        t_s = time_ns_of(number, messages) / 1e9
        for topic in channels:
            if topic in messages:
                with reading(number, f"channel {topic}"):
                    found = list(ROWS[topic](messages[topic]))
                for row in found:
                    yield {"t_s": t_s, "tick": number, "channel": topic, **row}


def write_csv(record: Record, channels: Sequence[str], out: Path) -> int:
    """Write one table: a column for each name that occurs in any row; lists are JSON. Returns the number of rows."""
    columns = dict.fromkeys(HEAD)
    for row in rows(record, channels):
        columns.update(dict.fromkeys(row))
    count = 0
    with out.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(columns))
        writer.writeheader()
        for row in rows(record, channels):
            writer.writerow({name: json.dumps(item) if isinstance(item, list) else item for name, item in row.items()})
            count += 1
    return count


def write_jsonl(record: Record, channels: Sequence[str], out: Path) -> int:
    """Write one JSON object per line. Returns the number of rows."""
    count = 0
    with out.open("w", encoding="utf-8") as file:
        for row in rows(record, channels):
            file.write(json.dumps(row) + "\n")
            count += 1
    return count


FORMATS: Mapping[str, Callable[[Record, Sequence[str], Path], int]] = MappingProxyType(
    {"csv": write_csv, "jsonl": write_jsonl, "mcap": write_foxglove}
)
