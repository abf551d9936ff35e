"""Table of a campaign: rows stored one by one as they end, then one Parquet file, sorted by case.

    campaign.json     the plan and its hash          cases.jsonl       a row a line, each written through to the disk
    results.parquet   all rows, at the end           report.html       see report.py

A process that dies in the middle of a line leaves a piece of it: `CampaignFolder` cuts it off, and its case is flown
again. One process at a time writes into a folder.
"""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Iterable, Sequence
from fnmatch import fnmatch
from pathlib import Path
from typing import IO, Any

from hil.campaign.case import COLUMNS
from hil.campaign.plan import Plan
from onboard.config import ConfigError

Row = dict[str, Any]
TIMES = frozenset(column.name for column in COLUMNS if column.is_time)
_ABOUT, _ROWS, _TABLE = "campaign.json", "cases.jsonl", "results.parquet"
_AS = "format parquet, compression zstd"
_KINDS: tuple[tuple[type, str], ...] = ((bool, "boolean"), (int, "bigint"), (float, "double"))


class FolderInUseError(RuntimeError):
    """Another process writes into the folder."""


class CampaignFolder:
    """Folder of a campaign, locked for this process while it is open.

    rows: by case, those of earlier processes included
    Raises ConfigError for a folder of another plan or of something else, FolderInUseError, OSError.
    """

    def __init__(self, path: Path, plan: Plan) -> None:
        self.path, self.rows = path, dict[int, Row]()
        _check(path, plan)
        path.mkdir(parents=True, exist_ok=True)
        self._lock = (path / ".lock").open("w")
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self._lock.close()
            raise FolderInUseError(f"{path} is in use by another campaign; end that one, or give --out") from None
        try:
            about = {"name": plan.name, "sha256": plan.sha256, "where": plan.where, "plan": plan.tree}
            text = json.dumps(about, indent=1) + "\n"
            if _text_of(path / _ABOUT) != text:
                replace_file(path / _ABOUT, text)
            is_new = not (path / _ROWS).exists()
            self._file: IO[bytes] = (path / _ROWS).open("a+b", buffering=0)
            if is_new:
                _to_disk(path)
        except OSError:
            self._lock.close()
            raise
        self.read()

    def add(self, row: Row) -> None:
        """Store a row: it survives the end of this process and of the machine. Raises OSError, and stores nothing."""
        end = self._file.seek(0, os.SEEK_END)
        data = json.dumps(row, allow_nan=False).encode() + b"\n"
        try:
            if self._file.write(data) != len(data):
                raise OSError(28, "no room for a whole row")
            os.fsync(self._file.fileno())
        except OSError:
            self._file.truncate(end)
            raise
        self.rows[row["case_number"]] = row

    def read(self) -> None:
        """Read the stored rows again, after an interruption in the middle of `add`."""
        self.rows = {row["case_number"]: row for row in _whole_rows(self._file)}

    def missing(self, cases: int) -> list[int]:
        """Cases that have no row yet."""
        return [number for number in range(1, cases + 1) if number not in self.rows]

    def flown(self, cases: int) -> list[Row]:
        """Rows of the first `cases` cases, without those that have none."""
        return [self.rows[number] for number in range(1, cases + 1) if number in self.rows]

    def finish(self, cases: int) -> Path:
        """Write the table of the first `cases` cases that have rows. Raises OSError."""
        return write_parquet(self.path / _TABLE, self.flown(cases))

    def close(self) -> None:
        """Free the folder."""
        self._file.close()
        self._lock.close()


def _check(path: Path, plan: Plan) -> None:
    """Refuse a folder that is not this plan's. Raises ConfigError."""
    if not path.exists():
        return
    if not path.is_dir():
        raise ConfigError(f"{path} is no folder; give another one with --out")
    about = path / _ABOUT
    if not about.is_file():
        others = sorted(item.name for item in path.iterdir() if not _of_campaign(item))
        if others:
            raise ConfigError(f"{path} holds `{others[0]}` and no campaign; give another folder with --out")
        return
    try:
        known = json.loads(about.read_text())
        if known["sha256"] == plan.sha256:
            return
    except (ValueError, KeyError, TypeError):
        raise ConfigError(f"{about} is damaged; give another folder with --out") from None
    changed = [key for key in sorted({*known["plan"], *plan.tree}) if known["plan"].get(key) != plan.tree.get(key)]
    parts = ", ".join(key for key in changed if key not in ("name", "about", "cases"))
    raise ConfigError(
        f"{path} holds cases of another plan (it differs in {parts or 'seed'}): give another folder with --out"
    )


def _of_campaign(item: Path) -> bool:
    """True for what a folder may have before its campaign: a flight by `hil case`, what a killed start has left."""
    name = item.name
    return name == ".lock" or fnmatch(name, ".*.part") or (fnmatch(name, "case-*") and item.is_dir())


