"""`onboard lidar lag`: lag of the scanner's times, from sweeps down and up, live or from a record."""

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
from onboard.bringup.lidar.address import address_of
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
    from onboard.bringup.lidar.lag_sweeps import LagSweeps
    from onboard.config import Config
    from onboard.perception.scan.scan3d import Scan3d

MOST_LATENCY_NS = 100_000_000  # largest value of the key
THOUGHT_TICKS, HUSH_TICKS = 20, 50
EXAMPLES = """\b
Examples:
  onboard lidar lag --config rover.toml
  onboard lidar lag tty:/dev/ttyACM0 --bus socketcan:can0 --record lag.mcap
  onboard lidar lag lag.mcap --json
  onboard lidar lag calibrate.mcap
"""


@click.command("lag", epilog=EXAMPLES)
@click.argument("source", required=False, default="")
@click.option("--config", "-c", "path", type=Path, metavar="FILE", help="The rover's TOML: ports, mounting, latency.")
@click.option("--set", "-s", "settings", multiple=True, help="section.key=value, over the file; repeatable.")
@click.option("--bus", "uri", metavar="URI", help=f"Of the tilt axis, instead of can.uri: {URI_HELP}")
@click.option("--yes", is_flag=True, help="Do not ask before the axis moves.")
@click.option(
    "--record", type=Path, metavar="FILE", default=Path("lag.mcap"), show_default=True, help="Where to keep the sweeps."
)
@json_option
def lag_command(
    source: str, path: Path | None, settings: tuple[str, ...], uri: str | None, yes: bool, record: Path, as_json: bool
) -> None:
    """Measure the lag of the scanner's times, and the value of lidar.latency_ns to set. THE TILT AXIS MOVES.

    SOURCE: a sensor's address (default: lidar.address), whose axis is then swept down and up, fast and slowly, for
    three quarters of a minute; or a record (.mcap) with sweeps down and up from one place, as this command and
    `onboard calibrate` make it (a mission sweeps one way only). The rover must stand, with bare ground 1 to 8 m ahead.

    Exit codes: 0 done, 1 the sweeps ended early, 64 an option is wrong, 65 the record or the sweeps lack the needed
    data, 66 no such file, 69 refused or no port, 73 a file cannot be written, 78 something wrong in the
    configuration, 130 Ctrl-C.
    """
    from onboard.bringup.lidar.lag_report import LagReport
    from onboard.perception.scan.tilt_lag import lag

    if Path(source).suffix == ".mcap":
        if path or settings or uri:
            raise fail(EX_USAGE, "--config, --set and --bus are for a sensor: a record has its own configuration")
        name, (config, sweeps) = source, _recorded(Path(source))
    else:
        config = _address(read_config(path, settings), source, uri, record)
        name, sweeps = str(record), _swept(config, yes, record)
    try:
        found = LagReport(lag(sweeps, config.rover), config.lidar.latency_ns)
    except ValueError as error:
        raise fail(EX_DATAERR, f"{name}: {error}{_advice(str(error))}") from None
    if not 0 <= found.latency_ns <= MOST_LATENCY_NS:
        raise fail(
            EX_DATAERR,
            f"{name}: a lag of {found.lag.late_s * 1e3:+.1f} ms makes lidar.latency_ns "
            f"{found.latency_ns}, out of 0 to {MOST_LATENCY_NS}: did something move?",
        )
    print(json.dumps(found.as_dict()) if as_json else "\n".join(found.lines()))


def _advice(problem: str) -> str:
    if "same way" in problem or "no sweep" in problem:
        return ". `onboard lidar lag ADDRESS --bus URI` and `onboard calibrate` take sweeps both ways"
    return ". Stand where bare ground is seen from 1 to 8 m ahead" if "too few" in problem else ""


def _recorded(path: Path) -> tuple[Config, list[Scan3d]]:
    from onboard.bringup.lidar.again import config_of
    from onboard.bringup.lidar.sweeps import recorded_sweeps, standing

    try:
        config = config_of(path)
        return config, standing(recorded_sweeps(path, config))
    except FileNotFoundError:
        raise fail(EX_NOINPUT, f"no record {path}") from None
    except (IsADirectoryError, PermissionError) as error:
        raise fail(EX_NOINPUT, f"{path}: {error.strerror}") from None
    except ValueError as error:
        raise fail(EX_DATAERR, f"{path} is damaged: {error}") from None


def _address(config: Config, address: str, uri: str | None, record: Path) -> Config:

    lidar = replace(config.lidar, address=address_of(address)) if address else config.lidar
    return replace(
        config,
        lidar=lidar,
        can=replace(config.can, uri=uri or config.can.uri),
        record=replace(config.record, path=str(record)),
    )


def _swept(config: Config, yes: bool, record: Path) -> list[Scan3d]:
    from onboard.bringup.lidar.lag_sweeps import LagSweeps
    from onboard.perception.scan.scan3d import gather

    if record.exists():
        raise fail(EX_CANTCREAT, f"{record} is there already: name another by --record")
    try:
        machine = LagSweeps(config)
    except ValueError as error:
        raise fail(EX_USAGE, str(error)) from None
    try:
        _run(machine, config, yes)
    finally:
        if not machine.agreed:
            record.unlink(missing_ok=True)
    if machine.problem:
        raise fail(EX_UNHEALTHY, f"{machine.problem}; what was swept is in {record}")
    if machine.stopped:
        raise fail(EX_INTERRUPTED, f"stopped by Ctrl-C; what was swept is in {record}")
    return [gather(sweep.scans, sweep.tilt) for sweep in machine.sweeps]


def _run(machine: LagSweeps, config: Config, yes: bool) -> None:
    """Run the machine from listening to the laser off."""
    from onboard.bringup.calibrate.ports import ports
    from onboard.bringup.can.moving.jog import Phase

    with ports(config) as shell:
        ready = shell.until(machine, Phase.READY, lambda _: None)
        if ready and not (yes or agreed(f"The tilt axis will sweep {len(machine.nods)} times. All hands away?")):
            ready = False
        elif ready:
            shell.linger(machine, THOUGHT_TICKS)
        if machine.problem:
            raise fail(EX_UNAVAILABLE, f"refused, nothing was sent: {machine.problem}")
        if not ready:
            raise fail(EX_INTERRUPTED, "ended before anything moved")
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda *_: machine.stop())
        machine.go(shell.clock.now_ns())
        shell.until(machine, Phase.DONE, _teller())
        shell.linger(machine, HUSH_TICKS)


def _teller() -> Callable[[LagSweeps], None]:
    told = [-1]

    def tell(machine: LagSweeps) -> None:
        if machine.complete or machine.at == told[0]:
            return
        told[0] = machine.at
        way = "down" if machine.nods[machine.at].rate_radps > 0 else "up"
        print(f"sweep {machine.at + 1} of {len(machine.nods)}: {way}", file=sys.stderr, flush=True)

    return tell
