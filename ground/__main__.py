"""The ground command: parse, call, print; every way it can end has an exit code of sysexits.h.

0 done, 1 the rover reported a failure or a command was cancelled, 64 usage, 66 no station or script file,
69 no link or no rover, or the link's carrier closed, 73 cannot write a file, 75 not finished in time,
78 wrong settings or keys, 130 ended by Ctrl-C.
"""

from __future__ import annotations

import json
import signal
import sqlite3
import sys
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer

from ground.archive.store import ArchiveError
from ground.bridge.command import app as bridge_app
from ground.gateway.command import gateway_command
from ground.operation import show
from ground.operation.operate import FAILED, TEMPORARY, Plan, Teller, operate
from ground.operation.script import ScriptError, Step, parse
from ground.products import files as products
from ground.session.schedule import utc_ns
from ground.session.session import Session
from ground.station.clock import ClockError
from ground.station.settings import NoStationError, load_settings
from ground.station.station import StationError
from ground.verbs import archive, contacts, keys, look, preview, table
from ground.verbs.report import report_command
from ground.verbs.table import Contact, Json, Start, StationFile, Timeout
from onboard.config import ConfigError
from protocol import WireError, commands
from protocol.barrier import parse_address
from protocol.transactions import Code, State

USAGE, NO_INPUT, UNAVAILABLE, CANNOT_CREATE, CONFIG, INTERRUPTED = 64, 66, 69, 73, 78, 130

_CODES: tuple[tuple[type[Exception], int], ...] = (
    (ScriptError, USAGE), (NoStationError, NO_INPUT), (StationError, UNAVAILABLE), (ClockError, UNAVAILABLE),
    (ConfigError, CONFIG), (WireError, FAILED), (OSError, CANNOT_CREATE), (sqlite3.Error, CANNOT_CREATE),
    (ArchiveError, CANNOT_CREATE),
)

app = typer.Typer(
    help="Fly the rover over the space link.\n\nStart with `ground status`, then `ground goto 12 3`.",
    add_completion=True, pretty_exceptions_enable=False,)


