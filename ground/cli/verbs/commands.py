"""Verbs with code of their own: drive, show the status, fetch a product, run a script."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from ground.cli.operations import show
from ground.cli.operations.operate import Plan
from ground.cli.operations.script import parse
from ground.cli.operations.status_words import status_lines
from ground.cli.verbs.options import USAGE
from ground.cli.verbs.run_verb import ask, last_words, leave, plan_of
from ground.cli.verbs.screen import line_beside, line_out
from ground.cli.verbs.table import Contact, Json, Start, StationFile, Timeout
from ground.link.session import Session
from ground.products import files
from ground.station.settings import NoStationError
from protocol.barrier import parse_address
from protocol.tables import commands


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
    """Drive to a place autonomously; ends when the rover reports the outcome."""
    words = ["goto", repr(x_m), repr(y_m)] + ([] if heading is None else [repr(heading)])
    leave(*ask(station, plan_of(words, contact, timeout, expires, start), as_json))


def status(
    every: Annotated[bool, typer.Option("--all", help="Every item of telemetry, and all of the link.")] = False,
    timeout: Timeout = 60.0,
    contact: Contact = 20.0,
    station: StationFile = None,
    as_json: Json = False,
) -> None:
    """Show what the rover does, its place, goal and power, and the link."""
    code, session = ask(station, plan_of(["status"], contact, timeout), as_json)
    known: dict[str, Any] = show.status(session, session.heard_ns or 0)
    if as_json:
        line_out(json.dumps({"news": "status", **known}))
    elif not every:
        for line in status_lines(known["items"], known["link"]):
            line_out(line)
    else:
        for name, item in known["items"].items():
            line_out(show.item_line(name, item))
        for name in ("rtt_s", "epoch", "versions", "contact", "clock"):
            words = "unknown" if known["link"][name] is None else known["link"][name]
            line_out(f"{name:24} {words if isinstance(words, str) else f'{words:g}'}")
    leave(code, session)


def get(
    product: Annotated[
        str,
        typer.Argument(
            help="What to fetch: ldem, height_std, scan, nsp or record.",
            autocompletion=lambda: list(commands.command("get").arguments[0].choices),
        ),
    ],
    from_s: Annotated[str | None, typer.Argument(metavar="FROM_S", help="Of the record: onboard time, s.")] = None,
    to_s: Annotated[str | None, typer.Argument(metavar="TO_S", help="Of the record: onboard time, s.")] = None,
    channels: Annotated[str | None, typer.Argument(help="Of the record: all or slim (a fifth of the bytes).")] = None,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Where to; its ending says how, see below.")] = None,
    timeout: Timeout = 600.0,
    contact: Contact = 20.0,
    station: StationFile = None,
    as_json: Json = False,
) -> None:
    """Fetch a product of the rover and write it to a file.

    Products: the map around it (ldem, .npz), the spread of the heights within its cells (height_std, .npz), its newest
        scan
    (scan, .npz or .ply), why it goes where it goes (nsp, .json), a part of its record (record, .mcap); any of them .bin
    as sent.
    """
    words = ["get", product, *(word for word in (from_s, to_s, channels) if word is not None)]
    plan, path = plan_of(words, contact, timeout), out or Path(files.default_name(product))
    _checked_name(product, path)
    code, session = ask(station, plan, as_json)
    if code == 0:
        save_product(session, product, path, as_json)
    leave(code, session)


def _checked_name(product: str, path: Path) -> None:
    try:
        files.check_name(product, path)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--out") from None


def save_product(session: Session, name: str, path: Path, as_json: bool = False) -> None:
    """Write the newest product of a name and print its content; with as_json also as a line of news."""
    found = next(p for p in reversed(session.products.values()) if p.name == name)
    holds = files.save(found, path)
    if as_json:
        line_out(json.dumps({"news": "written", "file": str(path), "bytes": path.stat().st_size, "holds": holds}))
    line_beside(f"{path} written: {holds}")


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
    plan = Plan(
        tuple(parse(text, file)),
        barrier=barrier,
        limit_s=timeout,
        report_s=0.0,
        asked_by="script" if file == "-" else f"script {file}",
    )
    code, session = ask(station, plan, as_json)
    for product in session.products.values():
        if out is not None:
            save_product(session, product.name, out / files.default_name(product.name), as_json)
    leave(code, session)


def calibrate() -> None:
    """Not on board: geometry is calibrated from records, by `onboard calibrate`, and takes effect with a restart."""
    last_words("the rover takes no such command: `onboard calibrate` works on its records, see docs/calibration.md")
    raise typer.Exit(USAGE)
