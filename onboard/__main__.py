"""The command `onboard`: run the flight program, show its configuration, replay a record, import and export maps.

It uses click alone: typer loads pydantic to read a command line, which takes a fifth of a start.
"""

from __future__ import annotations

import faulthandler
import gc
import sys
from pathlib import Path

import click
from click.exceptions import Exit

from onboard.bus_guard import command as guard_command
from onboard.calibrate import command as calibrate_command
from onboard.can_tool import command as can_command
from onboard.can_tool import jog_command
from onboard.command_line import (
    EX_CONFIG,
    EX_DATAERR,
    EX_INTERRUPTED,
    EX_NOINPUT,
    EX_SOFTWARE,
    EX_UNAVAILABLE,
    fail,
    read_config,
)
from onboard.config import ConfigError
from onboard.config_text import to_toml
from onboard.jitter.command import jitter
from onboard.journal import say, say_error, to_journal
from onboard.lidar_tool import command as lidar_command
from onboard.maps import gdem_command, map_command
from onboard.record import record_command
from onboard.record.replay_command import replay
from onboard.status.command import status


class Commands(click.Group):
    """Command group that reports Ctrl-C in one line, if the command does not handle it itself."""

    def invoke(self, ctx: click.Context) -> object:
        """Run click.Group.invoke; raise exit code 130 at Ctrl-C."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            raise fail(EX_INTERRUPTED, "ended by Ctrl-C") from None


@click.group(cls=Commands)
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


app.add_command(gdem_command.app)
app.add_command(map_command.app)
app.add_command(lidar_command.app)
app.add_command(guard_command.app)
app.add_command(can_command.app)
app.add_command(calibrate_command.calibrate)
app.add_command(record_command.app)
app.add_command(replay)
app.add_command(status)
app.add_command(jitter)
can_command.app.add_command(jog_command.jog)
can_command.app.add_command(jog_command.home)
can_command.app.add_command(jog_command.reset)


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
    from onboard.drivers.clock import ClockLostError
    from onboard.drivers.link_port import LinkPortError
    from onboard.drivers.workers import JobError

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
    if sys.stderr:
        faulthandler.enable()  # if a watchdog ends a hung tick (SIGABRT), the traceback shows the place
    if to_journal():
        sys.excepthook = say_error
    app(prog_name="onboard")


if __name__ == "__main__":
    main()
