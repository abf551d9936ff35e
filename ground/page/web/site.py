"""The page's parts in one record, and the plain HTTP routes: sign-in, STOP, pictures, state."""

from __future__ import annotations

import html
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs

from fastapi import FastAPI, Request
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import FileResponse, HTMLResponse, JSONResponse, PlainTextResponse, RedirectResponse, Response

from ground.archive.schema import ArchiveError
from ground.page.live.acknowledged import Acknowledged
from ground.page.live.link import Live
from ground.page.live.orders import who
from ground.page.map.maps import Maps
from ground.page.past.replay import Replay
from ground.page.view.model import view
from ground.page.view.tree_feed import TreeFeed
from ground.page.web.access import Role, cookie_name, cookie_value, role_of_token
from ground.page.web.guard import Gate
from ground.page.web.stop import StopDesk
from protocol import WireError

STATIC = Path(__file__).parents[1] / "static"
_FILES = {path.name: path for path in STATIC.iterdir() if path.suffix in (".js", ".css")}
_KINDS = {".js": "text/javascript", ".css": "text/css"}
_YEAR_S = 31_536_000
_MOST_FORM = 4096


@dataclass(slots=True)
class Site:
    """Parts of the page.

    secure: True if browsers come by https (a proxy): the cookie is then sent by https only.
    map_each_stop: True: the rover's map is fetched at each of its stops.
    replay: reader of the archive's past runs.
    feed: the newest view model, shared by all browsers.
    """

    gate: Gate
    live: Live
    maps: Maps
    acknowledged: Acknowledged
    archive: str
    secure: bool = False
    map_each_stop: bool = False
    replay: Replay = field(init=False)
    feed: TreeFeed = field(init=False)

    def __post_init__(self) -> None:
        self.replay = Replay(Path(self.archive) if self.archive else None)
        self.feed = TreeFeed(self.view())

    def view(self) -> dict[str, Any]:
        """Return the view model now."""
        return view(self.live.snapshot, time.monotonic_ns())


def routes(site: Site) -> FastAPI:
    """Return the application with the plain routes; the page itself is mounted on it later."""
    app = FastAPI(openapi_url=None, docs_url=None, redoc_url=None)
    _sign_in(app, site)
    _stop(app, site)
    _pictures(app, site)
    _buffers(app, site)
    return app


async def form(request: Request) -> dict[str, str]:
    """Return the fields of a posted form; a body over 4 kB counts as empty."""
    body = b""
    async for part in request.stream():
        body += part
        if len(body) > _MOST_FORM:
            return {}
    return {key: values[0] for key, values in parse_qs(body.decode(errors="replace")).items()}


def _asker(request: Request, role: Role) -> str:
    return who(role.value, request.client.host if request.client is not None else "?")


def _sign_in(app: FastAPI, site: Site) -> None:
    @app.get("/sign-in")
    async def ask() -> HTMLResponse:
        return HTMLResponse(sign_in_page())

    @app.post("/sign-in")
    async def take(request: Request) -> Response:
        role = role_of_token(site.gate.tokens, (await form(request)).get("token", ""))
        if role is None:
            return HTMLResponse(sign_in_page("This token opens nothing here."), status_code=403)
        answer = RedirectResponse("/", status_code=303)
        answer.set_cookie(
            cookie_name(site.gate.port),
            cookie_value(site.gate.tokens, role),
            max_age=_YEAR_S,
            httponly=True,
            samesite="strict",
            secure=site.secure,
        )
        return answer

    @app.post("/sign-out")
    async def leave() -> Response:
        answer = RedirectResponse("/sign-in", status_code=303)
        answer.delete_cookie(cookie_name(site.gate.port), httponly=True, samesite="strict", secure=site.secure)
        return answer

    @app.get("/static/{name}")
    async def static(name: str) -> Response:
        path = _FILES.get(name)
        if path is None:
            return PlainTextResponse("no such file\n", status_code=404)
        return FileResponse(path, media_type=_KINDS[path.suffix], headers={"cache-control": "no-cache"})


def _stop(app: FastAPI, site: Site) -> None:
    desk = StopDesk(site.live)

    @app.post("/stop")
    async def press(request: Request) -> Response:
        role = request.scope["role"]
        if role is not Role.OPERATOR:
            return JSONResponse(
                {"state": "refused", "words": "a viewer cannot stop the rover", "final": True}, status_code=403
            )
        given = (await form(request)).get("press") or f"form-{time.time_ns():x}"
        try:
            told = desk.press(given, _asker(request, role))
        except ValueError as error:
            return JSONResponse({"state": "refused", "words": str(error), "final": True}, status_code=400)
        if "application/json" in request.headers.get("accept", ""):
            return JSONResponse(told)
        return HTMLResponse(
            plain_page(
                "STOP",
                f"<p>STOP: {html.escape(told['words'])}</p>"
                f'<form method="post" action="/stop"><input type="hidden" name="press" '
                f'value="{html.escape(given)}"><button>How far is it?</button></form>',
            )
        )

    @app.get("/stop")
    async def alone(request: Request) -> HTMLResponse:
        """Return a page of STOP only: it needs no other part of the page, and none of its library."""
        return HTMLResponse(
            plain_page(
                "STOP", stop_bar(request.scope["role"]) + '<p><a href="/">the whole page</a></p>', ("/static/stop.js",)
            )
        )

    @app.get("/state")
    async def state() -> Response:
        return JSONResponse({**site.view(), "map": site.maps.tree()})


