"""Commands `onboard record ...`: summary of a record, a slice of it, export of its channels for other tools."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import click

from onboard.command_line import EX_CANTCREAT, EX_DATAERR, EX_NOINPUT, EX_USAGE, fail

if TYPE_CHECKING:
    from collections.abc import Callable

    from onboard.bringup.records.cut import Slice

T = TypeVar("T")
EXAMPLES = """\b
Examples:
  onboard record info build/demo/onboard.mcap
  onboard record cut onboard.mcap --seconds 40:60 --out stuck.mcap --replayable
  onboard record cut power_lost.mcap --out whole.mcap
  onboard record export onboard.mcap --channels /out/pose,/out/event --out run.csv
  onboard record export onboard.mcap --out view.mcap      for Foxglove, with its layout docs/foxglove.json
  onboard record export onboard.mcap --ros2 --out run_bag  for ROS 2: ros2 bag play run_bag"""


@click.group("record", epilog=EXAMPLES)
def app() -> None:
    """Inspect, cut and export the record of a run."""


@app.command("info", epilog=EXAMPLES)
@click.argument("record", type=Path)
@click.option("--json", "as_json", is_flag=True, help="All of it as JSON.")
def info_command(record: Path, as_json: bool) -> None:
    """Summarise RECORD: ticks, channels, attachments with their sums, whether it was closed or cut off.

    Exit codes: 0 done, 65 the record is damaged, 66 no such file.
    """
    from onboard.bringup.records.info import info_of, lines

    found = _read(record, lambda: info_of(record))
    print(json.dumps(found.as_json()) if as_json else "\n".join(lines(found)))


@app.command("cut", epilog=EXAMPLES)
@click.argument("record", type=Path)
@click.option("--out", "-o", type=Path, required=True, help="Where the slice goes.")
@click.option("--ticks", metavar="FIRST:LAST", help="Which; either end may be left out.")
@click.option("--seconds", metavar="FIRST:LAST", help="Which, by the time since the start of the run.")
@click.option("--replayable", is_flag=True, help="Keep of what is before it what a replay needs.")
@click.option("--force", is_flag=True, help="Write over a file that is there.")
def cut_command(record: Path, out: Path, ticks: str | None, seconds: str | None, replayable: bool, force: bool) -> None:
    """Write a slice of RECORD that names its source; without an end given, a whole and closed record.

    Exit codes: 0 done, 64 no such slice, 65 the record is damaged, 66 no such file, 73 no place to write.
    """
    from onboard.bringup.records.cut import cut

    part = _slice(ticks, seconds, replayable)
    _may_write(record, out, force)
    kept = _read(record, lambda: cut(record, out, part))
    if not kept:
        raise fail(EX_USAGE, f"{record} has no such ticks; `onboard record info {record}` says which it has")
    alone = part.first == 1 or replayable
    print(
        f"{out}: {kept} ticks; it {'can' if alone else 'cannot'} be replayed"
        + ("" if alone else ", for it does not begin with its run: --replayable keeps what that needs")
    )


@app.command("export", epilog=EXAMPLES)
@click.argument("record", type=Path)
@click.option(
    "--out", "-o", type=Path, required=True,
    help="Where it goes: .csv, .jsonl, or .mcap for Foxglove; with --ros2 a new folder.",
)  # fmt: skip
@click.option("--channels", default="", help="Which, by commas; without it all.")
@click.option("--ros2", is_flag=True, help="A ROS 2 bag (MCAP): odometry, tf, joints, clouds, map, paths, diagnostics.")
@click.option("--force", is_flag=True, help="Write over a file or bag that is there.")
def export_command(record: Path, out: Path, channels: str, ros2: bool, force: bool) -> None:
    """Write channels of RECORD for other tools, decoded: CAN frames by their signals, events, poses.

    Exit codes: 0 done, 64 no such channel or format, 65 the record is damaged, 66 no such file, 73 no place to write.
    """
    from onboard.bringup.records.export import FORMATS
    from onboard.record.reader import open_record
    from onboard.record.rows import ROWS

    chosen = [name for name in channels.split(",") if name] or list(ROWS)
    if unknown := [name for name in chosen if name not in ROWS]:
        raise fail(EX_USAGE, f"no channel {unknown[0]!r}; there are {', '.join(ROWS)}")
    if ros2:
        _export_ros2(record, chosen, out, force)
        return
    form = out.suffix.removeprefix(".")
    if form not in FORMATS:
        raise fail(EX_USAGE, f"{out} should end with one of {', '.join(f'.{name}' for name in FORMATS)}")
    _may_write(record, out, force)
    count = _read(record, lambda: FORMATS[form](open_record(record), chosen, out))
    print(f"{out}: {count} rows")


def _export_ros2(record: Path, channels: list[str], out: Path, force: bool) -> None:
    try:
        from onboard.bringup.ros2.bag import is_bag, write_bag
    except ModuleNotFoundError as error:
        raise fail(EX_USAGE, f"--ros2 needs the package {error.name}: pip install '.[ros2]'") from None
    from onboard.record.reader import open_record

    if out.suffix:
        raise fail(EX_USAGE, f"{out}: a ROS 2 bag is a folder; name it without an ending, as {out.with_suffix('')}")
    if not record.is_file():
        raise fail(EX_NOINPUT, f"no record {record}")
    if not out.parent.is_dir():
        raise fail(EX_CANTCREAT, f"{out} cannot be written: {out.parent} is no folder")
    if out.exists() and not force:
        raise fail(EX_CANTCREAT, f"{out} is there already; --force writes over a bag")
    if out.exists() and not is_bag(out):
        raise fail(EX_CANTCREAT, f"{out} is not a ROS 2 bag, or holds other files too: nothing was written over")
    opened = _read(record, lambda: open_record(record))
    count = _read(record, lambda: write_bag(opened, channels, out))
    print(f"{out}: {count} messages; `ros2 bag play {out}`")


def _slice(ticks: str | None, seconds: str | None, replayable: bool) -> Slice:
    from onboard.bringup.records import cut

    if ticks and seconds:
        raise fail(EX_USAGE, "either --ticks or --seconds")
    name, text = ("--ticks", ticks) if ticks else ("--seconds", seconds or ":")
    first, sign, last = text.partition(":")
    try:
        begin, end = float(first or 0), float(last or 0)
    except ValueError:
        begin, end, sign = 0.0, 0.0, ""
    if not sign or begin < 0 or (end and end < begin):
        raise fail(EX_USAGE, f"{name} {text!r} should be FIRST:LAST, as 40:60, 40: or :60")
    if ticks:
        return cut.Slice(max(1, round(begin)), round(end), replayable)
    return cut.seconds(begin, end, replayable)


def _may_write(record: Path, out: Path, force: bool) -> None:
    if not record.is_file():
        raise fail(EX_NOINPUT, f"no record {record}")
    if not out.parent.is_dir():
        raise fail(EX_CANTCREAT, f"{out} cannot be written: {out.parent} is no folder")
    if out.exists() and (not force or out.samefile(record)):
        hint = "it is the record itself" if out.samefile(record) else "--force writes over it"
        raise fail(EX_CANTCREAT, f"{out} is there already; {hint}")


def _read(record: Path, work: Callable[[], T]) -> T:
    """Return the result of `work`, or exit with a code and a line that states the reason."""
    from onboard.record.reader import DamagedRecordError

    if not record.is_file():
        raise fail(EX_NOINPUT, f"no record {record}")
    try:
        return work()
    except DamagedRecordError as error:
        raise fail(EX_DATAERR, f"{record} is damaged: {error}") from None
    except OSError as error:
        raise fail(EX_CANTCREAT, f"{error.filename or record}: {error.strerror}") from None
