"""Scenario: ground, seed, link profile, operator's script, timed faults, limits, promises. A TOML file, validated."""

from __future__ import annotations

import difflib
import json
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from hil.devices.can.errors import SensorErrors
from hil.devices.lidar.errors import LidarErrors, lidar_errors
from hil.devices.lidar.profile import Profile, stamp_to_first_byte_ns
from hil.faults.plan import Injection
from hil.link.impairment import load_profile
from hil.plant.rays.casters import CASTERS, DEFAULT
from hil.plant.soil import CLASSES
from hil.scenarios.verdicts import Expect, expect_of
from hil.terrain import field_file
from hil.terrain.field import Field, inside
from hil.terrain.fields import AcceptedField
from hil.terrain.grounds import GROUNDS
from hil.world.fitting import Fitting
from onboard.config import ConfigError, Lidar, from_tree, load, value
from onboard.records import Pose
from onboard.toml_text import TomlError, read_toml, shown

LAG_GOAL_NS = 200_000  # `onboard lidar lag` is accurate to this
PATHS = (
    "record.path",
    "mapping.folder",
    "state.folder",
    "mission.gdem",
    "link.command_keys",
    "link.downlink_key",
    "status.socket",
)  # of the flight program's values: files and folders
_NO_PATH = {"status.socket": ("auto", "off")}
_NAME = re.compile(r"\w[\w .+-]{0,99}")
_WORD = re.compile(r"\{(goal_x|goal_y)\}")
_NUMBERS = (
    ("blackout_s", (), "pairs of start and end"), ("start", (0, 3), "x, y in metres and yaw in degrees"),
    ("goal", (0, 2), "x, y in metres"),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Scenario:
    """Conditions of a run.

    blackout_s: pairs of start and end of link blackouts
    start: (x, y, yaw in degrees) in place of the ground's own start, in its frame
    goal: (x, y) in place of the ground's own goal, in its frame
    script: may use {goal_x} and {goal_y}
    sensors: errors of the nodes, a table of hil.devices.can.errors
    lidar: the scanner, a table of hil.devices.lidar.errors
    faults: faults to inject
    set: onboard's settings by dotted name
    expect: promises
    """

    name: str = value("demo", "name in reports")
    about: str = value("", "one sentence: what happens, and what the rover does about it")
    terrain: str = value("fbm", "a row of GROUNDS (hil/terrain), or a field.npz of a run, from the scenario's folder")
    seed: int = value(1, "the n-th accepted field", low=1, high=1_000_000)
    link: str = value("ets8-b", "row of hil/link/profiles.toml")
    blackout_s: tuple[float, ...] = ()
    start: tuple[float, ...] = ()
    goal: tuple[float, ...] = ()
    script: str = value("at 2.0: goto {goal_x} {goal_y}\nwait goto\nget ldem\n", "what the operator does")
    limit_s: float = value(1200.0, "bench time after which the run is ended", low=1, high=1e6)
    end_s: float = value(0.0, "end after this much bench time; 0: when the script is done", low=0, high=1e6)
    live: bool = value(False, "no scripted operator: a live ground station may join; the run does not repeat")
    can: str = value("hub", "the CAN bus: the bench's hub, or socketcan:INTERFACE of this machine")
    rays: str = value(DEFAULT, "caster of the scanner's rays: a row of hil.plant.rays.casters", one_of=tuple(CASTERS))
    soil: str = value("nominal", "all over the ground: a row of hil.plant.soil.CLASSES", one_of=tuple(CLASSES))
    sensors: Mapping[str, Any] = field(default_factory=dict)
    lidar: Mapping[str, Any] = field(default_factory=dict)
    faults: tuple[Injection, ...] = ()
    set: Mapping[str, Any] = field(default_factory=dict)
    expect: Expect = Expect()


def load_scenario(path: Path) -> Scenario:
    """Read a scenario file. Raises FileNotFoundError, ConfigError (file, key, value, suggestion)."""
    try:
        tree = read_toml(path)
    except TomlError as error:
        raise ConfigError(f"{path}: not valid TOML: {error}") from error
    where = str(path)
    faults = tuple(from_tree(Injection, row, where, "faults.") for row in tree.pop("faults", []))
    parts: dict[str, Any] = {"faults": faults, "set": _settings(tree.pop("set", {}), path)}
    parts["sensors"] = tree.pop("sensors", {})
    sensor_errors(parts["sensors"], where)
    parts["lidar"] = tree.pop("lidar", {})
    scanner_of(parts["lidar"], where)
    parts["expect"] = expect_of(tree.pop("expect", {}), where)
    for key, counts, of in _NUMBERS:
        parts[key] = _numbers(tree.pop(key, []), counts, f"{where}: `{key}` should be {of}")
    if "seed" not in tree:
        raise ConfigError(f"{where}: `seed` is missing: the same seed gives the same run")
    plain = from_tree(Scenario, tree, where)
    _refuse(plain.name, plain.script, parts["set"], where)
    return replace(plain, **parts, terrain=_terrain(plain.terrain, path))


def _numbers(items: Any, counts: tuple[int, ...], what: str) -> tuple[float, ...]:
    """Check a list of numbers. counts: allowed lengths; empty: any even length. Raises ConfigError."""
    if not isinstance(items, list) or not all(isinstance(v, int | float) and v == v for v in items):
        raise ConfigError(f"{what}, found {shown(items)}")
    if len(items) not in counts if counts else len(items) % 2:
        raise ConfigError(f"{what}, found {shown(items)}")
    return tuple(float(v) for v in items)


def _refuse(name: str, script: str, settings: Mapping[str, Any], where: str) -> None:
    """Reject a file that names a run folder outside the runs' folder or writes there. Raises ConfigError."""
    if not _NAME.fullmatch(name):
        raise ConfigError(
            f"{where}: `name` = {name!r} should be letters, digits, spaces and . + - _, 100 at most, and "
            "begin with a letter or digit: the run's folder is called so"
        )
    if any(sign in _WORD.sub("", script) for sign in "{}"):
        raise ConfigError(f"{where}: `script` may use {{goal_x}} and {{goal_y}}, and no other braces")
    for key in PATHS:
        place = settings.get(key, "")
        if place and (Path(place).is_absolute() or ".." in Path(place).parts or place[0] == "~" or "\0" in place):
            raise ConfigError(
                f"{where}: [set] `{key}` = {place!r} leads out of the run's folder; name a place in it, "
                f"or give it on the command line: hil run --set {key}={place}"
            )


def paths_in(folder: Path, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Settings with their relative paths resolved against the folder of a run."""
    places = {
        key: str((folder / settings[key]).absolute())
        for key in PATHS
        if settings.get(key, "") not in ("", *_NO_PATH.get(key, ()))
    }
    return {**settings, **places}


def _terrain(name: str, path: Path) -> str:
    """Name of a row of GROUNDS, or path of a file relative to the scenario's folder. Raises ConfigError."""
    if name in GROUNDS:
        return name
    if not name.endswith(".npz"):
        near = difflib.get_close_matches(name, GROUNDS, n=1)
        raise ConfigError(
            f"{path}: `terrain` = {name!r} should be one of {', '.join(GROUNDS)}, or a file.npz"
            + (f"; did you mean {near[0]!r}?" if near else "")
        )
    file = path.parent / name
    if not file.is_file():
        raise ConfigError(f"{path}: `terrain`: no such file: {file}")
    return str(file)


def scenario_of(tree: Mapping[str, Any]) -> Scenario:
    """Build a scenario from its fields in a certificate. Raises KeyError, TypeError, ValueError, ConfigError.

    Certificates from before the table [lidar] existed used the ideal scanner.
    """
    parts = {
        "faults": tuple(Injection(**row) for row in tree["faults"]),
        "set": dict(tree["set"]),
        "expect": Expect(**{k: tuple(v) if isinstance(v, list) else v for k, v in tree["expect"].items()}),
        **{key: tuple(tree[key]) for key, *_ in _NUMBERS},
        "lidar": tree.get("lidar", {"profile": "ideal"}),
    }
    scenario = Scenario(**{**tree, **parts})
    _refuse(scenario.name, scenario.script, scenario.set, "certificate")
    load(None, scenario.set, "certificate: [set]")
    sensor_errors(scenario.sensors, "certificate: [sensors]")
    scanner_of(scenario.lidar, "certificate: [lidar]")
    return scenario


def ground_of(scenario: Scenario) -> AcceptedField:
    """Field of a scenario. Raises ConfigError for a file without a field, or a start or goal outside the ground."""
    if scenario.terrain in GROUNDS:
        found = GROUNDS[scenario.terrain](scenario.seed)
    else:
        try:
            found = AcceptedField(
                field_file.from_npz(Path(scenario.terrain).read_bytes(), scenario.seed), scenario.seed, ()
            )
        except (OSError, ValueError) as error:
            raise ConfigError(f"{scenario.terrain}: no field: {error}") from None
    ground = found.field
    if scenario.start:
        x_m, y_m, yaw_deg = scenario.start
        ground = replace(ground, start=Pose(x_m, y_m, yaw_rad=math.radians(yaw_deg)))
    if scenario.goal:
        ground = replace(ground, goal_m=(scenario.goal[0], scenario.goal[1]))
    for key, (x_m, y_m) in (("start", (ground.start.x_m, ground.start.y_m)), ("goal", ground.goal_m)):
        if not inside(ground, x_m, y_m):
            raise ConfigError(f"scenario {scenario.name}: `{key}` = {x_m:g}, {y_m:g} lies beside the ground")
    return replace(found, field=ground)


def script_of(scenario: Scenario, ground: Field) -> str:
    """Operator's script with the goal's coordinates filled in."""
    words = goal_words(ground)
    return _WORD.sub(lambda match: words[match[1]], scenario.script)


def goal_words(ground: Field) -> dict[str, str]:
    """Values for a script's placeholders: the goal in metres, to the millimetre."""
    return {"goal_x": f"{ground.goal_m[0]:.3f}", "goal_y": f"{ground.goal_m[1]:.3f}"}


def sensor_errors(tree: Mapping[str, Any], where: str = "sensors") -> SensorErrors:
    """Errors of the nodes, from a scenario's table [sensors]. Raises ConfigError."""
    return from_tree(SensorErrors, tree, where, "sensors.")


def scanner_of(tree: Mapping[str, Any], where: str = "lidar") -> LidarErrors:
    """Errors of the scanner, from a scenario's table [lidar]. Raises ConfigError."""
    if not isinstance(tree, Mapping):
        raise ConfigError(f"{where}: `lidar` should be a table, found {shown(tree)}")
    return lidar_errors(tree, where)


def fitting_of(scenario: Scenario, sector_rad: float) -> Fitting:
    """Fitting of a scenario's world. sector_rad: half sector that the flight program maps."""
    return Fitting(scenario.rays, sensor_errors(scenario.sensors), scanner_of(scenario.lidar), sector_rad)


def flight_settings(scenario: Scenario, start: Pose) -> dict[str, Any]:
    """Flight program's settings by dotted name, equal on sockets and in one process; `set` overrides the others.

    start: true pose of the rover after settling (`World.start`), not the pose at which it was placed.
    """
    return {
        "localisation.start_x_m": start.x_m,
        "localisation.start_y_m": start.y_m,
        "localisation.start_yaw_rad": start.yaw_rad,
        "link.bench_seed": scenario.seed,
        "link.rate_bps": load_profile(scenario.link).down_bps,
        **measured_latency(scanner_of(scenario.lidar).applied()),
        **scenario.set,
    }


def measured_latency(profile: Profile) -> dict[str, Any]:
    """lidar.latency_ns of this scanner, as a team sets it after `onboard lidar lag`.

    Empty if the default is right to the accuracy of that measurement.
    """
    own_ns = stamp_to_first_byte_ns(profile)
    return {} if abs(own_ns - Lidar().latency_ns) <= LAG_GOAL_NS else {"lidar.latency_ns": own_ns}


def set_words(settings: Mapping[str, Any]) -> list[str]:
    """Settings as arguments of `onboard run`: --set NAME=VALUE for each."""
    return [word for key, item in settings.items() for word in ("--set", f"{key}={json.dumps(item)}")]


def _settings(table: Any, path: Path) -> dict[str, Any]:
    """Table `[set]` by dotted names, checked against the flight program's configuration. Raises ConfigError."""
    if not isinstance(table, Mapping):
        raise ConfigError(f"{path}: `set` should be a table, found {shown(table)}")
    settings = dict(_dotted(table, ""))
    load(None, settings, f"{path}: [set]")
    return settings


def _dotted(table: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, Any]]:
    """Flatten nested tables to dotted names: TOML reads an unquoted `mapping.folder` as a table in a table."""
    for key, item in table.items():
        if isinstance(item, Mapping):
            yield from _dotted(item, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", item