def _pictures(app: FastAPI, site: Site) -> None:
    @app.get("/map/ldem.png")
    async def ldem(layer: str = "height", revision: int = 0) -> Response:
        try:
            data = await run_in_threadpool(site.maps.picture, revision, layer, time.time())
        except (LookupError, ValueError) as error:
            return PlainTextResponse(f"{error}\n", status_code=404)
        return Response(data, media_type="image/png", headers={"cache-control": "no-cache"})

    @app.get("/map/past.png")
    async def past(product: int, layer: str = "height", utc_s: float = 0.0) -> Response:
        try:
            data = await run_in_threadpool(site.replay.picture, product, layer, utc_s)
        except (LookupError, ValueError, ArchiveError) as error:
            return PlainTextResponse(f"{error}\n", status_code=404)
        return Response(data, media_type="image/png", headers={"cache-control": "private, max-age=60"})

    @app.get("/map/gdem.png")
    async def gdem() -> Response:
        try:
            data = await run_in_threadpool(site.maps.gdem_picture)
        except LookupError as error:
            return PlainTextResponse(f"{error}\n", status_code=404)
        return Response(data, media_type="image/png", headers={"cache-control": "private, max-age=3600"})


def _buffers(app: FastAPI, site: Site) -> None:
    """Add the buffers of the 3D panel."""

    async def answer(make: Callable[..., bytes], *given: int) -> Response:
        try:
            data = await run_in_threadpool(make, *given)
        except (LookupError, WireError, ArchiveError) as error:
            return PlainTextResponse(f"{error}\n", status_code=404)
        return Response(data, media_type="application/octet-stream", headers={"cache-control": "no-cache"})

    @app.get("/map/cloud.bin")
    async def cloud() -> Response:
        return await answer(site.maps.cloud)

    @app.get("/map/terrain.bin")
    async def terrain() -> Response:
        return await answer(site.maps.terrain)

    @app.get("/map/past-cloud.bin")
    async def past_cloud(product: int) -> Response:
        return await answer(site.replay.cloud, product)

    @app.get("/map/past-terrain.bin")
    async def past_terrain(product: int) -> Response:
        return await answer(site.replay.terrain, product)


def stop_bar(role: Role) -> str:
    """Return the STOP bar as HTML. It works as a plain form where scripts do not."""
    off = "" if role is Role.OPERATOR else " disabled"
    words = (
        "STOP works at any time: the button, or the key Esc"
        if role is Role.OPERATOR
        else ("Viewer: this page watches, and cannot command or stop the rover")
    )
    return (
        f'<header id="stop-bar"><form method="post" action="/stop"><button id="stop-button" type="submit"{off} '
        f'aria-keyshortcuts="Escape">STOP<kbd>Esc</kbd></button></form><div id="stop-words" role="status" '
        f'aria-live="assertive">{words}</div><div id="who">{role.value} <a href="/stop">STOP alone</a>'
        '<form method="post" action="/sign-out">'
        f"<button>sign out</button></form></div></header>"
    )


def sign_in_page(error: str = "") -> str:
    """Return the form of signing in."""
    told = f'<p class="error" role="alert">{html.escape(error)}</p>' if error else ""
    return plain_page(
        "Sign in",
        (
            f'<h1>El Dorado: sign in</h1>{told}<form id="form" method="post" action="/sign-in"><label for="token">Token'
            '</label><input id="token" name="token" type="password" autocomplete="current-password" required>'
            "<button>Sign in</button></form><p><code>ground serve</code> prints an address for the operator and one "
            'for viewers; each has its token behind <code>#</code>.</p><script src="/static/sign-in.js" defer></script>'
        ),
    )


def plain_page(title: str, body: str, scripts: tuple[str, ...] = ()) -> str:
    """Return a page without the page's library."""
    tags = "".join(f'<script src="{one}" defer></script>' for one in scripts)
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        f'<meta name="viewport" content="width=device-width"><title>{html.escape(title)} · El Dorado</title>'
        '<link rel="icon" href="data:,"><link rel="stylesheet" href="/static/plain.css"></head>'
        f'<body><main class="sign-in">{body}</main>{tags}</body></html>'
    )
