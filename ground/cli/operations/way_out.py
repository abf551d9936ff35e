"""Advice for a refused command: the commands that lead from the rover's mode to one that accepts it."""

from __future__ import annotations

import difflib
import re
from collections.abc import Collection

from protocol.tables import commands
from protocol.tables.modes import TRANSITIONS, Mode

_REFUSED = re.compile(r" is refused in ([A-Z]+):")
_UNKNOWN = re.compile(r"unknown ([\w ]+) `([^`]*)`; known: (.+)")
_MOST_NAMES, _LIKE = 3, 0.4


def way_out(name: str, mode: Mode) -> list[str]:
    """Return the commands to give first, as typed, the fewest; none if no commands that stand still lead there."""
    allowed = commands.command(name).modes
    known = {row.name for row in commands.TABLE if not row.moves}
    reached: dict[Mode, list[str]] = {mode: []}
    front = [mode]
    while front:
        here = front.pop(0)
        if here in allowed and here is not mode:
            return [commands.command(step).typed for step in reached[here]]
        for way in TRANSITIONS:
            if way.state is here and way.event in known and way.next not in reached:
                reached[way.next] = [*reached[here], way.event]
                front.append(way.next)
    return []


def refusal_words(name: str, text: str) -> str:
    """Return the last line after a refusal: the mode, and what to do first. text: of the rover's report."""
    found = _REFUSED.search(text)
    typed = commands.command(name).typed
    if found is None or found[1] not in Mode.__members__:
        return f"{typed} was refused: {text}"
    steps = way_out(name, Mode[found[1]])
    first = " and ".join(f"`ground {step}`" for step in steps)
    return f"{typed} was refused: the rover is in {found[1]}" + (f"; {first} first, then again" if steps else "")


def near_names(name: str, known: Collection[str]) -> str:
    """Return the names that are most like this one, for an error text; if none is like it, the first of all."""
    low = name.lower()
    near = [one for one in known if low and low in one.lower()][:_MOST_NAMES]
    upper = {one.upper(): one for one in known}
    near = near or [upper[one] for one in difflib.get_close_matches(name.upper(), upper, _MOST_NAMES, _LIKE)]
    if near:
        return "did you mean " + " or ".join(f"`{one}`" for one in near) + "?"
    first = ", ".join(list(known)[:_MOST_NAMES])
    return f"there are {len(known)}, as {first} ..." if len(known) > _MOST_NAMES else f"known: {first or 'none'}"


def shorter(text: str) -> str:
    """Return an error text of `protocol.tables.commands.named` with the most similar names in place of all names."""
    return _UNKNOWN.sub(
        lambda found: f"unknown {found[1]} `{found[2]}`; {near_names(found[2], found[3].split(', '))}", text
    )
