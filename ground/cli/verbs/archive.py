"""The verbs `ground archive ...`: content and gaps of an archive, export, removal of old rows, entry of lost ones."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from ground.archive import read
from ground.archive import retention as keep
from ground.archive.schema import TABLES
from ground.cli.verbs import times as when
from ground.cli.verbs.options import (
    CANNOT_CREATE,
    DATA,
    NO_INPUT,
    File,
    Last,
    Run,
    Since,
    Until,
    Yes,
    archive_path,
    as_line,
    confirm,
    fail,
    items,
    span,
)
from ground.cli.verbs.screen import line_out
from ground.cli.verbs.table import Json, StationFile

app = typer.Typer(help="Everything that was sent and heard: look, export, keep within bounds.", no_args_is_help=True)
KINDS = ("csv", "parquet", "mcap")
Table = Annotated[
    str,
    typer.Option("--table", metavar="TABLE", help=f"One of {', '.join(TABLES)}.", autocompletion=lambda: list(TABLES)),
]
Name = Annotated[
    list[str] | None,
    typer.Option("--name", metavar="NAME", help="Items or events of this name; again for more.", autocompletion=items),
]


@app.command(epilog="Examples: ground archive info | ground archive info --archive old.db --json")
def info(file: File = None, station: StationFile = None, as_json: Json = False) -> None:
    """Show row counts, first and last time, and size."""
    path = archive_path(file, station)
    with read.reading(path) as db:
        known = read.info(db)
    if as_json:
        line_out(as_line({"archive": str(path), **known}))
        return
    line_out(
        f"{path}, version {known['version']}, {known['used_bytes'] / 1e6:.1f} MB in use, "
        f"{known['free_bytes'] / 1e6:.1f} MB free for more"
    )
    if known["first_utc_ns"] is not None:
        line_out(f"{when.told(known['first_utc_ns'])} to {when.told(known['last_utc_ns'])}")
    for table, count in known["rows"].items():
        line_out(f"{table:10} {count:10} rows")


@app.command(epilog="Examples: ground archive show items --name x_m --last 20 | ground archive show reports --since 1h")
def show(
    table: Annotated[
        str, typer.Argument(metavar="TABLE", help=f"One of {', '.join(TABLES)}.", autocompletion=lambda: list(TABLES))
    ],
    name: Name = None,
    since: Since = "",
    until: Until = "",
    run: Run = 0,
    last: Last = 0,
    file: File = None,
    station: StationFile = None,
    as_json: Json = False,
) -> None:
    """Show rows of a table, selected by name and time."""
    asked = span(since, until, name or (), run, last)
    with read.reading(archive_path(file, station)) as db:
        try:
            zeros = read.boots(db) if table == "events" and not as_json else {}
            for row in read.rows(db, table, asked):
                row.pop("run") if not as_json else None
                line_out(as_line(row) if as_json else _line(row, zeros))
        except ValueError as error:
            raise typer.BadParameter(str(error)) from None


def _line(row: dict[str, Any], zeros: dict[int, int]) -> str:
    """zeros: UTC in ns at onboard time 0, by boot, where a row's onboard time is shown."""
    at, onboard_ns = row.pop("utc_ns"), row.get("onboard_ns")
    onboard = when.onboard(onboard_ns, zeros.get(row.get("boot_id", 0)))
    words = (
        f"{len(value)} B" if isinstance(value, bytes) else str(value)
        for key, value in row.items()
        if value is not None and key not in ("at_ns", "onboard_ns")
    )
    return f"{when.told(at)}  {'  '.join(words)}" + (f"  ({onboard})" if onboard else "")


@app.command(epilog="Example: ground archive gaps --since 1d")
def gaps(
    since: Since = "", until: Until = "", file: File = None, station: StationFile = None, as_json: Json = False
) -> None:
    """Show gaps: datagrams and events not received, silences over 3 s, times without an open station."""
    with read.reading(archive_path(file, station)) as db:
        found = read.gaps(db, span(since, until))
    for gap in found:
        if as_json:
            line_out(as_line(gap._asdict()))
        elif gap.kind == "silence":
            line_out(f"{when.told(gap.utc_ns)}  silence    {gap.last - gap.first:.1f} s")
        else:
            words = "missing" if gap.station_open else "not heard: no station was open"
            line_out(
                f"{when.told(gap.utc_ns)}  {gap.kind:9}  {gap.missing} {words}, {gap.first:.0f} to "
                f"{gap.last:.0f}, boot {gap.boot_id}"
            )
    if not found and not as_json:
        line_out("nothing is missing")


