"""Declaration of configuration values, and their check against a parsed table.

A tree is frozen dataclasses whose leaves are fields made by `value(...)` and whose branches are such dataclasses.
"""

from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Mapping
from dataclasses import field
from typing import Any, TypeVar, get_type_hints

from onboard.toml_text import LARGEST, shown

T = TypeVar("T")
_LONGEST = 100  # characters of a name or word for which a similar one is searched


_HEAD, _TAIL = 1200, 600  # characters of a long error text that are shown


class ConfigError(ValueError):
    """The start is refused; the text is one helpful line; a very long one is cut in the middle."""

    def __init__(self, text: str) -> None:
        super().__init__(text if len(text) <= _HEAD + _TAIL else f"{text[:_HEAD]} … {text[-_TAIL:]}")


AT_ONCE, NEXT_MISSION, RESTART = "at once", "with the next mission", "with a restart"


def value(
    default: Any,
    meaning: str,
    *,
    low: float | None = None,
    high: float | None = None,
    one_of: tuple[str, ...] = (),
    takes: str = "",
) -> Any:
    """Declare a field of the configuration with its default, meaning and range (its name ends with the unit).

    takes: time at which a change in flight takes effect, if it differs from the section's.
    """
    metadata = {"meaning": meaning, "low": low, "high": high, "one_of": one_of, "takes": takes}
    return field(default=default, metadata=metadata)


def section(kind: type[Any], takes: str = RESTART) -> Any:
    """Declare a part of the configuration. takes: when changes of its values take effect; RESTART: not in flight."""
    return field(default_factory=kind, metadata={"takes": takes})


def from_tree(kind: type[T], tree: Mapping[str, Any], where: str, prefix: str = "") -> T:
    """Build a frozen dataclass declared with `value(...)` from a parsed TOML table. Raises ConfigError."""
    hints, known = get_type_hints(kind), {f.name: f for f in dataclasses.fields(kind)}  # type: ignore[arg-type]
    made: dict[str, Any] = {}
    for key, item in tree.items():
        name = f"{prefix}{key}"
        if key not in known:
            raise ConfigError(f"{where}: unknown key `{name[:_LONGEST]}`{_suggestion(key, known, prefix)}")
        if dataclasses.is_dataclass(hints[key]):
            if not isinstance(item, Mapping):
                raise ConfigError(f"{where}: `{name}` should be a table, found {shown(item)}")
            made[key] = from_tree(hints[key], item, where, f"{name}.")
        else:
            made[key] = _checked(item, hints[key], known[key], f"{where}: `{name}`")
    return kind(**made)


def _suggestion(key: str, known: Mapping[str, Any], prefix: str) -> str:
    near = difflib.get_close_matches(key[:_LONGEST], known, n=1)
    if near:
        return f"; did you mean `{prefix}{near[0]}`?"
    return f"; known here: {', '.join(sorted(known))}"


def _checked(item: Any, kind: type, row: dataclasses.Field[Any], what: str) -> Any:
    if kind is float and isinstance(item, int) and not isinstance(item, bool) and abs(item) <= LARGEST:
        item = float(item)
    if not isinstance(item, kind) or (isinstance(item, bool) and kind is not bool):
        raise ConfigError(f"{what} should be {kind.__name__}, found {shown(item)}")
    low, high, one_of = (row.metadata.get(k) for k in ("low", "high", "one_of"))
    if one_of and item not in one_of:
        near = difflib.get_close_matches(str(item)[:_LONGEST], one_of, n=1)
        raise ConfigError(
            f"{what} = {shown(item)} should be one of {', '.join(one_of)}"
            + (f"; did you mean {near[0]!r}?" if near else "")
        )
    if isinstance(item, (int, float)) and not isinstance(item, bool):
        too_low, too_high = low is not None and item < low, high is not None and item > high
        if too_low or too_high or item != item:
            raise ConfigError(f"{what} = {shown(item)} is out of range {low} to {high}")
    return item
