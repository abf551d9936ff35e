"""What the values of an archive's rows may be. SQLite takes any value in any column, so a damaged file shows here."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from ground.archive.schema import DATA, ArchiveError
from protocol.modes import SEVERITIES
from protocol.transactions import State

_NONE = type(None)
_KINDS: dict[str, tuple[type, ...]] = {
    "name": (str,), "state": (str,), "severity": (str,), "value": (int, float, _NONE), "data": (bytes,),
    "payload": (bytes, _NONE), "direction": (str,), "verdict": (str,), "codec": (str,),
    **dict.fromkeys(("utc_ns", "at_ns", "run", "request_id", "station", "serial", "number", "object_id"), (int,)),
    **dict.fromkeys(("onboard_ns", "counter", "boot_id", "filled", "code"), (int, _NONE)),
    **dict.fromkeys(("arguments", "text", "asked_by"), (str, _NONE)),
}  # fmt: skip
_WORDS = {"state": frozenset(state.name for state in State), "severity": frozenset(SEVERITIES)}


def check_arguments(text: str) -> None:
    """Raises ArchiveError where a request's arguments are no JSON object."""
    try:
        sound = isinstance(json.loads(text or "{}"), dict)
    except (ValueError, RecursionError):
        sound = False
    if not sound:
        raise ArchiveError(f"damaged: `arguments` of a row of requests is {text!r:.60}", DATA)


def check(table: str, names: Sequence[str], row: Sequence[Any]) -> None:
    """Raises ArchiveError for a value that no station writes."""
    for name, value in zip(names, row):
        kinds = (str, _NONE) if table == "reports" and name == "data" else _KINDS[name]
        words = _WORDS.get(name)
        if not isinstance(value, kinds) or (words and value not in words):
            raise ArchiveError(f"damaged: `{name}` of a row of {table} is {value!r:.60}; export the tables that are "
                               "sound, or move the file away and a new one is begun", DATA)
