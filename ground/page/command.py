"""The verb `ground serve`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from ground.cli.verbs.options import fail
from ground.cli.verbs.screen import line_beside, line_out
from ground.cli.verbs.table import StationFile
from ground.station.settings import StationSettings, load_settings

EXAMPLES = (
    "Examples: ground serve | ground serve --port 9000 --gdem build/sim/gdem.npz\n\n"
    "From another computer: ssh -L 8765:127.0.0.1:8765 STATION, then open the printed address there."
)
_TOKENS, _ACKNOWLEDGED = "page-tokens.json", "page-acknowledged.json"


def serve_command(
    port: Annotated[int, typer.Option(min=1, max=65535, metavar="PORT", help="Port of the page.")] = 8765,
    host: Annotated[
        str,
        typer.Option(metavar="ADDRESS", help="Address to listen at; the default is reached from this computer only."),
    ] = "127.0.0.1",
    name: Annotated[
        list[str] | None,
        typer.Option(
            metavar="HOST[:PORT]", help="Another name by which browsers reach the page, as a proxy's; may be repeated."
        ),
    ] = None,
    gdem: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="The orbiter's map, as the rover has it; else gdem.npz beside the station file."
        ),
    ] = None,
    https: Annotated[bool, typer.Option("--https", help="Browsers come by https, through a proxy.")] = False,
    station: StationFile = None,
) -> None:
    """Show the operator's page in the browser until Ctrl-C: map, telemetry, events, commands, and STOP.

    The printed addresses sign in: one as operator, one as viewer, who can only watch. Whoever has them has the role.
    """
    settings = load_settings(station)
    os.environ.setdefault("NICEGUI_STORAGE_PATH", str(_folder(settings) or Path("build")))
    # the page's library takes a second to load: only this command pays for it
    from ground.page.access import hosts_of, is_loopback, new_tokens, stored_tokens
    from ground.page.acknowledged import Acknowledged
    from ground.page.guard import Gate
    from ground.page.live import Live
    from ground.page.maps import Maps
    from ground.page.server import application, listen, run
    from ground.page.site import Site
    from ground.products.preview import NoMapError, gdem_file

    folder = _folder(settings)
    tokens = new_tokens() if folder is None else stored_tokens(folder / _TOKENS)
    try:
        orbit = gdem_file(gdem if gdem is not None else _beside(settings))
    except NoMapError as error:
        raise fail(error.code, str(error)) from None
    maps = Maps(orbit, Path(settings.archive) if settings.archive else None)
    maps.load()
    live = Live(settings, maps.add)
    site = Site(
        Gate(tokens, hosts_of(host, port, tuple(name or ())), port),
        live,
        maps,
        Acknowledged(None if folder is None else folder / _ACKNOWLEDGED),
        settings.archive,
        https,
    )
    with listen(host, port) as at:
        shown = f"http://{'127.0.0.1' if host in ('0.0.0.0', '::') else host}:{port}/sign-in"
        line_out(f"operator: {shown}#{tokens.operator}")
        line_out(f"viewer:   {shown}#{tokens.viewer}")
        if not is_loopback(host) and not https:
            line_beside(
                "ground: what this page sends is not encrypted and others on the network can read it; "
                "keep to 127.0.0.1 with `ssh -L`, or put a proxy with https before it"
            )
        made = application(site)
        live.start()
        try:
            run(made, at)
        finally:
            live.stop()


def _folder(settings: StationSettings) -> Path | None:
    """Return the folder for tokens; None if the station keeps nothing: the tokens end with the server then."""
    if settings.state:
        return Path(settings.state)
    return Path(settings.archive).parent if settings.archive else None


def _beside(settings: StationSettings) -> Path | None:
    """Return the orbiter's map of a bench's run folder, if there is one."""
    folder = _folder(settings)
    found = None if folder is None else folder.parent / "gdem.npz"
    return found if found is not None and found.is_file() else None