def _out(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def _run(station: Path | None, plan: Plan, as_json: bool) -> tuple[int, Session]:
    settings = load_settings(station)
    return operate(settings, plan, _teller(as_json, plan.report_s or settings.report_s))


def _teller(as_json: bool, report_s: float) -> Teller:
    """Bars in a terminal, lines elsewhere."""
    if as_json or not sys.stdout.isatty():
        return Teller(_out, as_json, report_s)
    from ground.operation.bars import Bars

    return Bars(_out, report_s)


def _leave(code: int, session: Session) -> NoReturn:
    """Ends the command; what did not succeed is told in one last line."""
    if code == TEMPORARY:
        _last_words(_unfinished(session))
    elif code == FAILED:
        _last_words(_failure(session))
    raise typer.Exit(code)


def _unfinished(session: Session) -> str:
    """What goes on where the station has no more time for it."""
    still = [r for r in session.requester.requests.values() if not r.state.final]
    if len(still) != 1 or still[0].telecommand.name != "lease_ask" or still[0].state != State.STARTED:
        return "not finished in time; the rover carries on"
    holder = session.items.get("lease_station")
    whom = f"station {holder.value:g}" if holder is not None and holder.value else "another station"
    return f"still waiting behind {whom}; it keeps its place"


def _failure(session: Session) -> str:
    """What the rover said of what did not succeed: cancelled, where nothing worse happened."""
    lost = [r for r in session.requester.requests.values() if r.state != State.COMPLETED]
    own = [r.report.text for r in lost if r.report is not None and r.report.code == Code.VERSION]
    if own:
        return own[0]
    if not lost or any(request.state != State.CANCELLED for request in lost):
        return "the rover reported a failure"
    report = lost[0].report
    return "the command was cancelled" + (f": {report.text}" if report is not None and report.text else "")


def _last_words(text: str) -> None:
    sys.stderr.write(f"ground: {text}\n")


def _start(word: str) -> tuple[float, int]:
    """Onboard time in s, or UTC in ns; the other one is 0."""
    try:
        if "T" in word:
            return 0.0, utc_ns(word)
        if (start_s := float(word)) >= 0.0:  # no NaN passes
            return start_s, 0
    except ValueError:
        pass
    raise typer.BadParameter(f"{word!r} should be seconds of onboard time or UTC like 2026-11-22T12:00:00Z",
                             param_hint="--start")


def _one(words: list[str], contact_s: float, timeout_s: float, lifetime_s: float = 60.0, start: str = "0") -> Plan:
    """The plan of a single command."""
    try:
        name, arguments = commands.parse(words)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None
    start_s, start_utc_ns = _start(start)
    step = Step(1, " ".join(words), "command", name, arguments, None, 0.0, start_s, start_utc_ns)
    return Plan((step,), contact_s=contact_s, limit_s=timeout_s, lifetime_s=lifetime_s)


@app.command(context_settings={"ignore_unknown_options": True},
             epilog="A goto replaces one that runs: that is cancelled and the rover plans anew from where it is.\n\n"
                    "Examples: ground goto 12 3 | ground goto -4 0.5 --heading 90")
def goto(
    x_m: Annotated[float, typer.Argument(metavar="X", help="East in the map frame, m.")],
    y_m: Annotated[float, typer.Argument(metavar="Y", help="North in the map frame, m.")],
    heading: Annotated[float | None, typer.Option(metavar="DEG", help="Final heading, degrees from east.")] = None,
    expires: Annotated[float, typer.Option(min=0, metavar="S", help="Not begun if it arrives later; 0: any.")] = 60.0,
    start: Start = "0",
    timeout: Timeout = 0.0,
    contact: Contact = 20.0,
    station: StationFile = None,
    as_json: Json = False,
) -> None:
    """Drive to a place by itself; ends when the rover reports the outcome."""
    words = ["goto", repr(x_m), repr(y_m)] + ([] if heading is None else [repr(heading)])
    _leave(*_run(station, _one(words, contact, timeout, expires, start), as_json))


def _verb(words: list[str], options: dict[str, Any]) -> None:
    """Carries out a verb that is made from the table."""
    plan = _one(words, options["contact"], options["timeout"], start=options["start"])
    code, session = _run(options["station"], plan, options["as_json"])
    sent = commands.command(plan.steps[0].name).sends
    for product in reversed(session.products.values()):
        if product.name == sent and code == 0:
            _out(product.data.decode().rstrip())
            break
    _leave(code, session)


def _rotate(epoch: int, timeout_s: float, contact_s: float, station: Path | None, as_json: bool) -> None:
    _leave(*_run(station, _one(["keys", "rotate", str(epoch)], contact_s, timeout_s), as_json))


_OWN = {"goto", "status", "get", "keys_rotate"}
_families = table.add(app, [row for row in commands.TABLE if row.name not in _OWN], _verb)
app.add_typer(keys.app(_rotate), name="keys")
contacts.add(_families["contacts"], lambda plan, station, as_json: _leave(*_run(station, plan, as_json)), _out)


@app.command(epilog="Examples: ground status | ground status --json")
def status(
    timeout: Timeout = 60.0, contact: Contact = 20.0, station: StationFile = None, as_json: Json = False
) -> None:
    """What the rover is doing, where it is, how the link is."""
    code, session = _run(station, _one(["status"], contact, timeout), as_json)
    known: dict[str, Any] = show.status(session, session.heard_ns or 0)
    if as_json:
        _out(json.dumps({"news": "status", **known}))
    else:
        for name, item in known["items"].items():
            _out(show.item_line(name, item))
        for name in ("rtt_s", "epoch", "versions", "contact", "clock"):
            words = "unknown" if known["link"][name] is None else known["link"][name]
            _out(f"{name:24} {words if isinstance(words, str) else f'{words:g}'}")
    _leave(code, session)


@app.command(epilog="Examples: ground get ldem | ground get scan --out cloud.ply | ground get record 120 130 slim")
def get(
    product: Annotated[str, typer.Argument(help="What to fetch: ldem, scan, nsp or record.",
                                            autocompletion=lambda: list(commands.command("get").arguments[0].choices))],
    from_s: Annotated[str | None, typer.Argument(metavar="FROM_S", help="Of the record: onboard time, s.")] = None,
    to_s: Annotated[str | None, typer.Argument(metavar="TO_S", help="Of the record: onboard time, s.")] = None,
    channels: Annotated[str | None, typer.Argument(help="Of the record: all or slim (a fifth of the bytes).")] = None,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Where to; its ending says how, see below.")] = None,
    timeout: Timeout = 600.0,
    contact: Contact = 20.0,
    station: StationFile = None,
    as_json: Json = False,
) -> None:
    """Fetch a product of the rover and write it to a file: the map around it (ldem, .npz), its newest scan (scan, .npz
    or .ply), why it goes where it goes (nsp, .json), a part of its record (record, .mcap); any of them .bin as sent."""
    words = ["get", product, *(word for word in (from_s, to_s, channels) if word is not None)]
    plan, path = _one(words, contact, timeout), out or Path(products.default_name(product))
    _checked_name(product, path)
    code, session = _run(station, plan, as_json)
    if code == 0:
        save_product(session, product, path, as_json)
    _leave(code, session)


def _checked_name(product: str, path: Path) -> None:
    try:
        products.check_name(product, path)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--out") from None


def save_product(session: Session, name: str, path: Path, as_json: bool = False) -> None:
    """Writes the newest product of a name and says what was written; with as_json as one more line of news."""
    found = next(p for p in reversed(session.products.values()) if p.name == name)
    holds = products.save(found, path)
    if as_json:
        _out(json.dumps({"news": "written", "file": str(path), "bytes": path.stat().st_size, "holds": holds}))
    sys.stderr.write(f"{path} written: {holds}\n")


@app.command(epilog="Example: ground watch")
def watch(contact: Contact = 0.0, station: StationFile = None, as_json: Json = False) -> None:
    """Show events and a status line each second until Ctrl-C."""
    _leave(*_run(station, Plan(contact_s=contact, report_s=1.0), as_json))


@app.command(epilog="Examples: ground script mission.txt | echo 'goto 12 3' | ground script -")
def script(
    file: Annotated[str, typer.Argument(metavar="FILE|-", help="Lines like `at 2.0: goto 12 3`, `wait goto`.")],
    barrier: Annotated[str, typer.Option(metavar="tcp:HOST:PORT", help="The bench owns time (lock-step).")] = "",
    timeout: Timeout = 0.0,
    out: Annotated[Path | None, typer.Option(metavar="FOLDER", help="Where products are written to.")] = None,
    station: StationFile = None,
    as_json: Json = False,
) -> None:
    """Run an operator's script: commands at exact times, waits, products; 0 when all of it succeeded."""
    if barrier:
        try:
            parse_address(barrier)
        except ValueError as error:
            raise typer.BadParameter(str(error), param_hint="--barrier") from None
    try:
        text = sys.stdin.read() if file == "-" else Path(file).read_text()
    except OSError as error:
        raise NoStationError(f"{file}: {error.strerror}") from error
    plan = Plan(tuple(parse(text, file)), barrier=barrier, limit_s=timeout, report_s=0.0)
    code, session = _run(station, plan, as_json)
    for product in session.products.values():
        if out is not None:
            save_product(session, product.name, out / products.default_name(product.name), as_json)
    _leave(code, session)


app.add_typer(bridge_app, name="bridge")


@app.command(epilog="Examples: ground shell | echo 'goto 2 0' | ground shell")
def shell(contact: Contact = 20.0, station: StationFile = None) -> None:
    """Type commands one after the other on one open session: history, completion; `help` there says what there is."""
    from ground.shell import terminal

    settings = load_settings(station)
    teller = Teller(_out, False, settings.report_s)
    raise typer.Exit(terminal.run(settings, station, contact, teller, run, save_product))


@app.command(epilog="Example: ground calibrate")
def calibrate() -> None:
    """Not on board: geometry is calibrated from records, by `onboard calibrate`, and takes effect with a restart."""
    _last_words("the rover takes no such command: `onboard calibrate` works on its records, see docs/calibration.md")
    raise typer.Exit(USAGE)


look.add(app)
app.add_typer(archive.app, name="archive")
app.add_typer(preview.app, name="preview")
app.command("gateway", epilog="Examples: ground gateway | ground gateway --origin 38.2547,140.8394,150\n\n"
            "Then: mavproxy.py --master=udpout:127.0.0.1:14551, or QGroundControl as it is.")(gateway_command)
app.command("report", epilog="Example: ground report build/demo")(report_command)

_INTERRUPTED = "interrupted; the rover carries on with what it was told, `ground stop` ends it"


def run(argv: list[str] | None = None) -> int:
    """The command line; returns the exit code. A user's mistake is one line on stderr, never a traceback."""
    try:
        words = sys.argv[1:] if argv is None else argv
        command = typer.main.get_command(app)
        code = int(command.main(words or ["--help"], prog_name="ground", standalone_mode=False) or 0)
    except typer.TyperException as error:
        code, context = USAGE, getattr(error, "ctx", None)
        message = getattr(error, "format_message", error.__str__)()
        if not message:
            return code  # a family of verbs alone: its help was shown
        path = context.command_path if context else "ground"
        text = f"{message} (see `{path} --help`)"
    except (KeyboardInterrupt, typer.Abort):
        code, text = INTERRUPTED, _INTERRUPTED
    except tuple(kind for kind, _ in _CODES) as error:
        code, text = next(code for kind, code in _CODES if isinstance(error, kind)), str(error)
        code = error.code if isinstance(error, ArchiveError) else code
    else:
        if code != INTERRUPTED:
            return code
        text = _INTERRUPTED
    _last_words(text)
    return code


def main() -> None:
    """Entry point; a termination closes the session as Ctrl-C does."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    sys.exit(run())


if __name__ == "__main__":
    main()
