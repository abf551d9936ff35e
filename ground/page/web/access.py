"""Access to the page: tokens, roles, the session cookie, and the checks of Host and Origin. Pure but for the file.

    token of a role  --sign in-->  cookie = HMAC(token, "page")  --each request-->  role

The cookie follows from the token alone, so it outlives a restart of the server and ends when the token file is deleted.
A page of another site can neither read the cookie's answer nor send it: SameSite=Strict, Host and Origin are checked.
"""

from __future__ import annotations

import hashlib
import hmac
import json
import os
import secrets
import stat
from enum import Enum
from ipaddress import ip_address
from pathlib import Path
from typing import NamedTuple
from urllib.parse import urlsplit

from ground.archive.schema import private
from onboard.config import ConfigError

TOKEN_BYTES = 24
_LEAST_CHARACTERS = 24
_LOOPBACK = ("localhost", "127.0.0.1", "[::1]")


class Role(Enum):
    """Role of a signed-in person."""

    OPERATOR = "operator"
    VIEWER = "viewer"


class Tokens(NamedTuple):
    """The secret of each role."""

    operator: str
    viewer: str

    def of(self, role: Role) -> str:
        """Return the token of a role."""
        return self.operator if role is Role.OPERATOR else self.viewer


def new_tokens() -> Tokens:
    """Return fresh random tokens."""
    return Tokens(secrets.token_urlsafe(TOKEN_BYTES), secrets.token_urlsafe(TOKEN_BYTES))


def stored_tokens(path: Path) -> Tokens:
    """Return the tokens in a file of mode 0600; a missing file is made with fresh ones.

    Raises ConfigError for a file that others may read or that is damaged, OSError if it cannot be made.
    """
    try:
        mode = stat.S_IMODE(path.stat().st_mode)
    except FileNotFoundError:
        return _made(path)
    if mode & 0o077:
        raise ConfigError(f"{path}: mode {mode:04o}, others may read these tokens; delete it, a new one is made")
    try:
        tree = json.loads(path.read_text())
        tokens = Tokens(tree["operator"], tree["viewer"])
    except (ValueError, KeyError, TypeError) as error:
        raise ConfigError(f"{path}: damaged ({type(error).__name__}); delete it, a new one is made") from None
    if not all(isinstance(one, str) and len(one) >= _LEAST_CHARACTERS and one.isascii() for one in tokens):
        raise ConfigError(f"{path}: a token has under {_LEAST_CHARACTERS} characters; delete it, a new one is made")
    if tokens.operator == tokens.viewer:
        raise ConfigError(f"{path}: both roles have the same token; delete it, a new one is made")
    return tokens


def _made(path: Path) -> Tokens:
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    tokens = new_tokens()
    try:
        descriptor = private(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC)
    except FileExistsError:  # another process made it just now
        return stored_tokens(path)
    with os.fdopen(descriptor, "w") as file:
        json.dump(tokens._asdict(), file)
    return tokens


def role_of_token(tokens: Tokens, token: str) -> Role | None:
    """Return the role that a typed token opens; None: none. The time does not depend on the token."""
    return _match({role: tokens.of(role) for role in Role}, token.strip())


def cookie_value(tokens: Tokens, role: Role) -> str:
    """Return the cookie's value of a role, hex digits."""
    return hmac.new(tokens.of(role).encode(), f"page {role.value}".encode(), hashlib.sha256).hexdigest()


def role_of_cookies(tokens: Tokens, header: str, name: str) -> Role | None:
    """Return the role that a Cookie header shows; None: none. name: name of the cookie.

    Only cookies of exactly this name are read: the header also has those of other servers on this computer, in any
    syntax.
    """
    known = {role: cookie_value(tokens, role) for role in Role}
    pairs = (part.strip().partition("=") for part in header.split(";"))
    found = [_match(known, value) for key, _, value in pairs if key == name]
    return next((role for role in found if role is not None), None)


def _match(known: dict[Role, str], given: str) -> Role | None:
    found = None
    for role, value in known.items():
        if hmac.compare_digest(value.encode(), given.encode(errors="replace")):
            found = role
    return found


def cookie_name(port: int) -> str:
    """Return the name of the cookie: browsers share cookies between the ports of a computer."""
    return f"eldorado_page_{port}"


def is_loopback(host: str) -> bool:
    """Return whether only programs of this computer reach the address."""
    try:
        return ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return host == "localhost"


def hosts_of(host: str, port: int, more: tuple[str, ...] = ()) -> frozenset[str]:
    """Return the accepted Host headers: those of loopback, of `host`, and `more` (names, with or without port).

    All others are refused, so a foreign name that is made to point here (DNS rebinding) opens nothing.
    """
    names = {*_LOOPBACK, f"[{host}]" if ":" in host and not host.startswith("[") else host}
    found = {f"{name}:{port}" for name in names} | ({*names} if port == 80 else set())
    return frozenset(one.lower() for one in (*found, *more, *(f"{name}:{port}" for name in more if ":" not in name)))


def origin_is_own(origin: str | None, host: str) -> bool:
    """Return whether an Origin header is that of the page itself. None: not sent, so no browser's foreign page."""
    if origin is None:
        return True
    try:
        parts = urlsplit(origin)
    except ValueError:
        return False
    return parts.scheme in ("http", "https") and parts.netloc.lower() == host.lower()