@app.command(
    epilog="Examples: ground archive export --out flown | "
    "ground archive export --format parquet --table items --name x_m --since 2h --out flown"
)
def export(
    folder: Annotated[Path, typer.Option("--out", metavar="FOLDER", help="Where the files go; it is made.")],
    kind: Annotated[
        str,
        typer.Option(
            "--format", metavar="KIND", help=f"One of {', '.join(KINDS)}.", autocompletion=lambda: list(KINDS)
        ),
    ] = "csv",
    table: Table = "",
    name: Name = None,
    since: Since = "",
    until: Until = "",
    run: Run = 0,
    file: File = None,
    station: StationFile = None,
    as_json: Json = False,
) -> None:
    """Copy tables to files for other programs: CSV, Parquet, MCAP (Foxglove)."""
    if kind not in KINDS:
        raise typer.BadParameter(f"`{kind}` should be one of {', '.join(KINDS)}", param_hint="--format")
    if table and table not in TABLES:
        raise typer.BadParameter(f"`{table}` should be one of {', '.join(TABLES)}", param_hint="--table")
    from ground.archive.export import FORMATS

    asked = span(since, until, name or (), run)
    with read.reading(archive_path(file, station)) as db:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            for path in FORMATS[kind](db, [table] if table else TABLES, asked, folder):
                line_out(as_line({"file": str(path)}) if as_json else str(path))
        except OSError as error:
            raise fail(CANNOT_CREATE, f"{error.filename or folder}: {error.strerror}") from None


@app.command(epilog="Examples: ground archive prune --older 30d --yes | ground archive prune --mb 500")
def prune(
    older: Annotated[str, typer.Option(metavar="AGE", help="Rows older than this go: 30d, 12h, or a UTC time.")] = "",
    mb: Annotated[float, typer.Option(min=0, metavar="MB", help="Then the oldest, until no more is in use.")] = 0.0,
    yes: Yes = False,
    file: File = None,
    station: StationFile = None,
    as_json: Json = False,
) -> None:
    """Remove old rows, raw datagrams first; the history of every command stays. Gives the space back to the disk."""
    if not older and not mb:
        raise typer.BadParameter("say what may go: --older AGE, --mb MB, or both")
    before_ns = span(older, "").since_ns
    path = archive_path(file, station)
    bounds = " and ".join([f"what is older than {older}"] * bool(older) + [f"what is over {mb:g} MB"] * bool(mb))
    confirm(f"{path}: {bounds} is removed", yes)
    with read.reading(path) as db:
        gone = keep.prune(db, before_ns, round(mb * 1e6))
        keep.pack(db)
    if as_json:
        line_out(as_line({"removed": gone.rows, "used_bytes": gone.used_bytes}))
    else:
        words = ", ".join(f"{count} {name}" for name, count in gone.rows.items() if count) or "nothing"
        line_out(f"removed {words}; {gone.used_bytes / 1e6:.1f} MB are in use")


@app.command(epilog="Example: ground archive fill onboard.mcap")
def fill(
    record: Annotated[Path, typer.Argument(metavar="RECORD", help="Record of the rover, or a slice of one (.mcap).")],
    file: File = None,
    station: StationFile = None,
    as_json: Json = False,
) -> None:
    """Enter values and events from a rover's record that the link lost; they are marked as filled."""
    from ground.archive.record_talk import NoRecordError, NoTalkError, told_down

    try:
        boot_id, heard = told_down(record)
    except NoTalkError as error:
        raise fail(NO_INPUT if isinstance(error, NoRecordError) else DATA, str(error)) from None
    with read.reading(archive_path(file, station)) as db:
        values, events = keep.fill(db, boot_id, heard, f"filled from {record.name}")
    if as_json:
        line_out(as_line({"boot_id": boot_id, "values": values, "events": events}))
    else:
        line_out(f"boot {boot_id}: {values} values and {events} events that the archive had not")
