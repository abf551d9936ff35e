"""Orders typed or clicked on the page, checked before the link's thread has them. Pure."""

from __future__ import annotations

import math
import shlex

from ground.cli.verbs.table import ASKS
from protocol.tables import commands

LIFETIME_S = 60.0
_YES = "--yes"


def parsed(text: str) -> tuple[str, commands.Arguments, float]:
    """Return name, arguments and lifetime in s of a typed command. Raises ValueError with one line for people."""
    words = shlex.split(text)
    if words and words[0] == "ground":
        words = words[1:]
    sure = _YES in words
    words = [word for word in words if word != _YES]
    if not words:
        raise ValueError("type a command, for example: goto 8 3")
    name, arguments = commands.parse(words)
    if name in ASKS and not sure and not (name == "fence_clear" and arguments):
        raise ValueError(f"{ASKS[name]}; type `{text} {_YES}` to do it")
    return name, arguments, lifetime_s(name)


def goto(x_m: float | None, y_m: float | None) -> tuple[str, commands.Arguments, float]:
    """Return the order of a goto. Raises ValueError for a place that is none."""
    if x_m is None or y_m is None or not (math.isfinite(x_m) and math.isfinite(y_m)):
        raise ValueError("name a goal first: click the map, or type x and y")
    return "goto", commands.check("goto", {"x_m": float(x_m), "y_m": float(y_m)}), LIFETIME_S


def lifetime_s(name: str) -> float:
    """Return the lifetime of an order: what moves the rover is not begun later than 60 s after its issue."""
    return LIFETIME_S if commands.command(name).moves else 0.0


def who(role: str, address: str) -> str:
    """Return the origin of an order for the archive, at most 60 characters."""
    return f"page {role} {address}"[:60]
