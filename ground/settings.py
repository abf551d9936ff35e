"""The station's own settings: which link, which keys, where its memory and archive are. One flat TOML file."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, replace
from pathlib import Path

from onboard.config import ConfigError, from_tree, value
from onboard.drivers.key_file import read_keys
from protocol.link import KEY_DOWN, KEY_UP, LinkKeys, bench_keys

PLACES = (Path("ground.toml"), Path("build/sim/ground.toml"))


@dataclass(frozen=True, slots=True)
class Settings:
    """One station. Relative paths are taken from the file's own folder."""

    endpoint: str = value("tcp/127.0.0.1:7448", "zenoh locator of the link's ground side")
    one_way_s: float = value(1.3, "delay of a udp/ link, one way: its handshake may take 4.8 of it", low=0, high=60)
    station: int = value(1, "key id of this station", low=1, high=255)
    command_keys: str = value("", "file with this station's key (mode 0600)")
    downlink_key: str = value("", "file with the rover's key (mode 0600)")
    bench_seed: int = value(-1, "where no key files are named: keys from this seed; bench only", low=-1, high=2**31)
    state: str = value("", "folder of the counters that outlive the station; empty: a bench run from zero")
    archive: str = value("", "SQLite file of everything sent and heard; empty: none")
    up_bps: float = value(256_000.0, "line rate of the uplink", low=1000, high=1e10)
    report_s: float = value(5.0, "time between status lines of a script", low=0.1, high=3600)


class NoStationError(ConfigError):
    """No station file was named and none lies where it is looked for."""


def load_settings(path: Path | None) -> Settings:
    """The named file, or the first of PLACES that exists. Raises NoStationError or ConfigError, one line each."""
    if path is None:
        path = next((place for place in PLACES if place.exists()), None)
        if path is None:
            places = " or ".join(f"./{place}" for place in PLACES)
            raise NoStationError(f"no station file: looked for {places}; name one with --station FILE, "
                                 "or start the simulation, which writes one")
    try:
        tree = tomllib.loads(path.read_text())
    except OSError as error:
        raise NoStationError(f"{path}: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: not valid TOML: {error}") from error
    settings = from_tree(Settings, tree, str(path))
    beside = {name: str(path.parent / text) for name in ("command_keys", "downlink_key", "state", "archive")
              if (text := getattr(settings, name))}
    return replace(settings, **beside)


def station_keys(settings: Settings) -> LinkKeys:
    """Both directions' keys, from the files or from the bench's seed. Raises ConfigError."""
    if settings.command_keys and settings.downlink_key:
        if not settings.state:
            raise ConfigError("state: with key files a folder is needed, where the counters outlive the station")
        keys = LinkKeys(read_keys(settings.command_keys, KEY_UP), read_keys(settings.downlink_key, KEY_DOWN))
    elif settings.command_keys or settings.downlink_key:
        raise ConfigError("command_keys, downlink_key: name both files, or neither on a bench")
    elif settings.bench_seed < 0:
        raise ConfigError("command_keys, downlink_key: no key files named (on a bench set bench_seed)")
    else:
        keys = bench_keys(settings.bench_seed)
    if keys.command.key(settings.station) is None:
        known = ", ".join(map(str, keys.command.key_ids))
        raise ConfigError(f"station = {settings.station}: no key of that id; known: {known}")
    return keys
