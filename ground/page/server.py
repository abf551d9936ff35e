"""Server of the page: the plain routes, the page on NiceGUI, the guard around both, and the pushing of news."""

from __future__ import annotations

import asyncio
import logging
import socket
from contextlib import suppress
from typing import Any

import uvicorn
from fastapi import Request
from nicegui import app as page_app
from nicegui import ui

from ground.page.live.orders import who
from ground.page.panels.board import Board
from ground.page.web.access import Role
from ground.page.web.guard import Guard
from ground.page.web.site import Site, routes, stop_bar
from ground.station.station import StationError

_PUSH_S, _SLOW_PUSHES = 0.4, 5
_HISTORY = 20  # messages that a browser gets again after a short loss; after a longer one it loads the page again
_LOG = logging.getLogger(__name__)


def listen(host: str, port: int) -> socket.socket:
    """Return a listening socket. Raises StationError if the port is in use or may not be opened."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    made = socket.socket(family, socket.SOCK_STREAM)
    try:
        made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        made.bind((host.strip("[]"), port))
        made.listen(128)
    except OSError as error:
        made.close()
        raise StationError(
            f"port {port} of {host}: {error.strerror or error}; name another with --port, or end what listens there"
        ) from error
    return made


def application(site: Site) -> Guard:
    """Return the whole application, guarded. One per process: the page's library has one application."""
    outer = routes(site)
    boards: dict[str, Board] = {}

    @ui.page("/", title="El Dorado")
    def page(request: Request) -> None:
        role: Role = request.scope["role"]
        address = request.client.host if request.client is not None else "?"
        ui.add_head_html(
            '<link rel="stylesheet" href="/static/plain.css">'
            '<link rel="stylesheet" href="/static/page.css"><script src="/static/stop.js" defer></script>'
        )
        ui.colors(primary="#1d6fb8")  # white on it: 5.2 to 1
        ui.add_body_html(stop_bar(role))
        client = ui.context.client
        if not boards:  # without browsers the tree stood still
            site.feed.take(site.view())
        boards[client.id] = Board(site, role, who(role.value, address))
        client.on_delete(lambda: boards.pop(client.id, None) and None)

    tasks: list[asyncio.Task[None]] = []
    page_app.on_startup(lambda: tasks.append(asyncio.create_task(push_all(site, boards))))
    page_app.on_shutdown(lambda: [task.cancel() for task in tasks] and None)
    ui.run_with(
        outer,
        title="El Dorado",
        language="en-US",
        dark=True,
        tailwind=False,
        show_welcome_message=False,
        reconnect_timeout=10.0,
        message_history_length=_HISTORY,
        gzip_middleware_factory=None,
        favicon="🛰",
    )
    return Guard(outer, site.gate)


async def push_all(site: Site, boards: dict[str, Board]) -> None:
    """Push what is new to all browsers, again and again. An error of one turn or browser ends no other."""
    turn, last_stop = 0, None
    while True:
        await asyncio.sleep(_PUSH_S)
        turn += 1
        try:
            last_stop = _map_at_stop(site, last_stop)
            _push(site, boards, turn % _SLOW_PUSHES == 0)
        except Exception:  # noqa: BLE001 - a value that cannot be shown now must not end all pages
            _LOG.exception("pushing")


def _push(site: Site, boards: dict[str, Board], slow: bool) -> None:
    if not boards:
        return
    site.feed.take(site.view())
    maps = site.maps.tree()
    for key, board in list(boards.items()):
        try:
            board.push(maps, slow)
        except Exception:  # noqa: BLE001 - one browser's page must not end the others'
            _LOG.exception("page %s", key)


def _map_at_stop(site: Site, last_stop: float | None) -> float | None:
    """Fetch the map when the rover has come to another stop, if this is switched on. Returns the stop."""
    item = site.live.snapshot.items.get("stop")
    if item is None:
        return last_stop
    if site.map_each_stop and last_stop is not None and item.value != last_stop:
        with suppress(ValueError):
            site.live.ask("get", {"product": "ldem"}, who("page", "at each stop"))
    return float(item.value)


def run(application: Any, at: socket.socket) -> None:
    """Serve until Ctrl-C or SIGTERM. Raises KeyboardInterrupt at Ctrl-C."""
    config = uvicorn.Config(
        application,
        log_level="warning",
        access_log=False,
        server_header=False,
        date_header=False,
        timeout_graceful_shutdown=2,
        ws_max_size=1 << 20,
    )
    uvicorn.Server(config).run(sockets=[at])
