"""Parameters: the keys of the configuration as an operator sees them in flight, and the changes made to them.

Names, ranges, meanings and the time at which a change takes effect all come from `onboard.config`: there is no second
list. The saved form is JSON: {"version": 3, "values": {name: TOML word}, "changes": [...]}; values are those that an
order changed.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

from onboard.config import RESTART, Config, ConfigError, from_tree
from onboard.config_text import allowed, word
from onboard.toml_text import TomlError, parse_toml
from protocol.tables.commands import named

MOST_CHANGES = 256


@dataclass(frozen=True, slots=True)
class Parameter:
    """One key. takes: when a change takes effect (`onboard.config`); RESTART: it cannot be set in flight."""

    section: str
    key: str
    takes: str
    about: str  # its range and meaning

    @property
    def name(self) -> str:
        """Name as in `--set`."""
        return f"{self.section}.{self.key}"


def _rows() -> dict[str, Parameter]:
    rows = []
    for section in dataclasses.fields(Config):
        for key in dataclasses.fields(getattr(Config(), section.name)):
            takes = key.metadata["takes"] or section.metadata["takes"]
            about = f"{allowed(key.metadata).strip(' ()') or 'text'}; {key.metadata['meaning']}"
            rows.append(Parameter(section.name, key.name, takes, about))
    return {row.name: row for row in rows}


TABLE: Mapping[str, Parameter] = MappingProxyType(_rows())


@dataclass(frozen=True, slots=True)
class Change:
    """One change of a parameter.

    version: made by this change.
    name: of the parameter.
    old, new: values as TOML words.
    at_ns, boot: onboard time and start number.
    station: key id of the station that ordered it.
    """

    version: int
    name: str
    old: str
    new: str
    at_ns: int
    boot: int
    station: int

    def __str__(self) -> str:
        where = f"at {self.at_ns / 1e9:.1f} s of boot {self.boot} by station {self.station}"
        return f"version {self.version}: {self.name} {self.old} -> {self.new} {where}"


@dataclass(frozen=True, slots=True)
class ParameterSet:
    """A configuration and the changes that led to it.

    config: with the changes.
    version: count of the changes.
    values: name -> TOML word, of changed parameters.
    changes: the newest 256.
    """

    config: Config
    version: int = 0
    values: Mapping[str, str] = field(default_factory=dict)
    changes: tuple[Change, ...] = ()

    def value(self, name: str) -> str:
        """A parameter's value as a TOML word. Raises ValueError for an unknown name."""
        row = TABLE[named(name, TABLE, "parameter")]
        return word(getattr(getattr(self.config, row.section), row.key))

    def last(self, name: str) -> Change | None:
        """Newest change of a parameter, or None."""
        return next((change for change in reversed(self.changes) if change.name == name), None)

    def set(self, name: str, text: str, who: tuple[int, int, int]) -> ParameterSet:
        """Return the settings with one parameter changed. who: onboard time ns, boot, station.

        Raises ValueError with what is allowed: an unknown name, a value out of range, one that needs a restart.
        """
        old, config = self.value(name), changed(self.config, name, text)
        at_ns, boot, station = who
        made = replace(self, config=config, version=self.version + 1)
        change = Change(made.version, name, old, made.value(name), at_ns, boot, station)
        values = {**self.values, name: change.new}
        return replace(made, values=values, changes=(*self.changes, change)[-MOST_CHANGES:])

    def to_json(self) -> bytes:
        """Return the saved form."""
        changes = [dataclasses.asdict(change) for change in self.changes]
        return json.dumps({"version": self.version, "values": dict(self.values), "changes": changes}).encode()


def changed(config: Config, name: str, text: str) -> Config:
    """Return the configuration with one key set to a TOML word or plain text. Raises ValueError as ParameterSet.set."""
    row = TABLE[named(name, TABLE, "parameter")]
    if row.takes == RESTART:
        raise ValueError(f"{name} changes {RESTART} only: set it in the configuration file")
    part = getattr(config, row.section)
    checked: Any = from_tree(type(part), {row.key: _plain(text)}, "param set", f"{row.section}.")
    return replace(config, **{row.section: replace(part, **{row.key: getattr(checked, row.key)})})


def _plain(text: str) -> Any:
    try:
        return parse_toml(f"v = {text}")["v"]
    except TomlError:
        return text


def recalled(config: Config, kept: bytes) -> tuple[ParameterSet, list[str]]:
    """Apply saved settings to this configuration; return them and a line for each that this program does not take."""
    if not kept:
        return ParameterSet(config), []
    try:
        tree = json.loads(kept)
        changes = tuple(Change(**change) for change in tree["changes"])
        version, values = int(tree["version"]), {str(k): str(v) for k, v in tree["values"].items()}
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        return ParameterSet(config), [f"the kept parameters cannot be read: {error!r}"]
    dropped = []
    for name, text in list(values.items()):
        try:
            config = changed(config, name, text)
        except (ValueError, ConfigError) as error:
            dropped.append(f"dropped {name}: {error}")
            del values[name]
    return ParameterSet(config, version, values, changes), dropped


def listing(settings: ParameterSet) -> str:
    """List all parameters with value, range, meaning and time of effect, then the changes made."""
    lines = [f"# version {settings.version}"]
    for name, row in TABLE.items():
        mark = "*" if name in settings.values else " "
        lines.append(f"{mark} {name} = {settings.value(name)}  # {row.about}; {row.takes}")
    return "\n".join([*lines, *(f"# {change}" for change in settings.changes)]) + "\n"
