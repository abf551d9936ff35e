"""Folder of a run: new, empty or from an earlier run. Files that no run made are neither removed nor overwritten.

A marker file identifies a run's folder. Older folders without marker are identified by truth.mcap, which nothing else
writes.
"""

from __future__ import annotations

import shutil
from pathlib import Path

from onboard.config import ConfigError

MARKER = ".hil-run"
_OLD_MARK, _LOCK = "truth.mcap", ".lock"
KEPT = ("state", "mapping")  # folders that outlive the flight program
_WORDS = "The bench's runs write into this folder, and remove what earlier ones left in it.\n"


def check(folder: Path) -> None:
    """Raise ConfigError if a run may not use the folder."""
    if not folder.exists():
        return
    if not folder.is_dir():
        raise ConfigError(f"{folder} is no folder; name another one with --out")
    names = {path.name for path in folder.iterdir()}
    if names - {_LOCK} and not names & {MARKER, _OLD_MARK}:
        first = sorted(names - {_LOCK})[0]
        raise ConfigError(
            f"{folder} holds `{first}`, and no run made it (there is no {MARKER}): a run would write "
            "over what is there; name another folder with --out"
        )


def cleared(folder: Path) -> None:
    """Create or clean the folder and mark it. Removes files of an earlier run that this one must not find.

    Raises ConfigError. Links are removed, never followed.
    """
    check(folder)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / MARKER).write_text(_WORDS)
    for part in ("ground", *KEPT):  # counters, state and map of an earlier run
        if not (folder / part).is_symlink():
            shutil.rmtree(folder / part, ignore_errors=True)
    for path in folder.iterdir():
        if path.is_symlink() or path.match("onboard-boot*.mcap"):
            path.unlink()
