"""Checks of archive rows before they are used: a file may be damaged, or come from another program."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Sequence
from typing import Any

from ground.archive.schema import DATA, ArchiveError
from protocol.link.transactions import RequestState
from protocol.tables.modes import SEVERITIES

_KINDS: dict[str, tuple[type, ...]] = {
    "integer": (int, type(None)), "text": (str, type(None)), "blob": (bytes, type(None)),
    "": (int, float, type(None)),
}  # fmt: skip
_MOST_NS = 1 << 62
_TIMES = ("utc_ns", "at_ns", "onboard_ns")
_NEEDED = (
    "utc_ns",
    "at_ns",
    "name",
    "severity",
    "state",
    "request_id",
    "station",
    "serial",
    "arguments",
    "direction",
    "verdict",
)


class RowCheck:
    """Check of the rows of one table."""

    def __init__(self, db: sqlite3.Connection, table: str, names: Sequence[str]) -> None:
        declared = {row[1]: row[2].lower() for row in db.execute(f"pragma table_info({table})")}
        self._table, self._names = table, names
        self._kinds = [_KINDS.get(declared.get(name, "integer"), _KINDS[""]) for name in names]

    def __call__(self, row: Sequence[Any]) -> dict[str, Any]:
        """Return the row as a dictionary by column name. Raises ArchiveError."""
        for name, value, kinds in zip(self._names, row, self._kinds):
            if type(value) not in kinds or (value is None and name in _NEEDED):
                raise damaged(self._table, name, value)
            if name in _TIMES and value is not None and not -_MOST_NS <= value <= _MOST_NS:
                raise damaged(self._table, name, value)
        tree = dict(zip(self._names, row))
        if self._table == "events" and tree["severity"] not in SEVERITIES:
            raise damaged(self._table, "severity", tree["severity"])
        if self._table == "reports":
            check_state(tree["state"])
        if self._table == "requests":
            arguments_of(tree["arguments"])
        return tree


def check_time(table: str, at_ns: Any) -> None:
    """Raises ArchiveError unless `at_ns` is None or a time in ns between -2^62 and 2^62."""
    if at_ns is not None and (type(at_ns) is not int or not -_MOST_NS <= at_ns <= _MOST_NS):
        raise damaged(table, "at_ns", at_ns)


def check_state(state: Any) -> None:
    """Raises ArchiveError unless `state` is the name of a request state."""
    if not isinstance(state, str) or state not in RequestState.__members__:
        raise damaged("reports", "state", state)


def arguments_of(text: str) -> dict[str, Any]:
    """Decode the arguments of a request from JSON. Raises ArchiveError."""
    try:
        tree = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise damaged("requests", "arguments", text) from error
    if not isinstance(tree, dict):
        raise damaged("requests", "arguments", text)
    return tree


def damaged(table: str, column: str, value: Any) -> ArchiveError:
    """Build the error that names a damaged table and column."""
    shown = repr(value)
    return ArchiveError(
        f"damaged: {table}.{column} holds {shown[:60]}; move it away and a new one is "
        "begun; `sqlite3 FILE .recover` saves what can be read",
        DATA,
    )
