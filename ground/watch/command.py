"""The verb `ground watch`: the view in a terminal, lines elsewhere."""

from __future__ import annotations

from typing import Annotated

import typer

from ground.operation.operate import Plan
from ground.station.settings import load_settings
from ground.verbs.asking import ask, leave
from ground.verbs.table import Contact, Json, StationFile

EXAMPLES = "Examples: ground watch | ground watch --plain | ground watch --json > log.jsonl"
Plain = Annotated[bool, typer.Option("--plain", help="Lines, as where the output is no terminal.")]


def watch_command(
    contact: Contact = 0.0, station: StationFile = None, plain: Plain = False, as_json: Json = False
) -> None:
    """Show map, state, events and link in the terminal, with a command line and a stop key (Ctrl-X) over all of it.

    Where the output is no terminal, and with --plain: events and a status line each second, until Ctrl-C.
    """
    from ground.watch import terminal

    if not terminal.possible(plain, as_json):
        leave(*ask(station, Plan(contact_s=contact, report_s=1.0), as_json))
    raise typer.Exit(terminal.run(load_settings(station), contact))