def _whole_rows(file: IO[bytes]) -> list[Row]:
    """Rows of a file; cuts off what follows the last whole one."""
    file.seek(0)
    rows, end = [], 0
    for line in file.read().splitlines(keepends=True):
        try:
            if not line.endswith(b"\n"):
                break
            row = json.loads(line)
            if not isinstance(row, dict) or not isinstance(row.get("case_number"), int):
                break
        except ValueError:
            break
        rows.append(row)
        end += len(line)
    file.truncate(end)
    return rows


def replace_file(path: Path, text: str) -> None:
    """Write a file so that it is whole at any time, after a power cut as well. Raises OSError."""
    part = path.with_name(f".{path.name}.part")
    with part.open("w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    os.replace(part, path)
    _to_disk(path.parent)


def _to_disk(folder: Path) -> None:
    """Write the names in a folder through to the disk. Raises OSError."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _text_of(path: Path) -> str | None:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, ValueError):
        return None


def columns_of(rows: Sequence[Row]) -> dict[str, str]:
    """Columns of the table with their types: case and seed, the knobs by name, the others of COLUMNS."""
    known = {column.name: column.kind for column in COLUMNS}
    knobs = sorted({name for row in rows for name in row} - set(known))
    first = [name for name in known if name in ("case_number", "seed")]
    return {
        **{name: known[name] for name in first},
        **{name: _kind(row.get(name) for row in rows) for name in knobs},
        **{name: kind for name, kind in known.items() if name not in first},
    }


def _kind(values: Iterable[Any]) -> str:
    found = {type(item) for item in values if item is not None}
    if found == {int, float}:
        return "double"
    return next((kind for python, kind in _KINDS if found == {python}), "varchar")


def write_parquet(path: Path, rows: Sequence[Row]) -> Path:
    """Write rows as Parquet (zstd): equal rows give equal bytes. Raises OSError."""
    import duckdb

    columns = columns_of(rows)
    part = path.with_name(f".{path.name}.part")
    fields = ", ".join(f'"{name}" {kind}' for name, kind in columns.items())
    lines = [[_cell(row.get(name), kind) for name, kind in columns.items()] for row in rows]
    try:
        with duckdb.connect(config={"threads": 1}) as duck:
            duck.execute(f"create table rows ({fields})")
            if lines:
                duck.executemany(f"insert into rows values ({', '.join('?' * len(columns))})", lines)
            duck.execute(f"copy (from rows order by case_number) to ? ({_AS})", [str(part)])
    except duckdb.IOException as error:
        part.unlink(missing_ok=True)
        raise OSError(str(error)) from None
    os.replace(part, path)
    return path


def _cell(item: Any, kind: str) -> Any:
    if kind == "varchar" and item is not None and not isinstance(item, str):
        return json.dumps(item)
    return item


def read_table(where: Path) -> list[Row]:
    """Rows of a campaign: of a Parquet file, or of a folder (its rows so far). Raises ConfigError, sorted by case."""
    if where.is_dir():
        if not (where / _ROWS).is_file():
            raise ConfigError(f"{where} holds no campaign: no {_ROWS}")
        with (where / _ROWS).open("rb") as file:
            lines = file.read().splitlines()
        rows = [row for row in map(_row_or_none, lines) if row]
    elif where.is_file():
        rows = read_parquet(where)
    else:
        raise ConfigError(f"{where}: no such campaign: a folder with {_ROWS}, or a Parquet file")
    if not rows:
        raise ConfigError(f"{where} has no rows yet")
    return sorted(rows, key=lambda row: row["case_number"])


def read_parquet(path: Path) -> list[Row]:
    """Rows of a Parquet file of a campaign. Raises ConfigError."""
    import duckdb

    try:
        with duckdb.connect() as duck:
            found = duck.execute("select * from read_parquet(?)", [str(path)])
            names = [column[0] for column in found.description or ()]
            rows = [dict(zip(names, line)) for line in found.fetchall()]
    except duckdb.Error as error:
        raise ConfigError(f"{path}: no Parquet file: {str(error).splitlines()[0]}") from None
    missing = {"case_number", "seed", "outcome"} - set(names)
    if missing:
        raise ConfigError(f"{path}: no table of a campaign: without {', '.join(sorted(missing))}")
    return rows


def _row_or_none(line: bytes) -> Row | None:
    try:
        row = json.loads(line)
    except ValueError:
        return None
    return row if isinstance(row, dict) and "case_number" in row else None


def sha256_in(folder: Path) -> str | None:
    """Hash of the plan with which a folder's cases were flown; None if there is none."""
    try:
        about = json.loads((folder / _ABOUT).read_text(encoding="utf-8"))
        return str(about["sha256"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
