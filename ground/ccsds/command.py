"""The command `ground bridge ccsds`: its options and the ports that they open."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from ground.ccsds.bridge import Bridge
from ground.ccsds.ports import Address, BridgeShell, parse_address
from ground.cli.operations.operate import Beside, Plan, Teller, operate
from ground.cli.verbs.screen import line_beside, line_out
from ground.cli.verbs.table import Contact, Json, StationFile
from ground.link.session import Session
from ground.station.settings import load_settings
from protocol.ccsds.xtce import xtce

app = typer.Typer(help="Bridges to other ground systems.", no_args_is_help=True)
_OFF = "none"


def _address(text: str, option: str) -> Address:
    try:
        return parse_address(text)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint=option) from None


@app.command(
    "ccsds",
    epilog="Examples: ground bridge ccsds | ground bridge ccsds --tm tcp:127.0.0.1:10015 --tc none | "
    "ground bridge ccsds --write-xtce eldorado.xml",
)
def ccsds(
    tm: Annotated[
        str,
        typer.Option(
            metavar="udp|tcp:HOST:PORT", help="Telemetry: sent there by UDP, or handed to who connects there by TCP."
        ),
    ] = "udp:127.0.0.1:10015",
    tc: Annotated[
        str, typer.Option(metavar="udp|tcp:HOST:PORT", help="Telecommands: listened for there; none: not taken.")
    ] = "udp:127.0.0.1:10025",
    anybody: Annotated[
        bool,
        typer.Option(
            "--anybody", help="Let other machines than this one send telecommands: they are not asked for a key."
        ),
    ] = False,
    write_xtce: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the description of all packets there, and end.")
    ] = None,
    contact: Contact = 0.0,
    station: StationFile = None,
    as_json: Json = False,
) -> None:
    """Speak CCSDS space packets with YAMCS or a similar system, until Ctrl-C; see docs/bridge.md for each step."""
    if write_xtce is not None:
        write_xtce.write_text(xtce(), encoding="utf-8")
        line_beside(f"{write_xtce} written: XTCE 1.2 of all telemetry packets and commands")
        return
    down = _address(tm, "--tm")
    up = None if tc == _OFF else _address(tc, "--tc")
    if up is not None and not up.is_local and not anybody:
        raise typer.BadParameter(
            f"{tc}: whoever reaches this port commands the rover; on a trusted network say --anybody", param_hint="--tc"
        )
    settings = load_settings(station)

    @contextmanager
    def join(session: Session) -> Iterator[Beside]:
        bridge = Bridge(session)
        with BridgeShell(bridge, down, up) as shell:
            try:
                yield shell
            finally:
                told = ", ".join(f"{count} {kind}" for kind, count in sorted(bridge.counts.items()))
                line_beside(f"ground: packets: {told or 'none'}")

    code, _ = operate(settings, Plan(contact_s=contact), Teller(line_out, as_json, settings.report_s), join)
    raise typer.Exit(code)
