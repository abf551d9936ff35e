"""Configuration as text: for `onboard run --print-config`, the record and `param list`."""

from __future__ import annotations

import dataclasses
from typing import Any


def to_toml(config: Any) -> str:
    """Write the tree as TOML with meaning and range of each value as comments; `load` reads it back unchanged."""
    lines: list[str] = []
    for section in dataclasses.fields(config):
        lines += ["", f"[{section.name}]"]
        part = getattr(config, section.name)
        for row in dataclasses.fields(part):
            comment = f"{row.metadata['meaning']}{allowed(row.metadata)}"
            lines.append(f"{row.name} = {word(getattr(part, row.name))}  # {comment}")
    return "\n".join(lines).strip() + "\n"


def allowed(metadata: Any) -> str:
    """` (low to high)` or ` (one | other)` of a field's metadata; '' without limits."""
    low, high, one_of = (metadata[k] for k in ("low", "high", "one_of"))
    return f" ({' | '.join(one_of)})" if one_of else f" ({low:g} to {high:g})" if low is not None else ""


def word(item: Any) -> str:
    """A value as a TOML word."""
    if isinstance(item, bool):
        return "true" if item else "false"
    if isinstance(item, str):
        return '"' + "".join(map(_in_quotes, item)) + '"'
    return repr(item)


def _in_quotes(character: str) -> str:
    """A character of a TOML text; control characters are escaped, TOML allows none."""
    if character in '"\\':
        return "\\" + character
    return character if character.isprintable() else f"\\U{ord(character):08x}"
