"""Plan of a campaign: a TOML file of knobs, each fixed or a distribution; `drawn` gives the values of one case.

    name = "first"                  cases = 100                 seed = 1
    [mission]                       MissionKnobs: terrain, soil, seed, limits
    [ground]                        GroundKnobs: for mission.terrain = "drawn"
    [build]                         BuildKnobs: the rover against its drawing
    [orbit]                         OrbitKnobs: errors of the orbiter's map
    [lidar]                         hil.devices.lidar.errors.LidarErrors
    [sensors.wheel] ...             hil.devices.can.errors.SensorErrors
    [set]                           the flight program's settings
    [[faults]]                      FaultKnobs: `share` of the cases, and an injection

A knob's name is its dotted place in the file: `lidar.lost_ratio`, `faults.1.after_s`. Its values depend on the plan's
seed, the case's number and this name, on nothing else. Every end of every distribution is checked when the plan is
read; so no case can leave its knob's range.
"""

from __future__ import annotations

import difflib
import hashlib
import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hil.campaign.distributions import Distribution, draw, is_law, law_of
from hil.devices.can.errors import SensorErrors
from hil.devices.lidar.errors import LidarErrors, lidar_errors
from hil.faults.plan import Injection
from hil.plant.rays.casters import CASTERS
from hil.plant.rays.casters import DEFAULT as DEFAULT_CASTER
from hil.plant.soil import CLASSES
from hil.terrain.grounds import GROUNDS
from onboard.config import ConfigError, from_tree, load, value
from onboard.toml_text import TomlError, read_toml, shown

FOLDER = Path(__file__).parent / "plans"
DRAWN = "drawn"  # of mission.terrain: a ground of the table [ground]
MOST_CASES, MOST_SEED = 1_000_000, 1_000_000
MOST_CHECKED = 1000
_NAME = re.compile(r"\w[\w.+-]{0,60}")


@dataclass(frozen=True, slots=True)
class MissionKnobs:
    """Conditions common to all cases: ground, seed, soil, limits. The mission is one `goto` to the ground's goal."""

    terrain: str = value("fbm", "a row of GROUNDS, or drawn: by [ground]", one_of=(*GROUNDS, DRAWN))
    seed: int = value(0, "of ground, nodes and scanner; 0: the plan's seed + case - 1", low=0, high=MOST_SEED)
    soil: str = value("nominal", "row of hil.plant.soil.CLASSES", one_of=tuple(CLASSES))
    rays: str = value(DEFAULT_CASTER, "caster of the scanner's rays", one_of=tuple(CASTERS))
    edges: bool = value(True, "keep-outs along the field's edges; the bench has no ground beyond them")
    limit_s: float = value(3600.0, "bench time after which a case is ended", low=1, high=1e5)
    step_s: float = value(0.005, "step of the physics", low=0.001, high=0.005)
    blackout_from_s: float = value(0.0, "start of a blackout of the link", low=0, high=1e5)
    blackout_for_s: float = value(0.0, "how long; 0: none", low=0, high=1e5)


@dataclass(frozen=True, slots=True)
class GroundKnobs:
    """A field of 20 m x 20 m by a recipe (hil/terrain/recipe.py), accepted as drawn: its goal may be out of reach."""

    hurst: float = value(0.8, "Hurst exponent of the soil", low=0.05, high=0.95)
    median_slope_deg: float = value(5.0, "median slope of the soil", low=0.01, high=20)
    tilt_deg: float = value(0.0, "slope of the plane under it", low=0, high=25)
    tilt_towards_deg: float = value(0.0, "direction in which the plane rises, left of the x axis", low=-360, high=360)
    rocks_ratio: float = value(0.03, "share of the area under rocks; 0: none", low=0, high=0.3)
    rock_law: str = value("golombek", "law of their sizes", one_of=("golombek", "power"))
    craters: bool = value(False, "craters in steady state")
    goal_m: float = value(15.0, "distance of the goal", low=2, high=16)
    goal_bearing_deg: float = value(0.0, "its bearing, left of the x axis", low=-30, high=30)


@dataclass(frozen=True, slots=True)
class BuildKnobs:
    """The rover as built; the flight program knows the drawing. Angles add to those of `assembly`."""

    assembly: bool = value(False, "random errors of careful assembly (hil/faults/build_errors.py)")
    wheel_radius_ratio: float = value(1.0, "wheel radius by that of the drawing", low=0.8, high=1.2)
    steer_1_rad: float = value(0.0, "steering zero, front left", low=-0.2, high=0.2)
    steer_2_rad: float = value(0.0, "steering zero, rear left", low=-0.2, high=0.2)
    steer_3_rad: float = value(0.0, "steering zero, rear right", low=-0.2, high=0.2)
    steer_4_rad: float = value(0.0, "steering zero, front right", low=-0.2, high=0.2)
    lidar_roll_rad: float = value(0.0, "mounting of the scanner", low=-0.2, high=0.2)
    lidar_pitch_rad: float = value(0.0, "mounting of the scanner", low=-0.2, high=0.2)
    lidar_yaw_rad: float = value(0.0, "mounting of the scanner", low=-0.2, high=0.2)
    imu_roll_rad: float = value(0.0, "mounting of the inertial sensor", low=-0.2, high=0.2)
    imu_pitch_rad: float = value(0.0, "mounting of the inertial sensor", low=-0.2, high=0.2)
    imu_yaw_rad: float = value(0.0, "mounting of the inertial sensor", low=-0.2, high=0.2)


