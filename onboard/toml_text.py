"""TOML parser for text of any origin, bounded in size and depth, with one kind of error; the only use of tomllib.

Python's parser recurses one call deeper for each bracket and dot, and its numbers may be longer than Python prints.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

MOST_BYTES = 1 << 20  # a whole configuration with its comments has 30 kB
DEEPEST = 12
LARGEST = 2**63  # bound of whole numbers, by TOML
_SHOWN = 80


class TomlError(ValueError):
    """The text is not TOML, or exceeds a bound; one line, without the file's name."""


def parse_toml(text: str) -> dict[str, Any]:
    """Parse a text and return its tables. Raises TomlError."""
    if len(text) > MOST_BYTES:
        raise TomlError(f"longer than {MOST_BYTES} characters")
    try:
        tree = tomllib.loads(text)
    except RecursionError:
        raise TomlError("nested too deep") from None
    except ValueError as error:  # TOMLDecodeError is one; so is a number of more digits than int() reads
        raise TomlError(" ".join(str(error).split())[:200]) from None
    _check(tree)
    return tree


def read_toml(path: Path) -> dict[str, Any]:
    """Parse a file and return its tables. Raises TomlError, OSError."""
    with path.open("rb") as file:
        data = file.read(MOST_BYTES + 1)
    try:
        return parse_toml(data.decode())
    except UnicodeDecodeError as error:
        raise TomlError(str(error)) from None


def shown(item: object) -> str:
    """Text of a value for a message: Python's repr, cut if it is long."""
    text = repr(item)
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]}..."


def _check(tree: dict[str, Any]) -> None:
    """Refuse nesting over the bound, and numbers that TOML does not allow. Raises TomlError."""
    level: list[Any] = [tree]
    for _ in range(DEEPEST):
        inside = [item for each in level for item in (each.values() if isinstance(each, dict) else each)]
        if any(isinstance(item, int) and abs(item) > LARGEST for item in inside):
            raise TomlError("a whole number of more than 64 bits")
        level = [item for item in inside if isinstance(item, dict | list)]
    if level:
        raise TomlError(f"nested more than {DEEPEST} deep")
