"""TABLE of the errors of the emulated scanner. A scenario's [lidar] and `--lidar KEY=VALUE` may change each.

    [lidar]
    profile = "utm-30lx"        # row of SETS from which the other keys start
    lost_ratio = 0.03

    profile ideal               no failure, no delay: IDEAL
    utm-30lx, utm-30lx-ew       times of the sensor and its link, and REAL's losses

Sources as in lidar_profile.py: [LOG] byte logs of real sensors, [SPEC] data sheet, [SRC] public code, [?] none known, a
plain guess. Angles are rad; azimuths count from the map's x axis to the left. Models of the losses: lidar_light.py;
dark surfaces: hil/world/surfaces.py.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

from hil.devices.lidar.profile import PROFILES, Profile
from onboard.config import ConfigError, from_tree, value
from onboard.toml_text import TomlError, parse_toml

Patch = tuple[float, float, float]  # centre x, y and radius, m, map frame
PATCHES = "dark_patches_m"
PAGE = "docs/sensors.md explains the keys"
NEEDS_A_FIELD = frozenset({"ground_albedo", "rock_albedo", "dark_albedo", "dark_rocks_ratio", PATCHES})


@dataclass(frozen=True, slots=True)
class LidarErrors:
    """Errors of the scanner, its clock and its link, and optical properties of the surfaces."""

    profile: str = value("ideal", "sensor and link: a row of hil/devices/lidar/profile.py", one_of=tuple(PROFILES))
    rate_error_ppm: float = value(0.0, "[?] its clock runs fast by so much", low=-1e4, high=1e4)
    motor_jitter_s: float = value(0.0, "[?] sigma of each turn's start", low=0, high=1e-3)
    latency_s: float = value(0.001, "[LOG] from the end of a sweep to the first byte of its scan", low=0, high=0.5)
    jitter_s: float = value(0.0, "[?] sigma of a half-normal added to it", low=0, high=0.1)
    spike_ratio: float = value(0.0, "[?] share of the scans that wait longer", low=0, high=1)
    spike_s: float = value(0.02, "[?] how much longer, mean of an exponential", low=0, high=2)
    lost_ratio: float = value(0.0, "[?] share of the beams that return nothing, whatever they meet", low=0, high=1)
    clump_ratio: float = value(0.0, "[?] share of these that are lost in clumps of neighbours", low=0, high=1)
    clump_least_beams: int = value(3, "[?] shortest clump", low=1, high=1081)
    clump_most_beams: int = value(30, "[?] longest clump", low=1, high=1081)
    grazing_rad: float = value(0.0, "[?] from this angle on surfaces return less, at half of it nothing", low=0, high=1)
    ground_albedo: float = value(1.0, "[?] of the soil: seen up to 30 m times its root; 0: never", low=0, high=1)
    rock_albedo: float = value(1.0, "[?] of rocks that are not dark", low=0, high=1)
    dark_albedo: float = value(0.0, "[?] of dark rocks and dark patches", low=0, high=1)
    dark_rocks_ratio: float = value(0.0, "[?] share of the rocks that are dark, drawn once", low=0, high=1)
    dark_patches_m: tuple[Patch, ...] = value((), "[?] dark discs on the ground: [x, y, radius], each")
    mixed_ratio: float = value(0.0, "[?] share of the beams behind an edge that tell a range between its sides",
                               low=0, high=1)  # fmt: skip
    outlier_ratio: float = value(0.0, "[?] share of the beams whose range is off", low=0, high=1)
    outlier_m: float = value(0.5, "[?] by up to so much, either way", low=0, high=30)
    speck_ratio: float = value(0.0, "[?] share of the beams that meet a speck of dust near the scanner", low=0, high=1)
    speck_m: float = value(2.0, "[?] how far specks are seen", low=0.1, high=30)
    sun_ratio: float = value(0.0, "[?] share of the beams lost that look into the sun's sector", low=0, high=1)
    sun_from_rad: float = value(0.0, "[?] map azimuth where that sector begins", low=-7, high=7)
    sun_to_rad: float = value(0.0, "[?] and ends, going left", low=-7, high=7)
    window_ratio: float = value(0.0, "[?] share of the beams lost in the dirty part of its window", low=0, high=1)
    window_from_rad: float = value(0.0, "[?] angle in the scanner's own frame where that part begins", low=-7, high=7)
    window_to_rad: float = value(0.0, "[?] and ends, going left", low=-7, high=7)

    def __post_init__(self) -> None:
        if self.clump_least_beams > self.clump_most_beams:
            raise ConfigError(
                f"lidar: clump_least_beams = {self.clump_least_beams} is more than "
                f"clump_most_beams = {self.clump_most_beams}"
            )
        for name in ("sun", "window"):
            ratio, begin_rad, end_rad = (getattr(self, f"{name}_{key}") for key in ("ratio", "from_rad", "to_rad"))
            if ratio > 0 and begin_rad == end_rad:
                raise ConfigError(f"lidar: {name}_ratio = {ratio:g} needs a sector: {name}_from_rad and {name}_to_rad")

    def applied(self) -> Profile:
        """Profile of the sensor with these errors."""
        return replace(
            PROFILES[self.profile],
            rate_error=self.rate_error_ppm / 1e6,
            motor_jitter_ns=_ns(self.motor_jitter_s),
            latency_ns=round(self.latency_s * 1e9),
            jitter_ns=_ns(self.jitter_s),
            spike_ratio=self.spike_ratio,
            spike_ns=_ns(self.spike_s),
            dropout_ratio=self.lost_ratio,
            clump_ratio=self.clump_ratio,
            clump_least=self.clump_least_beams,
            clump_most=self.clump_most_beams,
            grazing_rad=self.grazing_rad,
            mixed_ratio=self.mixed_ratio,
            outlier_ratio=self.outlier_ratio,
            outlier_m=self.outlier_m,
            speck_ratio=self.speck_ratio,
            speck_m=self.speck_m,
            sun_ratio=self.sun_ratio,
            sun_from_rad=self.sun_from_rad,
            sun_to_rad=self.sun_to_rad,
            window_ratio=self.window_ratio,
            window_from_rad=self.window_from_rad,
            window_to_rad=self.window_to_rad,
        )


def _ns(seconds: float) -> float:
    return round(seconds * 1e9, 3)


def plain(profile: str) -> LidarErrors:
    """Sensor and link without added errors: only the losses of the profile itself."""
    row = PROFILES[profile]
    return LidarErrors(
        profile, latency_s=row.latency_ns * 1e-9, jitter_s=row.jitter_ns * 1e-9, grazing_rad=row.grazing_rad
    )


def _real(profile: str) -> LidarErrors:
    return replace(
        plain(profile),
        rate_error_ppm=80.0,
        motor_jitter_s=30e-6,
        lost_ratio=0.01,
        clump_ratio=0.5,
        grazing_rad=math.radians(5.0),
        mixed_ratio=0.1,
        outlier_ratio=0.0002,
    )


IDEAL, REAL = plain("ideal"), _real("utm-30lx")
SETS: Mapping[str, LidarErrors] = {"ideal": IDEAL, "utm-30lx": REAL, "utm-30lx-ew": _real("utm-30lx-ew")}
DEFAULT = REAL
"""Scanner of a run if neither scenario nor command line names one."""


def lidar_errors(tree: Mapping[str, Any], where: str, base: LidarErrors | None = None) -> LidarErrors:
    """Errors from a table [lidar]: its keys override those of `base`.

    Default of base: the row of SETS named by `profile`, or DEFAULT. Raises ConfigError.
    """
    given = dict(tree)
    patches = _patches(given.pop(PATCHES, None), where)
    checked = asdict(from_tree(LidarErrors, given, where, "lidar."))
    base = base or (SETS[checked["profile"]] if "profile" in given else DEFAULT)
    chosen = {key: checked[key] for key in given}
    return replace(base, **chosen, **({} if patches is None else {PATCHES: patches}))


def _patches(rows: Any, where: str) -> tuple[Patch, ...] | None:
    if rows is None:
        return None
    good = isinstance(rows, list | tuple) and all(isinstance(row, list | tuple) and len(row) == 3 for row in rows)
    if not good or not all(type(v) in (int, float) and math.isfinite(v) for row in rows for v in row):
        raise ConfigError(f"{where}: `lidar.{PATCHES}` should be a list of [x, y, radius] in metres, found {rows!r}")
    if any(radius <= 0 for *_, radius in rows):
        raise ConfigError(f"{where}: `lidar.{PATCHES}`: a radius should be over 0, found {rows!r}")
    return tuple((float(x), float(y), float(radius)) for x, y, radius in rows)


def lidar_table(words: Sequence[str], tree: Mapping[str, Any], option: str = "--lidar") -> dict[str, Any]:
    """Scenario's table [lidar], overridden by the words `ideal` or `KEY=VALUE`. A profile replaces the whole table.

    Raises ConfigError.
    """
    given: dict[str, Any] = {}
    for word in words:
        key, sign, text = word.partition("=")
        if not sign:
            if word in {field.name for field in fields(LidarErrors)}:
                raise ConfigError(f"{option} {word}: write {word}=VALUE ({PAGE})")
            key, text = "profile", word
        if not key.strip():
            raise ConfigError(f"{option} {word}: write KEY=VALUE ({PAGE})")
        given[key.strip()] = _value(text.strip())
    table = given if "profile" in given else {**tree, **given}
    try:
        lidar_errors(table, option)
    except ConfigError as error:
        raise ConfigError(f"{error} ({PAGE})") from None
    return table


def _value(text: str) -> Any:
    try:
        return parse_toml(f"value = {text}")["value"]
    except TomlError:
        return text
