"""Trees of the page as differences: made and rendered once for all browsers, with what has changed only. Pure.

    tree n-1, tree n  ->  {"number": n, "whole": false, "now_s": ..., changed parts, "values": {changed fields}}
    a browser without tree n-1  ->  the whole tree n, "whole": true

The browser (static/ages.js) adds a difference to its tree if that is the one before, and asks for a whole one if not.
"""

from __future__ import annotations

import json
from typing import Any

ALWAYS = ("now_s", "utc_s")  # an empty difference still says that the server lives
APART = "events"  # these go to a table of their own
PAST = -2  # number of a tree of a past run: before that of any live one by more than one


class TreeFeed:
    """Newest tree with its number, the difference from the one before, and both as text."""

    def __init__(self, tree: dict[str, Any]) -> None:
        self._number, self._tree, self._texts = 0, _without_events(tree), ["", ""]
        self.events: list[dict[str, Any]] = tree[APART]

    @property
    def number(self) -> int:
        """Number of the newest tree."""
        return self._number

    def take(self, tree: dict[str, Any]) -> None:
        """Take a newer tree."""
        fresh = _without_events(tree)
        change = {"number": self._number + 1, "whole": False, **difference(self._tree, fresh)}
        self._number, self._tree, self.events = self._number + 1, fresh, tree[APART]
        self._texts = [json.dumps(change), ""]

    def whole(self) -> dict[str, Any]:
        """Return the newest tree, for a browser that has none."""
        return {"number": self._number, "whole": True, **self._tree}

    def text(self, number: int) -> str:
        """Return the JSON that brings a browser from tree `number` to the newest; "": it has the newest."""
        if number == self._number:
            return ""
        if number == self._number - 1:
            return self._texts[0]
        if not self._texts[1]:
            self._texts[1] = json.dumps(self.whole())
        return self._texts[1]


def past_text(tree: dict[str, Any]) -> str:
    """Return the JSON of a tree of a past run."""
    return json.dumps({"number": PAST, "whole": True, **_without_events(tree)})


def difference(old: dict[str, Any], new: dict[str, Any]) -> dict[str, Any]:
    """Return the parts of `new` that are not those of `old`, the values field by field, and the time."""
    changed = {name: part for name, part in new.items() if name in ALWAYS or part != old.get(name)}
    if "values" in changed:
        before = old.get("values", {})
        changed["values"] = {
            name: _fields(before.get(name, {}), one) for name, one in new["values"].items() if one != before.get(name)
        }
    return changed


def _fields(old: dict[str, Any], new: dict[str, Any]) -> dict[str, Any]:
    """Return the fields of a value that differ: of a steady one only its time."""
    return {key: one for key, one in new.items() if key not in old or one != old[key]}


def _without_events(tree: dict[str, Any]) -> dict[str, Any]:
    return {name: part for name, part in tree.items() if name != APART}
