"""Mirror of the rover's parameters for MAVLink, filled by `param list` and updated by the reports of `param set`.

MAVLink's names have at most 16 characters and its values are float32. Texts are therefore not mirrored, and a value set
by a ground program is sent as the shortest decimal for its float32 (0.09, not 0.0900000035762787).
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from ground.gateway.frames import mavlink as m
from onboard.toml_text import TomlError, parse_toml

NAME_BYTES = 16
_LINE = re.compile(r"^[ *] ([\w.]+) = (.*?)  # ")


class Parameter(NamedTuple):
    """Parameter in the mirror.

    id: MAVLink's name.
    name: the rover's name.
    value: as a float.
    kind: int, bool or float; all are sent as floats.
    """

    id: str
    name: str
    value: float
    kind: type


def short_name(name: str) -> str:
    """Return the id of a parameter's name: the whole name if it fits, else a short section and the key's consonants.

    Only capitals and underscores: ground programs convert typed names to capitals and group by the part before `_`.
    """
    whole = name.replace(".", "_").upper()
    if len(whole) <= NAME_BYTES:
        return whole
    section, _, key = name.partition(".")
    room, words = NAME_BYTES - 4, key.split("_")
    for joint in ("_", ""):
        lean = joint.join(word[:1] + re.sub("[aeiou]", "", word[1:]) for word in words)
        for fits in (joint.join(words), lean):
            if len(fits) <= room:
                return f"{section[:3]}_{fits}".upper()
    return f"{section[:3]}_{lean}"[:NAME_BYTES].upper()


def ids_of(names: Iterable[str]) -> dict[str, str]:
    """Return the names by id, in the order given. Of two equal ids the later one gets a number at its end."""
    found: dict[str, str] = {}
    for name in names:
        short, n = short_name(name), 2
        while short in found:
            short, n = f"{short_name(name)[: NAME_BYTES - 1 - len(str(n))]}~{n}", n + 1
        found[short] = name
    return found


def read_listing(text: str) -> dict[str, float | int | bool]:
    """Return numbers and truth values from the output of `param list`, in its order; texts and lists are left out."""
    found: dict[str, float | int | bool] = {}
    for line in text.splitlines():
        match = _LINE.match(line)
        if match is None:
            continue
        try:
            value = parse_toml(f"v = {match[2]}")["v"]
        except TomlError:
            continue
        if isinstance(value, (int, float)):
            found[match[1]] = value
    return found


def _single(value: float) -> float:
    return float(struct.unpack("<f", struct.pack("<f", value))[0])


class Mirror:
    """The known parameters. Empty until `fill`."""

    def __init__(self) -> None:
        self._rows: list[Parameter] = []
        self._at: dict[str, int] = {}

    def __len__(self) -> int:
        return len(self._rows)

    def fill(self, listing: str) -> None:
        """Load the output of `param list`."""
        values = read_listing(listing)
        by_name = {name: short for short, name in ids_of(values).items()}
        self._rows = [Parameter(by_name[name], name, float(v), type(v)) for name, v in values.items()]
        self._at = {row.id: i for i, row in enumerate(self._rows)}

    def find(self, short: str, index: int = -1) -> Parameter | None:
        """Return a parameter by id, or by index if that is 0 or more; None if there is none."""
        if index >= 0:
            return self._rows[index] if index < len(self._rows) else None
        return self._rows[self._at[short.upper()]] if short.upper() in self._at else None

    def keep(self, parameter: Parameter, value: float) -> Parameter:
        """Store a value that the rover has accepted."""
        made = parameter._replace(value=value)
        if parameter.id in self._at:
            self._rows[self._at[parameter.id]] = made
        return made

    def message(self, parameter: Parameter) -> Any:
        """Make PARAM_VALUE of one parameter."""
        at = self._at.get(parameter.id, _NO_INDEX)
        return m.MAVLink_param_value_message(
            parameter.id.encode(), parameter.value, m.MAV_PARAM_TYPE_REAL32, len(self._rows), at
        )

    def messages(self) -> list[Any]:
        """Make PARAM_VALUE of all parameters."""
        return [self.message(row) for row in self._rows]


_NO_INDEX = 65_535


def word(parameter: Parameter, value: float) -> str:
    """Return the value in the form that `param set` accepts. Raises ValueError if the parameter cannot have it."""
    if not np.isfinite(value):
        raise ValueError(f"{parameter.name}: {value} is no number")
    if parameter.kind is bool:
        if value not in (0.0, 1.0):
            raise ValueError(f"{parameter.name}: 0 or 1, found {value:g}")
        return "true" if value else "false"
    if parameter.kind is int:
        if value != round(value):
            raise ValueError(f"{parameter.name}: a whole number, found {value:g}")
        return str(round(value))
    return str(np.float32(value))


def same(parameter: Parameter, value: float) -> bool:
    """Return whether a float32 equals the value already known."""
    return _single(parameter.value) == _single(value)
