"""The command `onboard`: run the flight program, show its configuration, replay a record, bring maps in and out."""

from __future__ import annotations

import gc
import sys
from pathlib import Path
from typing import Annotated, Optional

import typer

from onboard.config import Config, ConfigError, load, parse_override, to_toml
from onboard.maps import gdem_command, map_command

EX_NOINPUT, EX_UNAVAILABLE, EX_CONFIG = 66, 69, 78

app = typer.Typer(
    no_args_is_help=True, add_completion=True, pretty_exceptions_enable=False,
    help="Flight program of a four-wheel-steered rover.\n\nExamples:\n\n"
    "  onboard run --config rover.toml\n\n  onboard run --print-config > rover.toml\n\n"
    "  onboard replay build/demo/onboard.mcap\n\n  onboard gdem import LDEM.tif --start-lonlat -45.3 -85.1\n\n"
    "  onboard map export map/ --out site.tif",
)
app.add_typer(gdem_command.app, name="gdem")
app.add_typer(map_command.app, name="map")


def fail(code: int, text: str) -> typer.Exit:
    """One helpful line on standard error, and the exit code."""
    print(f"onboard: {text}", file=sys.stderr)
    return typer.Exit(code)


def read_config(path: Path | None, settings: list[str]) -> Config:
    """The configuration, or exit 66 (no such file) or 78 (something wrong in it)."""
    try:
        return load(path, dict(parse_override(text) for text in settings))
    except FileNotFoundError:
        hint = f"`onboard run --print-config > {path}` makes one"
        raise fail(EX_NOINPUT, f"no configuration file {path}; {hint}") from None
    except IsADirectoryError:
        raise fail(EX_NOINPUT, f"{path} is a folder, not a configuration file") from None
    except PermissionError:
        raise fail(EX_NOINPUT, f"{path} may not be read by this user") from None
    except ConfigError as error:
        raise fail(EX_CONFIG, str(error)) from None


ConfigOption = Annotated[Optional[Path], typer.Option("--config", "-c", help="TOML file; without it the defaults.")]
SetOption = Annotated[list[str], typer.Option("--set", "-s", help="section.key=value, over the file; repeatable.")]


@app.command()
def run(
    config: ConfigOption = None,
    settings: SetOption = [],
    print_config: Annotated[bool, typer.Option(help="Print the whole configuration as TOML and exit.")] = False,
) -> None:
    """Fly the rover until SIGTERM, Ctrl-C or the bench ends the run.

    Exit codes: 0 ended as asked, 66 no such file, 69 a port cannot be opened, 78 something wrong in the configuration.
    """
    tree = read_config(config, settings)
    if print_config:
        print(to_toml(tree), end="")
        return
    gc.disable()  # until all is loaded: loading makes much and drops little, and a tenth of it would be collecting
    from onboard.app import run as fly  # the drivers are heavy: not for --help and --print-config
    from onboard.drivers.clock import ClockLostError
    from onboard.drivers.link_port import LinkPortError

    try:
        raise typer.Exit(fly(tree, lambda text: print(f"onboard: {text}", file=sys.stderr, flush=True)))
    except ConfigError as error:
        raise fail(EX_CONFIG, str(error)) from None
    except (ClockLostError, LinkPortError, OSError) as error:
        raise fail(EX_UNAVAILABLE, str(error)) from None


@app.command()
def replay(
    record: Annotated[Path, typer.Argument(help="MCAP file of a run.")],
    json: Annotated[bool, typer.Option("--json", help="The verdict as JSON.")] = False,
) -> None:
    """Run the same core on a record's inputs and compare every output: `identical`, or the first difference.

    Exit codes: 0 identical, 1 different, 65 the record is damaged, 66 no such file.
    """
    from onboard.record.replay import replay_command

    raise typer.Exit(replay_command(record, json))


def main() -> None:
    """Entry point."""
    app()


if __name__ == "__main__":
    main()