@dataclass(frozen=True, slots=True)
class OrbitKnobs:
    """Errors of the orbiter's map that the flight program gets."""

    shift_x_m: float = value(0.0, "registered so far too far east", low=-50, high=50)
    shift_y_m: float = value(0.0, "registered so far too far north", low=-50, high=50)
    offset_m: float = value(0.0, "all heights too high by", low=-100, high=100)
    noise_m: float = value(0.0, "sigma of each cell's height", low=0, high=20)
    missing_ratio: float = value(0.0, "share of the cells without data", low=0, high=0.9)


class _LidarKnobs(LidarErrors):
    """Scanner's keys, each by itself: the rules between them are for drawn values (`check_cases`)."""

    def __post_init__(self) -> None:
        pass


TABLES: Mapping[str, type[Any]] = {
    "mission": MissionKnobs,
    "ground": GroundKnobs,
    "build": BuildKnobs,
    "orbit": OrbitKnobs,
    "lidar": _LidarKnobs,
    "sensors": SensorErrors,
}
_SHARE = "share"  # beside the keys of an injection
_HEAD = ("name", "about", "cases", "seed")


@dataclass(frozen=True, slots=True)
class _Head:
    name: str = value("", "name in reports, and of the folder in build/campaigns; default: the file's")
    about: str = value("", "one sentence")
    cases: int = value(0, "number of cases", low=1, high=MOST_CASES)
    seed: int = value(1, "base of all draws", low=1, high=MOST_SEED)


@dataclass(frozen=True, slots=True)
class Plan:
    """Plan of a campaign.

    knobs: law of each knob, by its dotted name
    faults: number of the rows [[faults]]
    where: the file, for messages
    tree: the file's tables
    """

    name: str
    about: str
    cases: int
    seed: int
    knobs: Mapping[str, Distribution]
    faults: int
    where: str
    tree: Mapping[str, Any]

    @property
    def sha256(self) -> str:
        """Hash of what decides a case's values: not of the name, not of the number of cases."""
        deciding = {key: item for key, item in self.tree.items() if key not in ("name", "about", "cases")}
        return hashlib.sha256(json.dumps({"seed": 1, **deciding}, sort_keys=True).encode()).hexdigest()


def plan_names(incomplete: str = "") -> list[str]:
    """Names of the bench's own plans that begin so, sorted."""
    return sorted(path.stem for path in FOLDER.glob("*.toml") if path.stem.startswith(incomplete))


def find_plan(name: str) -> Path:
    """File of a plan given by name or path."""
    path, own = Path(name), FOLDER / f"{name}.toml"
    return own if own.is_file() and not path.is_file() else path


def load_plan(path: Path) -> Plan:
    """Read a plan. Raises FileNotFoundError, ConfigError (file, key, value, suggestion)."""
    try:
        tree = read_toml(path)
    except TomlError as error:
        raise ConfigError(f"{path}: not valid TOML: {error}") from error
    return plan_of({"name": path.stem, **tree}, str(path))


def plan_of(tree: Mapping[str, Any], where: str) -> Plan:
    """Plan from its tables. Raises ConfigError."""
    head = from_tree(_Head, {key: item for key, item in tree.items() if key in _HEAD}, where)
    if not _NAME.fullmatch(head.name):
        raise ConfigError(f"{where}: `name` = {shown(head.name)} should be letters, digits and . + - _: of a folder")
    if "cases" not in tree:
        raise ConfigError(f"{where}: `cases` is missing: the number of flights")
    known = {**dict.fromkeys((*_HEAD, *TABLES, "set", "faults"))}
    for key in tree:
        if key not in known:
            raise ConfigError(f"{where}: unknown key `{key}`{_near(key, known)}")
    knobs: dict[str, Distribution] = {}
    for table in (*TABLES, "set"):
        laws = dict(_laws(tree.get(table, {}), table, where))
        for key, law in laws.items():
            _check(table, key, laws, where)
            knobs[f"{table}.{key}"] = law
    rows = tree.get("faults", [])
    if not isinstance(rows, list):
        raise ConfigError(f"{where}: `faults` should be tables [[faults]], found {shown(rows)}")
    for number, row in enumerate(rows, 1):
        laws = dict(_laws(row, f"faults.{number}", where))
        for key, law in laws.items():
            _check_fault(number, key, law, where)
            knobs[f"faults.{number}.{key}"] = law
        if "fault" not in row:
            raise ConfigError(f"{where}: `faults.{number}.fault` is missing: a row of hil.faults.injection")
        _check_targets(number, laws, where)
    return Plan(head.name, head.about, head.cases, head.seed, knobs, len(rows), where, tree)


