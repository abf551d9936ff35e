"""The verb `ground serve`."""

from __future__ import annotations

import os
import threading
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple, NoReturn

import typer

from ground.cli.verbs.options import USAGE, fail
from ground.cli.verbs.screen import line_beside, line_out
from ground.cli.verbs.table import StationFile
from ground.station.settings import StationSettings, load_settings

if TYPE_CHECKING:
    from ground.foxglove.server import FoxgloveServer
    from ground.page.live.link import OnTurn

EXAMPLES = (
    "Examples: ground serve | ground serve --port 9000 --gdem build/sim/gdem.npz | ground serve --foxglove\n\n"
    "From another computer: ssh -L 8765:127.0.0.1:8765 STATION, then open the printed address there."
)
_TOKENS, _ACKNOWLEDGED = "page-tokens.json", "page-acknowledged.json"
_LOOK_S = 0.5


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
    foxglove: Annotated[
        bool, typer.Option("--foxglove", help="Also serve live data to Foxglove, by WebSocket; it takes no commands.")
    ] = False,
    foxglove_port: Annotated[
        int, typer.Option(min=1, max=65535, metavar="PORT", help="Port for Foxglove, at the same address.")
    ] = 8766,
    page: Annotated[bool, typer.Option("--page/--no-page", help="Without the page: for Foxglove only.")] = True,
    station: StationFile = None,
) -> None:
    """Show the operator's page in the browser until Ctrl-C: map, telemetry, events, commands, and STOP.

    The printed addresses sign in: one as operator, one as viewer, who can only watch. Whoever has them has the role.
    """
    settings = load_settings(station)
    if not page and not foxglove:
        raise fail(USAGE, "--no-page leaves nothing to serve; add --foxglove")
    with ExitStack() as stack:
        on_turn = _foxglove(stack, host, foxglove_port).turn if foxglove else None
        if not page:
            _serve_foxglove(settings, on_turn)
        _serve_page(settings, PageOptions(host, port, tuple(name or ()), gdem, https), on_turn)


class PageOptions(NamedTuple):
    """Options of the page, as `ground serve --help` explains them."""

    host: str
    port: int
    names: tuple[str, ...]
    gdem: Path | None
    https: bool


def _foxglove(stack: ExitStack, host: str, port: int) -> FoxgloveServer:
    """Start the server for Foxglove and print its address."""
    try:
        from ground.foxglove.server import FoxgloveServer
    except ModuleNotFoundError as error:
        raise fail(USAGE, f"--foxglove needs the package {error.name}-sdk: pip install '.[foxglove]'") from None
    from ground.page.web.access import is_loopback

    server = stack.enter_context(FoxgloveServer(host, port))
    line_out(f"Foxglove: ws://{_reached(host)}:{port}")
    if not is_loopback(host):
        line_beside(
            f"ground: whoever reaches port {port} reads the rover's data: it has no token and no encryption; "
            "keep to 127.0.0.1 with `ssh -L`"
        )
    return server


def _serve_foxglove(settings: StationSettings, on_turn: OnTurn | None) -> NoReturn:
    """Keep the link open for Foxglove alone until Ctrl-C, and report on stderr why it is down."""
    from ground.page.live.link import Live
    from ground.page.view.snapshot import EMPTY

    live, wait, trouble = Live(settings, lambda product, utc_ns: None, on_turn=on_turn), threading.Event(), ""
    live.start()
    try:
        while True:
            wait.wait(_LOOK_S)
            shot = live.snapshot
            if shot is not EMPTY and shot.trouble != trouble:
                trouble = shot.trouble
                line_beside(f"ground: {trouble}; it is tried again" if trouble else "ground: on the link")
    finally:
        live.stop()


def _serve_page(settings: StationSettings, options: PageOptions, on_turn: OnTurn | None) -> None:
    host, port, https = options.host, options.port, options.https
    os.environ.setdefault("NICEGUI_STORAGE_PATH", str(_folder(settings) or Path("build")))
    # the page's library takes a second to load: only this command pays for it
    from ground.page.live.acknowledged import Acknowledged
    from ground.page.live.link import Live
    from ground.page.map.maps import Maps
    from ground.page.server import application, listen, run
    from ground.page.web.access import hosts_of, is_loopback, new_tokens, stored_tokens
    from ground.page.web.guard import Gate
    from ground.page.web.site import Site
    from ground.products.preview import NoMapError, gdem_file

    folder = _folder(settings)
    tokens = new_tokens() if folder is None else stored_tokens(folder / _TOKENS)
    try:
        orbit = gdem_file(options.gdem if options.gdem is not None else _beside(settings))
    except NoMapError as error:
        raise fail(error.code, str(error)) from None
    maps = Maps(orbit, Path(settings.archive) if settings.archive else None)
    maps.load()
    live = Live(settings, maps.add, on_turn=on_turn)
    site = Site(
        Gate(tokens, hosts_of(host, port, options.names), port),
        live,
        maps,
        Acknowledged(None if folder is None else folder / _ACKNOWLEDGED),
        settings.archive,
        https,
    )
    with listen(host, port) as at:
        shown = f"http://{_reached(host)}:{port}/sign-in"
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


def _reached(host: str) -> str:
    """Return the address by which this computer reaches a listener at `host`."""
    if host in ("0.0.0.0", "::"):
        return "127.0.0.1"
    return f"[{host}]" if ":" in host and not host.startswith("[") else host


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
