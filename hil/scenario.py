"""A scenario: terrain, seed, link profile, operator's script, timed faults, limits. A TOML file, checked when read."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hil.impairment import load_profile
from onboard.config import ConfigError, from_tree, load, value
from onboard.records import Pose

WHEN = ("time", "sweep", "drive")


@dataclass(frozen=True, slots=True)
class Injection:
    """One fault: `fault` is a row of hil.injection, begun `after_s` seconds after `when` first holds, for `for_s`."""

    fault: str = value("", "row of hil.injection.INJECTIONS")
    when: str = value("time", "start of the count: time, first sweep, first drive", one_of=WHEN)
    after_s: float = value(0.0, "seconds after that", low=0, high=1e6)
    for_s: float = value(1e9, "how long", low=0, high=1e9)
    target: int = value(0, "wheel, node, CAN id or percent, as the fault needs", low=0, high=0x7FF)


@dataclass(frozen=True, slots=True)
class Scenario:
    """What a run is; `script` may use {goal_x} and {goal_y}. `set`: onboard's values by dotted name."""

    name: str = value("demo", "name in reports")
    terrain: str = value("fbm", "a row of hil.grounds.GROUNDS", one_of=("fbm", "craters", "real", "flat", "yard"))
    seed: int = value(1, "the n-th accepted field", low=1, high=1_000_000)
    link: str = value("ets8-b", "row of hil/link_profiles.toml")
    blackout_s: tuple[float, ...] = ()
    script: str = value("at 2.0: goto {goal_x} {goal_y}\nwait goto\nget ldem\n", "what the operator does")
    limit_s: float = value(1200.0, "bench time after which the run is ended", low=1, high=1e6)
    end_s: float = value(0.0, "end after this much bench time; 0: when the script is done", low=0, high=1e6)
    live: bool = value(False, "no scripted operator: a live ground station may join; the run does not repeat")
    can: str = value("hub", "the CAN bus: the bench's hub, or socketcan:INTERFACE of this machine")
    faults: tuple[Injection, ...] = ()
    set: Mapping[str, Any] = field(default_factory=dict)


def load_scenario(path: Path) -> Scenario:
    """Read a scenario file. Raises FileNotFoundError, ConfigError (file, key, value, suggestion)."""
    try:
        tree = tomllib.loads(path.read_text())
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: not valid TOML: {error}") from error
    faults = tuple(from_tree(Injection, row, str(path), "faults.") for row in tree.pop("faults", []))
    settings = _settings(tree.pop("set", {}), path)
    blackout = tuple(float(v) for v in tree.pop("blackout_s", ()))
    if len(blackout) % 2:
        raise ConfigError(f"{path}: `blackout_s` should be pairs of start and end, found {blackout}")
    plain = from_tree(Scenario, tree, str(path))
    fields = {name: getattr(plain, name) for name in Scenario.__dataclass_fields__}
    return Scenario(**{**fields, "faults": faults, "set": settings, "blackout_s": blackout})


def flight_settings(scenario: Scenario, start: Pose) -> dict[str, Any]:
    """The flight program's values by dotted name, the same on sockets and in one process; `set` has the last word."""
    return {
        "localisation.start_x_m": start.x_m, "localisation.start_y_m": start.y_m,
        "localisation.start_yaw_rad": start.yaw_rad, "link.bench_seed": scenario.seed,
        "link.rate_bps": load_profile(scenario.link).down_bps, **scenario.set,
    }


def _settings(table: Any, path: Path) -> dict[str, Any]:
    """The table `[set]` by dotted names, of values that the flight program takes."""
    if not isinstance(table, Mapping):
        raise ConfigError(f"{path}: `set` should be a table, found {table!r}")
    settings = dict(_dotted(table, ""))
    load(None, settings, f"{path}: [set]")
    return settings


def _dotted(table: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, Any]]:
    """Nested tables as dotted names: TOML reads an unquoted `mapping.folder` as a table in a table."""
    for key, item in table.items():
        if isinstance(item, Mapping):
            yield from _dotted(item, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", item
