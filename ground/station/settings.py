"""Settings of the station: link, keys, state folder, archive. One flat TOML file."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from ground.link.schedule import Schedule, parse
from onboard.config import ConfigError, from_tree, value
from onboard.toml_text import TomlError, read_toml
from protocol.link.datagrams import KEY_DOWN, KEY_UP, Keyring, LinkKeys, bench_keys
from transport.key_file import KeyFileError, read_any_keys, read_keys

PLACES = (Path("ground.toml"), Path("build/sim/ground.toml"))


@dataclass(frozen=True, slots=True)
class StationSettings:
    """Settings of one station. Relative paths are relative to the file's folder."""

    endpoint: str = value("tcp/127.0.0.1:7448", "zenoh locator of the link's ground side; udp/HOST:PORT: the rover")
    one_way_s: float = value(1.3, "delay of a udp/ link, one way: nobody there after 8 of it and 5 s", low=0, high=60)
    station: int = value(1, "key id of this station", low=1, high=255)
    command_keys: str = value("", "file with this station's key (mode 0600); empty beside a downlink_key: a viewer")
    downlink_key: str = value("", "file with the rover's key (mode 0600)")
    bench_seed: int = value(-1, "where no key files are named: keys from this seed; bench only", low=-1, high=2**31)
    state: str = value("", "folder of the counters that outlive the station; empty: a bench run from zero")
    archive: str = value("", "SQLite file of everything sent and heard; empty: none")
    contacts: str = value("", "file of contact windows, see docs; empty: the link carries at any time")
    archive_days: float = value(0.0, "older rows go, but never requests and reports; 0: kept for ever", low=0, high=1e5)
    archive_mb: float = value(4000.0, "the oldest rows go where the archive is larger; 0: any size", low=0, high=1e6)
    up_bps: float = value(256_000.0, "line rate of the uplink", low=1000, high=1e10)
    report_s: float = value(5.0, "time between status lines of a script", low=0.1, high=3600)
    origin_latitude_deg: float = value(0.0, "where the map frame lies on the globe", low=-89.9, high=89.9)
    origin_longitude_deg: float = value(0.0, "likewise", low=-180, high=180)
    origin_height_m: float = value(0.0, "likewise, over the ellipsoid (WGS 84)", low=-20_000, high=20_000)


class NoStationError(ConfigError):
    """No station file was named and none exists in the default places."""


def load_settings(path: Path | None) -> StationSettings:
    """Load the named file, or the first of PLACES that exists. Raises NoStationError or ConfigError, one line each."""
    if path is None:
        path = next((place for place in PLACES if place.exists()), None)
        if path is None:
            places = " or ".join(f"./{place}" for place in PLACES)
            raise NoStationError(
                f"no station file: looked for {places}; name one with --station FILE, "
                "or start the simulation, which writes one"
            )
    try:
        tree = read_toml(path)
    except OSError as error:
        raise NoStationError(f"{path}: {error.strerror}") from error
    except TomlError as error:
        raise ConfigError(f"{path}: not valid TOML: {error}") from error
    settings = from_tree(StationSettings, tree, str(path))
    beside = {
        name: str(path.parent / text)
        for name in ("command_keys", "downlink_key", "state", "archive", "contacts")
        if (text := getattr(settings, name))
    }
    return replace(settings, **beside)


def keys_in(path: str, direction: str = "") -> Keyring:
    """Return the keys in a file, of this direction or of any. Raises ConfigError, one line without a secret."""
    try:
        return read_keys(path, direction) if direction else read_any_keys(path)
    except KeyFileError as error:
        raise ConfigError(str(error)) from None  # the cause could quote a secret


def station_keys(settings: StationSettings) -> LinkKeys:
    """Return both directions' keys, from the files or from the bench's seed. Raises ConfigError."""
    if settings.downlink_key:
        if not settings.state:
            raise ConfigError("state: with key files a folder is needed, where the counters outlive the station")
        down = keys_in(settings.downlink_key, KEY_DOWN)
        if not settings.command_keys:
            return LinkKeys(Keyring(KEY_UP, {}, down.epochs), down)
        keys = LinkKeys(keys_in(settings.command_keys, KEY_UP), down)
    elif settings.command_keys:
        raise ConfigError("downlink_key: name this file too; without it nothing of the rover can be heard")
    elif settings.bench_seed < 0:
        raise ConfigError("command_keys, downlink_key: no key files named (on a bench set bench_seed)")
    else:
        keys = bench_keys(settings.bench_seed)
    if keys.command.key(settings.station) is None:
        known = ", ".join(map(str, keys.command.key_ids))
        raise ConfigError(f"station = {settings.station}: no key of that id; known: {known}")
    return keys


def load_schedule(settings: StationSettings) -> Schedule:
    """Return the contact windows that the settings name. Raises ConfigError, one line."""
    if not settings.contacts:
        return Schedule()
    try:
        return parse(Path(settings.contacts).read_text(), settings.contacts)
    except OSError as error:
        raise ConfigError(f"contacts: {settings.contacts}: {error.strerror}") from error
    except ValueError as error:
        raise ConfigError(f"contacts: {error}") from None
