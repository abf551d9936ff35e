"""The commands `onboard lidar ...`: a scanner without the flight program, by the flight driver."""

from __future__ import annotations

import json
import signal
from collections.abc import Callable
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import click
from click.exceptions import Exit

from onboard.bringup.lidar.address import address_of
from onboard.bringup.lidar.lag_command import lag_command
from onboard.command_line import (
    EX_CANTCREAT,
    EX_CONFIG,
    EX_DATAERR,
    EX_INTERRUPTED,
    EX_IOERR,
    EX_NOINPUT,
    EX_UNAVAILABLE,
    EX_UNHEALTHY,
    EX_USAGE,
    examples_of,
    fail,
)

if TYPE_CHECKING:
    from onboard.bringup.lidar.report import Report
    from onboard.bringup.lidar.shell import LidarShell
    from onboard.config import Config
    from onboard.record.writer import Recorder

T = TypeVar("T")
EXAMPLES = """\b
Examples:
  onboard lidar info tty:/dev/ttyACM0
  onboard lidar watch tcp:192.168.0.10:10940 --polar
  onboard lidar check tty:/dev/ttyACM0 --seconds 10
  onboard lidar record tty:/dev/ttyACM0 --out room.mcap --seconds 30
  onboard lidar replay room.mcap
  onboard lidar check room.mcap
  onboard lidar scan build/demo/onboard.mcap --out stop1.ply
  onboard lidar lag tty:/dev/ttyACM0 --bus socketcan:can0"""

settings_option = click.option("--set", "-s", "settings", multiple=True, help="lidar.key=value; repeatable.")
json_option = click.option("--json", "as_json", is_flag=True, help="For programs.")


