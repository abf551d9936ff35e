"""Files of records: parts of a long record, records of several runs in a folder, deletion of the oldest.

run.mcap, run.2.mcap, run.3.mcap       of `record.path = run.mcap`: a run writes over the one before
log/0001.mcap, log/0001.2.mcap, log/0002.mcap      of `record.path = log/`: none is written over
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

_NAME = re.compile(r"(?P<stem>.+?)(?:\.(?P<number>\d+))?\.mcap$")


class Part(NamedTuple):
    """Position of a file in its record: name of the first part without its ending, number from 1."""

    stem: str
    number: int


def part_of(path: Path) -> Part:
    """Part from a file's name; a name without a number is a first part."""
    found = _NAME.match(path.name)
    return Part(found["stem"], int(found["number"] or 1)) if found else Part(path.name, 1)


def part_path(first: Path, number: int) -> Path:
    """File of a part."""
    return first if number == 1 else first.with_name(f"{part_of(first).stem}.{number}.mcap")


def first_path(setting: str) -> Path:
    """First file of a run for this `record.path`; in a folder the file with the next free number."""
    if not setting.endswith("/"):
        return Path(setting)
    folder = Path(setting)
    runs = [int(part_of(path).stem) for path in folder.glob("*.mcap") if part_of(path).stem.isdecimal()]
    return folder / f"{max(runs, default=0) + 1:04d}.mcap"


def family(first: Path, whole_folder: bool) -> list[Path]:
    """Files that share one size limit, oldest first: all of a folder, or the parts of one record."""
    paths = first.parent.glob("*.mcap")
    found = [(part_of(path), path) for path in paths if whole_folder or part_of(path).stem == part_of(first).stem]
    return [path for _, path in sorted(found)]


def make_room(files: list[Path], keep_bytes: int) -> None:
    """Delete the first of these files until the others have at most `keep_bytes`. Raises OSError."""
    sizes = {path: path.stat().st_size for path in files}
    total = sum(sizes.values())
    for path, size in sizes.items():
        if total <= keep_bytes:
            return
        path.unlink()
        total -= size
