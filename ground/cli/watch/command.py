"""The verb `ground watch`: the view in a terminal, lines elsewhere."""

from __future__ import annotations

import os
import sys
from typing import Annotated

import typer

from ground.cli.operations.operate import Plan
from ground.cli.verbs.run_verb import ask, leave
from ground.cli.verbs.table import Contact, Json, StationFile
from ground.station.settings import load_settings

EXAMPLES = "Examples: ground watch | ground watch --plain | ground watch --json > log.jsonl"
Plain = Annotated[bool, typer.Option("--plain", help="Lines, as where the output is no terminal.")]


def watch_command(
    contact: Contact = 0.0, station: StationFile = None, plain: Plain = False, as_json: Json = False
) -> None:
    """Show map, state, events and link in the terminal, with a command line and a stop key (Ctrl-X) over all of it.

    Where the output is no terminal, and with --plain: events and a status line each second, until Ctrl-C.
    """
    if plain or as_json or not can_draw():
        leave(*ask(station, Plan(contact_s=contact, report_s=1.0), as_json))
    from ground.cli.watch.terminal import run  # its library takes half a second to load

    raise typer.Exit(run(load_settings(station), contact))


def can_draw() -> bool:
    """Return whether input and output are a terminal that can show the view."""
    return sys.stdout.isatty() and sys.stdin.isatty() and os.environ.get("TERM") not in (None, "", "dumb")
