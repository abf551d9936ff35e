"""Options that several verbs share, and their output."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any

import typer

from ground.archive.read import Span
from ground.archive.schema import ArchiveError
from ground.cli.operations.way_out import shorter
from ground.cli.verbs import times as when
from ground.cli.verbs.screen import line_beside
from ground.station.settings import load_settings
from protocol.tables.telemetry import BY_NAME

USAGE, NO_INPUT, DATA, CANNOT_CREATE, TEMPORARY = 64, 66, 65, 73, 75

Since = Annotated[str, typer.Option("--since", metavar="TIME", help=f"From then on: {when.ALLOWED}.")]
Until = Annotated[str, typer.Option("--until", metavar="TIME", help="Before then, likewise.")]
Run = Annotated[int, typer.Option("--run", min=0, metavar="N", help="One run of a station only; 0: all.")]
Last = Annotated[int, typer.Option("--last", min=0, metavar="N", help="The newest so many; 0: all.")]
File = Annotated[Path | None, typer.Option("--archive", metavar="FILE", help="Archive; else the station file's.")]
Yes = Annotated[bool, typer.Option("--yes", help="Do it without asking.")]


def span(since: str, until: str, names: Iterable[str] = (), run: int = 0, last: int = 0) -> Span:
    """Return the rows that the options select. Raises typer.BadParameter."""
    try:
        begin_ns, end_ns = (when.utc_ns(text) if text else bound for text, bound in ((since, 0), (until, 1 << 62)))
        return Span(begin_ns, end_ns, tuple(names), run, last)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--since, --until") from None


def archive_path(file: Path | None, station: Path | None) -> Path:
    """Return the archive: the named file, else the station's. Raises ArchiveError if the station has none."""
    if file is not None:
        return file
    named = load_settings(station).archive
    if not named:
        raise ArchiveError("the station file names no archive; name one with --archive FILE", NO_INPUT)
    return Path(named)


def as_line(tree: dict[str, Any]) -> str:
    """Return one JSON object on a line: bytes as their length, non-finite numbers as null."""
    return json.dumps({key: _plain(value) for key, value in tree.items()})


def _plain(value: Any) -> Any:
    if isinstance(value, bytes):
        return len(value)
    return None if isinstance(value, float) and not math.isfinite(value) else value


def fail(code: int, text: str) -> typer.Exit:
    """Print why a verb ends and return its exit."""
    line_beside(f"ground: {text}")
    return typer.Exit(code)


def confirm(what: str, yes: bool) -> None:
    """Ask before data are lost. Raises typer.Exit if the answer is no, or if there is no terminal to answer."""
    if yes:
        return
    if not sys.stdin.isatty():
        raise fail(USAGE, f"{what}: no terminal to ask on: needs --yes")
    sys.stderr.write(f"{what}. Go on? [y/N] ")
    sys.stderr.flush()
    if sys.stdin.readline().strip().lower() not in ("y", "yes"):
        raise fail(1, "nothing was done")


def items(incomplete: str) -> list[tuple[str, str]]:
    """Return names of telemetry items for the shell's completion, each with its meaning."""
    return [(row.name, row.meaning) for row in BY_NAME.values() if row.name.startswith(incomplete)]


def check_items(names: Iterable[str]) -> tuple[str, ...]:
    """Return the names if all are items. Raises typer.BadParameter with the most similar name."""
    from protocol.tables.commands import named

    try:
        return tuple(named(name, BY_NAME, "item") for name in names)
    except ValueError as error:
        raise typer.BadParameter(shorter(str(error))) from None