def seconds_option(default: float) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Option --seconds of a command."""
    return click.option(
        "--seconds", type=click.FloatRange(min=0), default=default, show_default=True, help="How long; 0: until Ctrl-C."
    )


@click.group("lidar", epilog=EXAMPLES)
def app() -> None:
    """A scanner without the flight program, by the flight driver.

    ADDRESS is tty:PATH, tty:PATH@BITRATE or tcp:HOST:PORT; a path alone is a tty.
    """


@app.command("info", epilog=examples_of(EXAMPLES, "info"))
@click.argument("address")
@settings_option
@json_option
def info_command(address: str, settings: tuple[str, ...], as_json: bool) -> None:
    """Read model and state of a sensor: VV, PP and II, each read twice. Accepts any model.

    Exit codes of all commands: 0 done, 69 the sensor cannot be reached, is in use, may not be used or is no Hokuyo,
    78 a setting or the address is wrong, or the sensor is another model, 130 Ctrl-C before the sensor answered.
    """

    from onboard.bringup.lidar.report import model_words

    def tell(shell: LidarShell) -> None:
        info, session = shell.session.info, shell.session
        if as_json:
            print(json.dumps({"info": info, "request": session.request.line().decode()}))
            return
        if words := model_words(info):
            print(words)
        for key, text in info.items():
            print(f"{key}  {text}")
        print(f"asked with {session.request.line().decode()}: {session.request.beams} beams")

    _with_sensor(_config(address, ("lidar.model=", *settings)), tell)


@app.command("watch", epilog=examples_of(EXAMPLES, "watch"))
@click.argument("address")
@settings_option
@json_option
@seconds_option(0.0)
@click.option("--polar", is_flag=True, help="Draw the scan from above.")
@click.option("--reach", type=click.FloatRange(0.1, 100), default=8.0, help="Metres to the plot's edge.")
def watch_command(
    address: str, settings: tuple[str, ...], as_json: bool, seconds: float, polar: bool, reach: float
) -> None:
    """Show a live scan: rate, range ahead, nearest return, clock; one line a second if the output is no terminal.

    Exit code 69 also if the sensor is gone at the end; else those of `info`.
    """
    from onboard.bringup.lidar.live import Screen
    from onboard.bringup.lidar.shell import SensorError

    def look(shell: LidarShell) -> None:
        with Screen(polar, reach, as_json) as screen:
            for scans in shell.stream(seconds):
                screen.show(shell.session, scans, shell.now_ns, shell.trouble)
        if shell.trouble:
            raise SensorError(f"{shell.port.address} is {shell.trouble.partition(';')[0]}")

    _with_sensor(_config(address, settings), look)


@app.command("record", epilog=examples_of(EXAMPLES, "record"))
@click.argument("address")
@click.option("--out", "-o", type=Path, required=True, help="MCAP file to write.")
@settings_option
@json_option
@seconds_option(0.0)
@click.option("--scans", type=click.IntRange(min=0), default=0, help="End after so many scans; 0: no limit.")
@click.option("--force", is_flag=True, help="Write over a file that is there.")
def record_command(
    address: str, out: Path, settings: tuple[str, ...], as_json: bool, seconds: float, scans: int, force: bool
) -> None:
    """Record every byte of both directions with its time, so that `replay` repeats the session bit by bit.

    Exit codes: 73 no place to write, or the file exists already; 74 the disk took only a part; else those of `info`.
    """
    from onboard.record.incomplete import unwritten
    from onboard.record.writer import Recorder

    config = _config(address, settings)
    part = out.with_name(out.name + ".part")  # an existing file is not lost if the sensor is absent
    config = replace(config, record=replace(config.record, path=str(part)))
    if not out.parent.is_dir():  # the recorder of a run would create it
        raise fail(EX_CANTCREAT, f"{out} cannot be written: {out.parent} is no folder")
    if out.exists() and not force:
        raise fail(EX_CANTCREAT, f"{out} is there already; --force writes over it")
    recorder = Recorder(config, None)
    if problem := unwritten(recorder):
        recorder.close()
        part.unlink(missing_ok=True)
        raise fail(EX_CANTCREAT, f"{out} cannot be written: {problem}")

    def take(shell: LidarShell) -> int:
        return sum(len(found) for found in shell.stream(seconds, scans))

    try:
        with recorder:
            taken = _with_sensor(config, take, recorder)
    except Exit:
        part.unlink()  # there was no sensor to record
        raise
    if problem := unwritten(recorder):
        raise fail(EX_IOERR, f"{out} is not whole: {problem}; what the disk took is in {part}")
    part.replace(out)
    told = {"file": str(out), "bytes": out.stat().st_size, "scans": taken}
    print(json.dumps(told) if as_json else f"{out}: {told['scans']} scans, {told['bytes']} bytes")


@app.command("replay", epilog=examples_of(EXAMPLES, "replay"))
@click.argument("record", type=Path)
@json_option
def replay_command(record: Path, as_json: bool) -> None:
    """Run the driver on a record and compare every byte that it sends: `identical`, or the first difference.

    Exit codes: 0 identical, 1 different, 65 the record is damaged, 66 no such file.
    """
    from onboard.bringup.lidar.again import replay
    from onboard.record.replay_command import print_verdict

    raise Exit(print_verdict(record, as_json, replay))


@app.command("check", epilog=examples_of(EXAMPLES, "check"))
@click.argument("source")
@settings_option
@json_option
@seconds_option(12.0)
def check_command(source: str, settings: tuple[str, ...], as_json: bool, seconds: float) -> None:
    """Check the health of a sensor: checksums, gaps, clock, error codes, its own state; name likely causes of problems.

    SOURCE: a sensor's address, a record (.mcap) or a hokuyoaist log (.logr).

    Exit code 1: something is wrong, 65: the file is damaged or no record; else those of `info`.
    """
    from onboard.bringup.lidar.report import Report, ScanSums, findings
    from onboard.bringup.lidar.show import lines_of

    def measure(shell: LidarShell) -> Report:
        tally, session = ScanSums(), shell.session
        for scans in shell.stream(seconds):
            tally.add(scans)
        return Report(dict(session.counts), session.clock.quality, tally, session.info)

    path = Path(source)
    if path.suffix in (".mcap", ".logr", ".logw"):
        report = _from_file(path)
    elif path.is_file():
        raise fail(EX_DATAERR, f"{source} is no record: check reads .mcap and .logr, or a sensor by its address")
    else:
        report = _with_sensor(_config(source, settings), measure)
    print(json.dumps(report.as_dict()) if as_json else "\n".join(lines_of(report)))
    if findings(report):
        raise Exit(EX_UNHEALTHY)


@app.command("scan", epilog=examples_of(EXAMPLES, "scan"))
@click.argument("record", type=Path)
@click.option("--out", "-o", type=Path, required=True, help="Where the scan goes: .ply, .npz or .mcap.")
@click.option("--sweep", type=click.IntRange(min=0), default=1, help="Which, from 1; 0: all of them, into a .mcap.")
@json_option
def scan_command(record: Path, out: Path, sweep: int, as_json: bool) -> None:
    """Write a 3D scan of a run's record, each beam with its time and tilt: cloud (.ply), image (.npz), both (.mcap).

    Points are in the rover's frame base_link: metres, x ahead, y left, z up.

    Exit codes: 0 done, 64 no such format, 65 the record is damaged or has no such sweep, 66 no such file, 73 no place
    to write.
    """
    from onboard.bringup.lidar.again import config_of
    from onboard.bringup.lidar.sweeps import sweeps_of
    from onboard.bringup.maps.scan_export import FORMATS, write_record

    write = FORMATS.get(out.suffix[1:])
    if write is None or (sweep == 0 and out.suffix != ".mcap"):
        raise fail(EX_USAGE, f"{out}: a name should end in .ply, .npz or .mcap; all sweeps go into a .mcap only")
    try:
        config = config_of(record)
        found, known = [], 0
        for known, scan in enumerate(islice(sweeps_of(record, config), sweep or None), 1):
            found += [scan] if sweep in (0, known) else []
    except FileNotFoundError:
        raise fail(EX_NOINPUT, f"no record {record}") from None
    except ValueError as error:
        raise fail(EX_DATAERR, f"{record} is damaged: {error}") from None
    if not found:
        asked = f", none is number {sweep}" if known else ""
        raise fail(EX_DATAERR, f"{record} holds {known or 'no'} sweeps{asked}")
    try:
        if sweep:
            write(found[0], config.rover, out)
        else:
            write_record(found, config.rover, out)
    except OSError as error:
        raise fail(EX_CANTCREAT, f"{out} cannot be written: {error.strerror}") from None
    rows = [(*scan.pixels.shape, int(scan.valid.sum())) for scan in found]
    if as_json:
        sweeps = [{"lines": lines, "beams": beams, "points": count} for lines, beams, count in rows]
        print(json.dumps({"file": str(out), "sweeps": sweeps}))
    else:
        print(f"{out}: " + "; ".join(f"{lines} lines of {beams} beams, {count} points" for lines, beams, count in rows))


app.add_command(lag_command)


def _from_file(path: Path) -> Report:
    from onboard.bringup.lidar.listener import Listener, chunks_of
    from onboard.bringup.lidar.report import Report, ScanSums
    from onboard.config import Lidar

    tally, listener = ScanSums(), Listener(Lidar())
    try:
        for chunk in chunks_of(path):
            tally.add(listener.receive(chunk))
    except OSError as error:
        raise fail(EX_NOINPUT, f"{path} cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise fail(EX_DATAERR, f"{path} is damaged: {error}") from None
    return Report(listener.counts, listener.quality, tally, listener.info)


def _with_sensor(config: Config, use: Callable[[LidarShell], T], recorder: Recorder | None = None) -> T:
    """Result of `use` with a sensor that has identified itself; exits with one line if it has not, or after Ctrl-C."""
    from onboard.bringup.lidar.shell import LidarShell, SensorError
    from onboard.config import ConfigError
    from onboard.drivers.platform.clock import WallClock

    clock = WallClock()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: setattr(clock, "stopping", True))
    try:
        with LidarShell(config, clock, recorder) as shell:
            if not shell.until_ready():
                raise fail(EX_INTERRUPTED, "ended before the sensor answered")
            return use(shell)
    except ConfigError as error:
        raise fail(EX_CONFIG, str(error)) from None
    except SensorError as error:
        raise fail(EX_CONFIG if error.wrong_model else EX_UNAVAILABLE, str(error)) from None


def _config(address: str, settings: tuple[str, ...]) -> Config:
    from onboard.config import ConfigError, load, parse_override

    try:
        return load(None, {**dict(parse_override(text) for text in settings), "lidar.address": address_of(address)})
    except ConfigError as error:
        raise fail(EX_CONFIG, str(error)) from None
