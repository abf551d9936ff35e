"""Guard of the page: an ASGI layer that checks every request before any other code sees it, and adds the headers.

Order of checks: Host, Origin, then the cookie's role. Only the paths of signing in need no role. A WebSocket is checked
like a request; a refused one is closed before it opens.
"""

from __future__ import annotations

import re
import secrets
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any, NamedTuple

from ground.page.web.access import Role, Tokens, cookie_name, origin_is_own, role_of_cookies

Scope = MutableMapping[str, Any]
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

OPEN_PATHS = frozenset({"/sign-in", "/static/sign-in.js", "/static/plain.css"})
_SAFE = frozenset({"GET", "HEAD"})
_HEADERS = (
    (b"x-frame-options", b"DENY"), (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"same-origin"),  # with "no-referrer" browsers send `Origin: null` from forms
    (b"cross-origin-opener-policy", b"same-origin"), (b"cross-origin-resource-policy", b"same-origin"),
    (b"permissions-policy", b"camera=(), geolocation=(), microphone=()"),
)  # fmt: skip
_SCRIPT = re.compile(rb"<script(?=[\s>])")


class Gate(NamedTuple):
    """Settings of the guard.

    tokens: secrets of the roles.
    hosts: accepted Host headers.
    port: port of the server, for the cookie's name.
    """

    tokens: Tokens
    hosts: frozenset[str]
    port: int


class Refusal(NamedTuple):
    """Answer to a refused request: HTTP status and one line."""

    status: int
    text: str


def judge(gate: Gate, kind: str, method: str, path: str, headers: dict[str, str]) -> Role | Refusal | None:
    """Return the role, None for an open path without one, or the refusal.

    kind: "http" or "websocket". headers: names in lower case.
    """
    host = headers.get("host", "")
    if host.lower() not in gate.hosts:
        return Refusal(421, "this server is not known by that name; --name adds one")
    origin = headers.get("origin")
    if not origin_is_own(origin, host):
        return Refusal(403, "requests of other sites are refused")
    if kind == "websocket" and origin is None:
        return Refusal(403, "a WebSocket needs an Origin")
    role = role_of_cookies(gate.tokens, headers.get("cookie", ""), cookie_name(gate.port))
    if role is None and not (kind == "http" and path in OPEN_PATHS):
        return Refusal(401, "sign in first: /sign-in")
    return role


def policy(nonce: str, host: str) -> bytes:
    """Return the Content-Security-Policy: only this server's files, only scripts with the nonce, no frame.

    `unsafe-eval` is for Vue, which compiles the templates of NiceGUI in the browser; no text of the rover gets there.
    """
    return "; ".join(
        (
            "default-src 'none'",
            f"script-src 'self' 'nonce-{nonce}' 'unsafe-eval'",
            "style-src 'self' 'unsafe-inline'",
            "img-src 'self' data: blob:",
            "font-src 'self' data:",
            f"connect-src 'self' ws://{host} wss://{host}",
            "worker-src 'self' blob:",
            "frame-ancestors 'none'",
            "base-uri 'none'",
            "form-action 'self'",
        )
    ).encode()


class Guard:
    """The layer. `scope["role"]` has the role for the code behind it."""

    def __init__(self, app: App, gate: Gate) -> None:
        self.app, self._gate = app, gate  # `app`: the page's library looks for it

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one ASGI connection."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        headers = {name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]}
        found = judge(self._gate, scope["type"], scope.get("method", "GET"), scope["path"], headers)
        if scope["type"] == "websocket":
            if isinstance(found, Refusal):
                await send({"type": "websocket.close", "code": 1008})
                return
            scope["role"] = found
            await self.app(scope, receive, send)
            return
        sending = _Sending(send, headers.get("host", ""))
        if isinstance(found, Refusal):
            await _refuse(found, scope, headers, sending)
            return
        scope["role"] = found
        await self.app(scope, receive, sending)


class _Sending:
    """Sender of one response: adds the headers, and the nonce to each script tag of a page."""

    def __init__(self, send: Send, host: str) -> None:
        self._send, self._nonce, self._host = send, secrets.token_urlsafe(16), host
        self._start: Message | None = None
        self._body = b""

    async def __call__(self, message: Message) -> None:
        """Send one ASGI message. A page is collected whole, as its length changes."""
        if message["type"] == "http.response.start":
            headers = [pair for pair in message["headers"] if pair[0].lower() not in dict(_HEADERS)]
            headers += [*_HEADERS, (b"content-security-policy", policy(self._nonce, self._host))]
            message = {**message, "headers": headers}
            kind = dict(headers).get(b"content-type", b"")
            if kind.startswith(b"text/html"):
                self._start = message
                return
        elif self._start is not None:
            self._body += message.get("body", b"")
            if message.get("more_body"):
                return
            await self._send_page(self._start)
            return
        await self._send(message)

    async def _send_page(self, start: Message) -> None:
        body = _SCRIPT.sub(f'<script nonce="{self._nonce}"'.encode(), self._body)
        dropped = (b"content-length", b"cache-control", b"etag")
        headers = [pair for pair in start["headers"] if pair[0].lower() not in dropped]
        headers += [(b"content-length", str(len(body)).encode()), (b"cache-control", b"no-store")]
        await self._send({**start, "headers": headers})
        await self._send({"type": "http.response.body", "body": body})


async def _refuse(refusal: Refusal, scope: Scope, headers: dict[str, str], send: Send) -> None:
    """Answer with one line; a browser that opens the page without a role is sent to the form."""
    page = scope["method"] in _SAFE and "text/html" in headers.get("accept", "")
    if refusal.status == 401 and page:
        await send(
            {
                "type": "http.response.start",
                "status": 303,
                "headers": [(b"location", b"/sign-in"), (b"content-length", b"0"), (b"cache-control", b"no-store")],
            }
        )
        await send({"type": "http.response.body", "body": b""})
        return
    body = refusal.text.encode() + b"\n"
    await send(
        {
            "type": "http.response.start",
            "status": refusal.status,
            "headers": [
                (b"content-type", b"text/plain; charset=utf-8"),
                (b"content-length", str(len(body)).encode()),
                (b"cache-control", b"no-store"),
            ],
        }
    )
    await send({"type": "http.response.body", "body": body})
