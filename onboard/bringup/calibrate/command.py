"""The command `onboard calibrate`: drive, or read the record of a drive, and estimate the rover's true dimensions."""

from __future__ import annotations

import json
import signal
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from onboard.bringup.can.command import URI_HELP, json_option
from onboard.command_line import (
    EX_CANTCREAT,
    EX_DATAERR,
    EX_INTERRUPTED,
    EX_NOINPUT,
    EX_UNAVAILABLE,
    EX_UNHEALTHY,
    EX_USAGE,
    agreed,
    fail,
    read_config,
)

if TYPE_CHECKING:
    from onboard.bringup.calibrate.drive import CalibrationDrive
    from onboard.config import Config

THOUGHT_TICKS, HUSH_TICKS = 20, 50
EXAMPLES = """\b
Examples:
  onboard calibrate --config rover.toml --out calibrated.toml
  onboard calibrate --config rover.toml --side 1 --record yard.mcap
  onboard calibrate --from yard.mcap --json
"""


@click.command("calibrate", epilog=EXAMPLES)
@click.option("--config", "-c", "path", type=Path, metavar="FILE", help="The rover's TOML: ports, what is believed.")
@click.option("--set", "-s", "settings", multiple=True, help="section.key=value, over the file; repeatable.")
@click.option("--bus", "uri", metavar="URI", help=f"Instead of can.uri: {URI_HELP}")
@click.option("--side", type=float, default=1.5, show_default=True, metavar="M", help="Of the square; 0.5 to 5.")
@click.option("--yes", is_flag=True, help="Do not ask before it drives.")
@click.option("--from", "source", type=Path, metavar="FILE", help="Drive nothing: take the record of a drive.")
@click.option(
    "--record",
    type=Path,
    metavar="FILE",
    default=Path("calibrate.mcap"),
    show_default=True,
    help="Where to keep the drive.",
)
@click.option("--out", "-o", type=Path, metavar="FILE", help="Write the keys to add to the configuration, as TOML.")
@json_option
def calibrate(
    path: Path | None,
    settings: tuple[str, ...],
    uri: str | None,
    side: float,
    yes: bool,
    source: Path | None,
    record: Path,
    out: Path | None,
    as_json: bool,
) -> None:
    """Find wheel radius, steering offsets, mounting of scanner and inertial sensor. THE ROVER DRIVES A SQUARE.

    Before the square, the scanner sweeps down and up, which shows its lag. The drive needs level, firm ground, free
    within the distance that it reports before it starts, with rocks or boxes around it. It stops at Ctrl-C, at any
    fault, and if a step takes too long.

    Exit codes: 0 done, 1 the drive ended early (its record can still be tried), 64 an option is wrong, 65 the record
    lacks the needed data, 66 no such file, 69 refused or no port, 73 a file cannot be written, 78 something wrong in
    the configuration, 130 Ctrl-C.
    """
    from onboard.bringup.calibrate import report
    from onboard.bringup.calibrate.estimate import estimate
    from onboard.bringup.calibrate.evidence import EvidenceError, evidence
    from onboard.bringup.lidar.lag_report import LagReport

    drive = _again(source) if source else _driven(read_config(path, settings), uri, side, yes, record)
    print(f"weighing {source or record} ...", file=sys.stderr)
    try:
        log = drive.log
        found = estimate(evidence(log, drive.rover), drive.rover)
    except EvidenceError as error:
        raise fail(EX_DATAERR, f"{source or record}: {error}") from None
    lag = log.lag if isinstance(log.lag, str) else LagReport(log.lag, drive.latency_ns)
    print(json.dumps(report.as_dict(found, lag)) if as_json else "\n".join(report.lines(found, lag)))
    if out:
        _write(out, report.toml(found, lag, str(source or record)))


def _again(source: Path) -> CalibrationDrive:
    from onboard.bringup.calibrate.shell import again
    from onboard.record.reader import DamagedRecordError

    try:
        return again(source)
    except FileNotFoundError:
        raise fail(EX_NOINPUT, f"no record {source}") from None
    except (IsADirectoryError, PermissionError) as error:
        raise fail(EX_NOINPUT, f"{source}: {error.strerror}") from None
    except DamagedRecordError as error:
        raise fail(EX_DATAERR, f"{source}: {error}") from None


def _driven(config: Config, uri: str | None, side_m: float, yes: bool, record: Path) -> CalibrationDrive:
    from onboard.bringup.calibrate.drive import CalibrationDrive

    config = replace(
        config, can=replace(config.can, uri=uri or config.can.uri), record=replace(config.record, path=str(record))
    )
    if record.exists():
        raise fail(EX_CANTCREAT, f"{record} is there already: name another by --record")
    try:
        drive = CalibrationDrive(config, side_m)
    except ValueError as error:
        raise fail(EX_USAGE, f"--side: {error}") from None
    try:
        _drive(drive, config, side_m, yes)
    finally:
        if not drive.agreed:
            record.unlink(missing_ok=True)
    if drive.problem:
        raise fail(EX_UNHEALTHY, f"{drive.problem}; what was driven is in {record}")
    if drive.stopped:
        raise fail(EX_INTERRUPTED, f"stopped by Ctrl-C; the wheels are off, what was driven is in {record}")
    return drive


def _drive(drive: CalibrationDrive, config: Config, side_m: float, yes: bool) -> None:
    """Run the drive from listening to wheels off."""
    from onboard.bringup.calibrate.plan import room_m
    from onboard.bringup.calibrate.ports import ports
    from onboard.bringup.can.moving.jog import Phase

    minutes = sum(step.seconds for step in drive.steps) / 60
    question = (
        f"The rover will drive a square of {side_m:g} m to its left, {minutes:.0f} minutes. Is all within "
        f"{room_m(side_m):.1f} m free, and a hand on the stop button?"
    )
    with ports(config) as shell:
        ready = shell.until(drive, Phase.READY, lambda _: None)
        if ready and not (yes or agreed(question)):
            ready = False
        elif ready:
            shell.linger(drive, THOUGHT_TICKS)
        if drive.problem:
            raise fail(EX_UNAVAILABLE, f"refused, nothing was sent: {drive.problem}")
        if not ready:
            raise fail(EX_INTERRUPTED, "ended before anything moved")
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda *_: drive.stop())
        drive.go(shell.clock.now_ns())
        shell.until(drive, Phase.DONE, _teller())
        shell.linger(drive, HUSH_TICKS)


def _teller() -> Callable[[CalibrationDrive], None]:
    told = [-1]

    def tell(drive: CalibrationDrive) -> None:
        if drive.complete or drive.at == told[0]:
            return
        told[0] = drive.at
        print(f"{drive.progress_ratio:4.0%}  {drive.steps[drive.at].name}", file=sys.stderr, flush=True)

    return tell


def _write(out: Path, toml: str) -> None:
    try:
        out.write_text(toml)
    except OSError as error:
        raise fail(EX_CANTCREAT, f"{out} cannot be written: {error.strerror}") from None
    print(f"keys for the rover's configuration: {out}", file=sys.stderr)