def drawn(plan: Plan, number: int) -> dict[str, Any]:
    """Values of a case, by knob; those of a fault that does not occur in it are missing."""
    values = {knob: draw(law, plan.seed, number, knob) for knob, law in plan.knobs.items()}
    for fault in range(1, plan.faults + 1):
        prefix = f"faults.{fault}."
        share = values.pop(prefix + _SHARE, 1.0)
        occurs = draw(law_of({"uniform": [0, 1]}, prefix), plan.seed, number, prefix + "occurs") < share
        if not occurs:
            values = {knob: item for knob, item in values.items() if not knob.startswith(prefix)}
    return values


def table_of(values: Mapping[str, Any], table: str) -> dict[str, Any]:
    """Values of one table, its name taken off."""
    return {knob[len(table) + 1 :]: item for knob, item in values.items() if knob.startswith(table + ".")}


def nested(flat: Mapping[str, Any]) -> dict[str, Any]:
    """Tables in tables from dotted names."""
    made: dict[str, Any] = {}
    for name, item in flat.items():
        *path, last = name.split(".")
        at = made
        for part in path:
            at = at.setdefault(part, {})
        at[last] = item
    return made


def _near(key: str, known: Mapping[str, Any]) -> str:
    near = difflib.get_close_matches(key, known, n=1)
    return f"; did you mean `{near[0]}`?" if near else f"; known here: {', '.join(known)}"


def _laws(tree: Any, prefix: str, where: str) -> Iterator[tuple[str, Distribution]]:
    """Yield the dotted names in a table and their laws. Raises ConfigError."""
    if not isinstance(tree, Mapping):
        raise ConfigError(f"{where}: `{prefix}` should be a table, found {shown(tree)}")
    for key, item in tree.items():
        if isinstance(item, Mapping) and not is_law(item) and prefix.partition(".")[0] in ("set", "sensors"):
            yield from ((f"{key}.{name}", law) for name, law in _laws(item, f"{prefix}.{key}", where))
        else:
            yield key, law_of(item, f"{where}: `{prefix}.{key}`")


def _check(table: str, key: str, laws: Mapping[str, Distribution], where: str) -> None:
    """Check each extreme of a knob against its range. Raises ConfigError."""
    if table == "lidar" and key == "dark_patches_m":
        raise ConfigError(f"{where}: `lidar.{key}` is not for campaigns; use dark_rocks_ratio")
    others = {other: _plain(law.extremes[0]) for other, law in laws.items()} if table == "set" else {}
    for item in map(_plain, laws[key].extremes):
        if table == "set":
            load(None, {**others, key: item}, f"{where}: [set]")
        else:
            from_tree(TABLES[table], nested({key: item}), where, f"{table}.")


def check_cases(plan: Plan) -> None:
    """Check the rules between the knobs of a case, for each case (the first MOST_CHECKED). Raises ConfigError."""
    for number in range(1, min(plan.cases, MOST_CHECKED) + 1):
        values = drawn(plan, number)
        try:
            lidar_errors(table_of(values, "lidar"), plan.where)
            load(None, table_of(values, "set"), f"{plan.where}: [set]")
        except ConfigError as error:
            text = str(error).removeprefix(f"{plan.where}: ")
            raise ConfigError(f"{plan.where}: {text} (case {number})") from None


def _check_fault(number: int, key: str, law: Distribution, where: str) -> None:
    """Check a knob of a fault. Raises ConfigError."""
    from hil.faults.injection import INJECTIONS

    what = f"{where}: `faults.{number}.{key}`"
    for item in law.extremes:
        if key == _SHARE:
            if not isinstance(item, int | float) or not 0 <= item <= 1:
                raise ConfigError(f"{what} = {shown(item)} is out of range 0 to 1")
            continue
        from_tree(Injection, {key: item}, where, f"faults.{number}.")
        if key != "fault":
            continue
        cause = INJECTIONS.get(item)
        if cause is None:
            raise ConfigError(f"{what} = {shown(item)}: no such fault{_near(item, INJECTIONS)}")
        if cause.never_quick:
            raise ConfigError(f"{what} = {shown(item)} needs several processes, and a case is flown in one")


def _check_targets(number: int, laws: Mapping[str, Distribution], where: str) -> None:
    """Check that each fault of a row can have each of its targets. Raises ConfigError."""
    from hil.faults.injection import INJECTIONS

    what = f"{where}: `faults.{number}.target`"
    targets = laws["target"].extremes if "target" in laws else (Injection().target,)
    for fault in laws["fault"].extremes:
        for target in targets:
            if why := INJECTIONS[fault].refuses(target):
                found = f"{what} = {target}" if "target" in laws else f"{what} is missing"
                raise ConfigError(f"{found}: of {fault} it {why}")


def _plain(item: Any) -> Any:
    """A list as TOML gives it."""
    return list(item) if isinstance(item, tuple) else item
