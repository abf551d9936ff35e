"""Kinds of film, and the check that one can be made here: run before a run, not after it."""

from __future__ import annotations

import shutil
from pathlib import Path

KINDS = (".webp", ".gif", ".mp4")


class KindError(ValueError):
    """A film of this kind cannot be written here; the text names the kinds that can."""


def check_kind(path: Path) -> None:
    """Raise KindError if no film can be written under this name."""
    if path.suffix not in KINDS:
        raise KindError(f"{path}: a film is one of {', '.join(KINDS)}")
    if path.suffix == ".mp4" and shutil.which("ffmpeg") is None:
        raise KindError(f"{path}: an .mp4 needs ffmpeg, which is not installed; .webp needs nothing")
