"""The command `onboard`: run the flight program, show its configuration, replay a record, import and export maps.

By click alone: typer loads pydantic to read a command line, a fifth of a start. A command is loaded when it is called
or listed: a start of `run` loads no other.
"""

from __future__ import annotations

from onboard import quiet_start  # first, before what takes long to load

# isort: split
import faulthandler
import gc
import sys
from pathlib import Path
from pkgutil import resolve_name
from types import MappingProxyType

import click
from click.exceptions import Exit

from onboard.command_line import (
    EX_CONFIG,
    EX_DATAERR,
    EX_INTERRUPTED,
    EX_NOINPUT,
    EX_SOFTWARE,
    EX_UNAVAILABLE,
    EX_USAGE,
    fail,
    read_config,
)
from onboard.config import ConfigError
from onboard.config_text import to_toml
from onboard.journal import say, say_error, to_journal

COMMANDS = MappingProxyType({
    "gdem": "onboard.bringup.maps.gdem_command:app", "map": "onboard.bringup.maps.map_command:app",
    "lidar": "onboard.bringup.lidar.command:app", "guard": "onboard.bus_guard.command:app",
    "can": "onboard.bringup.can.moving.jog_command:app", "calibrate": "onboard.bringup.calibrate.command:calibrate",
    "record": "onboard.bringup.records.record_command:app", "replay": "onboard.record.replay_command:replay",
    "status": "onboard.status.command:status", "jitter": "onboard.bringup.jitter.command:jitter",
})  # fmt: skip


class Commands(click.Group):
    """The commands of this file and of COMMANDS. Ctrl-C in one that does not handle it is reported in one line."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """See click.Group."""
        return sorted({*super().list_commands(ctx), *COMMANDS})

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """See click.Group."""
        if cmd_name not in COMMANDS:
            return super().get_command(ctx, cmd_name)
        command: click.Command = resolve_name(COMMANDS[cmd_name])
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """See click.Group. The error for an unknown command names the one most like it."""
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError as error:
            from difflib import get_close_matches  # needed only after a typing error

            near = get_close_matches(args[0], self.list_commands(ctx), 1)
            if not near:
                raise
            raise click.UsageError(f"{error.message} Did you mean '{near[0]}'?", ctx) from None

    def invoke(self, ctx: click.Context) -> object:
        """Run click.Group.invoke; raise exit code 130 at Ctrl-C."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            raise fail(EX_INTERRUPTED, "ended by Ctrl-C") from None


@click.group(cls=Commands)
@click.version_option(package_name="el-dorado", prog_name="onboard", message="%(prog)s %(version)s")
def app() -> None:
    """Flight program of a four-wheel-steered rover.

    \b
    Examples:
      onboard run --config rover.toml
      onboard run --print-config > rover.toml
      onboard status --watch
      onboard jitter --seconds 60
      onboard replay build/demo/onboard.mcap
      onboard record info build/demo/onboard.mcap
      onboard gdem import LDEM.tif --start-lonlat -45.3 -85.1
      onboard map export map/ --out site.tif
      onboard lidar check tty:/dev/ttyACM0
      onboard can info --bus socketcan:can0
      onboard calibrate --config rover.toml --out calibrated.toml
    """


@app.command()
@click.option("--config", "-c", type=Path, metavar="FILE", help="TOML file; without it the defaults.")
@click.option("--set", "-s", "settings", multiple=True, help="section.key=value, over the file; repeatable.")
@click.option("--print-config", is_flag=True, help="Print the whole configuration as TOML and exit.")
def run(config: Path | None, settings: tuple[str, ...], print_config: bool) -> None:
    """Fly the rover until SIGTERM, Ctrl-C or the bench ends the run.

    Exit codes: 0 ended as asked, 65 a damaged orbiter's map, 66 no such file, 69 a port or the state folder cannot be
    opened, 70 a job has failed, 75 ended by `reboot`, to be started again, 78 something wrong in the configuration.
    """
    tree = read_config(config, settings)
    if print_config:
        print(to_toml(tree), end="")
        return
    gc.disable()  # until all is loaded: loading drops little, and collecting would take a tenth of its time
    from onboard.app import NoMapError
    from onboard.app import run as fly  # the drivers are heavy: not for --help and --print-config
    from onboard.drivers.link.port import LinkPortError
    from onboard.drivers.platform.clock import ClockLostError
    from onboard.drivers.platform.workers import JobError

    try:
        raise Exit(fly(tree, say))
    except JobError as error:
        say_error(type(error), error, error.__traceback__)
        raise fail(EX_SOFTWARE, f"{error}; the rover was stopped and the record closed") from None
    except NoMapError as error:
        raise fail(EX_DATAERR if error.damaged else EX_NOINPUT, str(error)) from None
    except ConfigError as error:
        raise fail(EX_CONFIG, str(error)) from None
    except (ClockLostError, LinkPortError, OSError) as error:
        raise fail(EX_UNAVAILABLE, str(error)) from None


def main() -> None:
    """Entry point."""
    quiet_start.loaded()
    if sys.stderr:
        faulthandler.enable()  # if a watchdog ends a hung tick (SIGABRT), the traceback shows the place
    if to_journal():
        sys.excepthook = say_error
    try:
        app(prog_name="onboard")
    except SystemExit as ended:  # click ends an unknown option or a missing argument with 2, not as sysexits.h
        raise SystemExit(EX_USAGE if ended.code == 2 else ended.code) from None


if __name__ == "__main__":
    main()
