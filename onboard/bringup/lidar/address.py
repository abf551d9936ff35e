"""Address of a scanner as people type it."""

from __future__ import annotations

from pathlib import Path


def address_of(text: str) -> str:
    """Address in the form that the ports accept: a path alone is a tty, and paths are absolute."""
    kind, mark, path = text.partition(":")
    if mark and kind != "tty":
        return text
    path = path if mark else text
    is_path = mark or "/" in path or Path(path.partition("@")[0]).exists()
    return f"tty:{Path(path).absolute()}" if path and is_path else text
