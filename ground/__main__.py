"""The command `ground`: parse the line, call the verb, print. Each kind of end has an exit code of sysexits.h.

0 done, 1 the rover reported a failure or a command was cancelled, 64 usage, 66 no station or script file,
69 no link or no rover, or the link's carrier closed, 73 cannot write a file, 75 not finished in time,
78 wrong settings or keys, 130 ended by Ctrl-C.

All verbs are listed here, in the order of `--help`; their code is in `cli`, `gateway`,
`ccsds` and `page`.
"""

from __future__ import annotations

from onboard import quiet_start  # first, before what takes long to load

# isort: split
import signal
import sqlite3
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Annotated

import typer

from ground.archive.schema import ArchiveError
from ground.ccsds.command import app as bridge_app
from ground.cli.operations.operate import FAILED, ByHandError, Teller
from ground.cli.operations.script import ScriptError
from ground.cli.verbs import archive, contacts, keys, preview, table
from ground.cli.verbs import commands as own
from ground.cli.verbs import history as look
from ground.cli.verbs.report import report_command
from ground.cli.verbs.run_verb import ask, carry_out, last_words, leave, plan_of
from ground.cli.verbs.screen import line_beside, line_out
from ground.cli.verbs.table import Contact, StationFile
from ground.cli.watch.command import EXAMPLES as WATCH_EXAMPLES
from ground.cli.watch.command import watch_command
from ground.gateway.command import gateway_command
from ground.page.command import EXAMPLES, serve_command
from ground.station.clock import ClockError
from ground.station.settings import NoStationError, load_settings
from ground.station.station import StationError
from onboard.config import ConfigError
from protocol import WireError
from protocol.tables import commands

USAGE, NO_INPUT, UNAVAILABLE, CANNOT_CREATE, CONFIG, INTERRUPTED = 64, 66, 69, 73, 78, 130

_CODES: tuple[tuple[type[Exception], int], ...] = (
    (ScriptError, USAGE),
    (NoStationError, NO_INPUT),
    (StationError, UNAVAILABLE),
    (ClockError, UNAVAILABLE),
    (ConfigError, CONFIG),
    (WireError, FAILED),
    (OSError, CANNOT_CREATE),
    (sqlite3.Error, CANNOT_CREATE),
    (ArchiveError, CANNOT_CREATE),
    (ByHandError, INTERRUPTED),
)

app = typer.Typer(
    help="Fly the rover over the space link.\n\nStart with `ground status`, then `ground goto 12 3`.",
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def _show_version(asked: bool) -> None:
    if asked:
        line_out(f"ground {version('el-dorado')}")
        raise typer.Exit


@app.callback()
def options(
    shown: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Take the options that stand before a verb."""


_OWN = {"goto", "status", "get", "keys_rotate"}


def _rotate(epoch: int, timeout_s: float, contact_s: float, station: Path | None, as_json: bool) -> None:
    leave(*ask(station, plan_of(["keys", "rotate", str(epoch)], contact_s, timeout_s), as_json))


def shell(contact: Contact = 20.0, station: StationFile = None) -> None:
    """Type commands one after the other in one open session, with history and completion; `help` there lists them."""
    from ground.cli.shell import terminal

    settings = load_settings(station)
    teller = Teller(line_out, False, settings.report_s)
    raise typer.Exit(terminal.run(settings, station, contact, teller, run, own.save_product))


app.command(
    context_settings={"ignore_unknown_options": True},
    epilog="A goto replaces one that runs: that is cancelled and the rover plans again from where it stands.\n\n"
    "Examples: ground goto 12 3 | ground goto -4 0.5 --heading 90",
)(own.goto)
_families = table.add(app, [row for row in commands.TABLE if row.name not in _OWN], carry_out)
app.add_typer(keys.app(_rotate), name="keys")
contacts.add(_families["contacts"], lambda plan, station, as_json: leave(*ask(station, plan, as_json)), line_out)
app.command(epilog="Examples: ground status | ground status --all | ground status --json")(own.status)
app.command(epilog="Examples: ground get ldem | ground get scan --out cloud.ply | ground get record 120 130 slim")(
    own.get
)
app.command("watch", epilog=WATCH_EXAMPLES)(watch_command)
app.command(epilog="Examples: ground script mission.txt | echo 'goto 12 3' | ground script -")(own.script)
app.add_typer(bridge_app, name="bridge")
app.command(epilog="Examples: ground shell | echo 'goto 2 0' | ground shell")(shell)
app.command(epilog="Example: ground calibrate")(own.calibrate)
look.add(app)
app.add_typer(archive.app, name="archive")
app.add_typer(preview.app, name="preview")
app.command(
    "gateway",
    epilog="Examples: ground gateway | ground gateway --origin 38.2547,140.8394,150\n\n"
    "Then: mavproxy.py --master=udpout:127.0.0.1:14551, or QGroundControl as it is.",
)(gateway_command)
app.command("serve", epilog=EXAMPLES)(serve_command)
app.command("report", epilog="Example: ground report build/demo")(report_command)

_INTERRUPTED = "interrupted"  # before any request; after one, `operate` reports what the rover goes on with


def run(argv: list[str] | None = None) -> int:
    """Run the command line and return its exit code. An error of the user is one line on stderr, never a traceback."""
    try:
        words = sys.argv[1:] if argv is None else argv
        command = typer.main.get_command(app)
        code = int(command.main(words or ["--help"], prog_name="ground", standalone_mode=False) or 0)
    except typer.TyperException as error:
        code, context = USAGE, getattr(error, "ctx", None)
        message = getattr(error, "format_message", error.__str__)()
        if not message:
            return code  # a family of verbs alone: its help was shown
        if type(error).__name__ == "NoArgsIsHelpError":  # likewise, and the message is the help
            line_beside(message)
            return code
        path = context.command_path if context else "ground"
        text = f"{message} (see `{path} --help`)"
    except (KeyboardInterrupt, typer.Abort):
        code, text = INTERRUPTED, _INTERRUPTED
    except tuple(kind for kind, _ in _CODES) as error:
        unwritten = getattr(error, "__notes__", [])  # archive rows that are lost by this error
        code, text = next(code for kind, code in _CODES if isinstance(error, kind)), "; ".join([str(error), *unwritten])
        code = error.code if isinstance(error, ArchiveError) else CANNOT_CREATE if unwritten else code
    else:
        if code != INTERRUPTED:
            return code
        text = _INTERRUPTED
    last_words(text)
    return code


def main() -> None:
    """Entry point. SIGTERM closes the session as Ctrl-C does."""
    quiet_start.loaded()
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    sys.exit(run())


if __name__ == "__main__":
    main()
