"""The command `ground gateway`: its options and the doors that they open."""

from __future__ import annotations

import ipaddress
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, NamedTuple

import typer

from ground.cli.operations.operate import Beside, Join, Plan, Teller, operate
from ground.cli.verbs.screen import line_out
from ground.cli.verbs.table import Contact, Json, StationFile
from ground.link.session import Session
from ground.station.settings import StationSettings, load_settings
from onboard.config import ConfigError

OPEN, SIGNED = "unsigned", "signed"
_QGC = "127.0.0.1:14550"


def _address(text: str, option: str, *, local: bool) -> tuple[str, int]:
    host, _, port = text.rpartition(":")
    try:
        where, number = ipaddress.IPv4Address(host), int(port)
    except ValueError:
        raise typer.BadParameter(f"{text} should be like 127.0.0.1:14551", param_hint=option) from None
    if not 0 <= number <= 65_535:
        raise typer.BadParameter(f"{text}: a port is a number up to 65535", param_hint=option)
    if local and not where.is_loopback:
        raise typer.BadParameter(
            f"{text}: unsigned MAVLink stays on this machine; use --signed and --key for others", param_hint=option
        )
    return host, number


def _origin(settings: StationSettings, text: str) -> tuple[float, float, float]:
    if not text:
        return settings.origin_latitude_deg, settings.origin_longitude_deg, settings.origin_height_m
    try:
        numbers = [float(word) for word in text.replace(",", " ").split()]
    except ValueError:
        numbers = []
    if len(numbers) not in (2, 3):
        raise typer.BadParameter(f"`{text}` should be LAT,LON or LAT,LON,HEIGHT", param_hint="--origin")
    return numbers[0], numbers[1], numbers[2] if len(numbers) == 3 else 0.0


def gateway_command(
    port: Annotated[
        str, typer.Option(metavar="HOST:PORT", help="Where unsigned clients come to, on this machine; `none`: nowhere.")
    ] = "127.0.0.1:14551",
    to: Annotated[
        list[str] | None,
        typer.Option(
            metavar="HOST:PORT", help=f"A client that listens itself; may be repeated; `none`: nobody. Else {_QGC}."
        ),
    ] = None,
    signed: Annotated[str, typer.Option(metavar="HOST:PORT", help="Where signed clients come to; needs --key.")] = "",
    key: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Signing key: 64 hex digits, or `passphrase WORDS`; mode 0600.")
    ] = None,
    origin: Annotated[
        str,
        typer.Option(
            metavar="LAT,LON,HEIGHT",
            help="Where the map frame lies: degrees, metres over WGS 84. Else origin_* of the station file.",
        ),
    ] = "",
    home_first: Annotated[
        bool, typer.Option("--home-first", help="Item 0 of a mission is a home and no goal (Mission Planner).")
    ] = False,
    contact: Contact = 0.0,
    station: StationFile = None,
    as_json: Json = False,
) -> None:
    """Let MAVLink ground programs see and command the rover, until Ctrl-C."""
    settings = load_settings(station)
    unsigned = None if port == "none" else _address(port, "--port", local=True)
    named = to if to is not None else [_QGC] if unsigned is not None else []
    told = [_address(one, "--to", local=True) for one in named if one != "none"]
    if told and unsigned is None:
        raise typer.BadParameter(
            "clients are told from the unsigned port, which is closed by --port none", param_hint="--to"
        )
    place = _origin(settings, origin)
    safe = _address(signed, "--signed", local=False) if signed else None
    if (safe is None) != (key is None):
        raise typer.BadParameter("a signed port needs a key, and a key a signed port: --signed HOST:PORT --key FILE")
    if safe is not None and not settings.state:
        raise ConfigError("state: a signed port needs a folder in the station file, where signing times outlive it")
    teller = Teller(line_out, as_json, settings.report_s)
    code, _ = operate(
        settings, Plan(contact_s=contact), teller, _join(settings, _Ways(unsigned, told, safe, key), place, home_first)
    )
    raise typer.Exit(code)


class _Ways(NamedTuple):
    """Addresses from the options.

    unsigned: of the unsigned door; None: closed.
    told: clients that get telemetry without having sent anything first.
    signed, key: of the signed door and its key file; None: closed.
    """

    unsigned: tuple[str, int] | None
    told: list[tuple[str, int]]
    signed: tuple[str, int] | None
    key: Path | None


def _join(settings: StationSettings, ways: _Ways, place: tuple[float, float, float], home_first: bool) -> Join:
    """Return the context manager that opens the doors around a gateway on the operation's session."""
    # MAVLink's common set takes 0.3 s to load: only this command pays for it
    from ground.gateway.clients import Door
    from ground.gateway.gateway import Gateway
    from ground.gateway.origin import Origin
    from ground.gateway.shell import GatewayShell, Marks, read_signing_key
    from ground.gateway.signing import Verifier

    try:
        where = Origin(*place)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--origin") from None
    secret = read_signing_key(str(ways.key)) if ways.key is not None else None
    marks = Marks(Path(settings.state) / "gateway-signing.json") if secret is not None else None
    kept = marks.read() if marks is not None else {}

    @contextmanager
    def join(session: Session) -> Iterator[Beside]:
        gateway = Gateway(session, where, home_first=home_first)
        with GatewayShell(gateway, marks) as shell:
            door = Door(OPEN)
            if ways.unsigned is not None:
                shell.open(door, ways.unsigned)
            for address in ways.told:
                gateway.clients.know(door, address)
            if ways.signed is not None and secret is not None:
                shell.open(Door(SIGNED, Verifier(secret, kept), secret), ways.signed)
            yield shell

    return join
