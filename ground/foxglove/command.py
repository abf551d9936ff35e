"""The verb `ground foxglove`: live data for Foxglove until Ctrl-C."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated

import typer

from ground.operation.operate import Beside, Plan, Teller, operate
from ground.session.session import Session
from ground.station.settings import load_settings
from ground.verbs.options import USAGE, fail
from ground.verbs.screen import line_out
from ground.verbs.table import Contact, Json, StationFile

EXAMPLES = ("Examples: ground foxglove | ground foxglove --port 9000\n\n"
            "Then in Foxglove: open the connection ws://localhost:8765, import the layout docs/foxglove.json")
Port = Annotated[int, typer.Option(min=0, max=65535, help="Port that Foxglove connects to; 0: any free one.")]
Host = Annotated[str, typer.Option(metavar="HOST", help="Address to listen at. Whoever reaches it can read everything.")]


def foxglove_command(
    port: Port = 8765, host: Host = "127.0.0.1", contact: Contact = 0.0, station: StationFile = None,
    as_json: Json = False,
) -> None:  # fmt: skip
    """Show the rover live in Foxglove, with the topics of an exported record, until Ctrl-C. It takes no commands."""
    try:
        from ground.foxglove.server import FoxgloveServer
    except ModuleNotFoundError as error:
        raise fail(USAGE, f"needs the package {error.name}: pip install '.[foxglove]'") from None

    settings = load_settings(station)
    teller = Teller(line_out, as_json, settings.report_s)

    @contextmanager
    def join(session: Session) -> Iterator[Beside]:
        with FoxgloveServer(session, host, port) as server:
            teller.said(f"Foxglove connects to ws://{host}:{server.port}", 0)
            yield server

    code, _ = operate(settings, Plan(contact_s=contact), teller, join)
    raise typer.Exit(code)
