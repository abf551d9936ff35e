"""The verbs `ground keys ...`: make and pair keys, show their fingerprints, activate the next epoch.

Secrets stay hidden.

    FOLDER/rover/command.keys, downlink.key       for the rover: every station's command key, its own downlink key
    FOLDER/station-1/command.key, downlink.key    for operator station 1: its own command key alone
    FOLDER/viewer/downlink.key                    for a station that may watch and not command

The first pairing is by file: each folder is carried to its owner by a way that nobody else can read.
"""

from __future__ import annotations

import os
import secrets
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated

import typer

from ground.cli.verbs.screen import text_out
from ground.cli.verbs.table import Contact, Json, StationFile, Timeout
from ground.station.settings import keys_in, load_settings, station_keys
from onboard.config import ConfigError
from protocol.link.keyring import DOWNLINK_KEY_ID, EPOCHS, KEY_DOWN, KEY_UP, Keyring, format_keys

Rotate = Callable[[int, float, float, Path | None, bool], None]


def write_keys(folder: Path, stations: int, epochs: int) -> list[Path]:
    """Make new keys for a rover and its stations: files with mode 0600, folders with mode 0700.

    Raises ConfigError before any is written if one of the files exists already; OSError.
    """
    up = {station: secrets.token_bytes(32) for station in range(1, stations + 1)}
    down = {DOWNLINK_KEY_ID: secrets.token_bytes(32)}
    files: dict[Path, tuple[str, Mapping[int, bytes]]] = {
        folder / "rover" / "command.keys": (KEY_UP, up),
        folder / "rover" / "downlink.key": (KEY_DOWN, down),
    }
    for station, secret in up.items():
        files[folder / f"station-{station}" / "command.key"] = (KEY_UP, {station: secret})
        files[folder / f"station-{station}" / "downlink.key"] = (KEY_DOWN, down)
    files[folder / "viewer" / "downlink.key"] = (KEY_DOWN, down)
    there = next((path for path in files if path.exists()), None)
    if there is not None:
        raise ConfigError(f"{there}: is there already and is not overwritten; name another folder")
    for path, (direction, keys) in files.items():
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        path.parent.chmod(0o700)
        with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
            file.write(format_keys(direction, dict(keys), tuple(range(epochs))))
    return list(files)


def id_lines(where: str, keys: Keyring) -> list[str]:
    """Return the public description of a file's keys: direction, id, fingerprint, epochs."""
    epochs = " ".join(map(str, keys.epochs))
    return [
        f"{where}  {keys.direction}  {_whose(keys, key_id)}  {keys.fingerprint(key_id)}  epochs {epochs}"
        for key_id in keys.key_ids
    ]


def _whose(keys: Keyring, key_id: int) -> str:
    return "rover    " if keys.direction == KEY_DOWN else f"station {key_id}"


def app(rotate: Rotate) -> typer.Typer:
    """Return the family of commands. rotate(epoch, timeout, contact, station file, as_json) changes the epoch."""
    made = typer.Typer(
        help="Keys of the link: made and paired by file, told by fingerprints, rotated by epoch.", no_args_is_help=True
    )

    @made.command("init", epilog="Examples: ground keys init keys | ground keys init keys --stations 3")
    def _init(
        folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Where to; nothing there is overwritten.")],
        stations: Annotated[int, typer.Option(min=1, max=250, help="Operator stations, numbered from 1.")] = 2,
        epochs: Annotated[int, typer.Option(min=1, max=256, help="Key epochs that are loaded.")] = EPOCHS,
    ) -> None:
        """Make new keys: a folder for the rover, one for each station, one for viewers."""
        paths = write_keys(folder, stations, epochs)
        _say(
            *(line for path in paths for line in id_lines(str(path), keys_in(str(path)))),
            "",
            f"carry {folder}/rover to the rover: [link] command_keys and downlink_key, [state] folder",
            f"carry {folder}/station-N to station N: command_keys, downlink_key, station = N, state",
            "then compare the fingerprints there (`ground keys show-ids FILE...`) and remove this copy",
        )

    @made.command("show-ids", epilog="Examples: ground keys show-ids | ground keys show-ids /etc/el-dorado/*key*")
    def _show_ids(
        files: Annotated[list[Path] | None, typer.Argument(metavar="[FILE...]", help="Else the station's own.")] = None,
        station: StationFile = None,
    ) -> None:
        """Show the fingerprints of the keys in files, or of the station's keys; equal keys have equal fingerprints."""
        if files:
            _say(*(line for path in files for line in id_lines(str(path), keys_in(str(path)))))
            return
        keys = station_keys(load_settings(station))
        _say(*id_lines("command_keys", keys.command), *id_lines("downlink_key", keys.downlink))

    @made.command("rotate", epilog="Examples: ground keys rotate 1 | ground keys rotate 2 --json")
    def _rotate(
        epoch: Annotated[int, typer.Argument(min=0, max=255, metavar="EPOCH", help="A later one that is loaded.")],
        timeout: Timeout = 60.0,
        contact: Contact = 20.0,
        station: StationFile = None,
        as_json: Json = False,
    ) -> None:
        """Activate a loaded epoch on the rover, irreversibly; every station that has it loaded follows."""
        keys = station_keys(load_settings(station))
        if epoch not in keys.downlink.epochs or epoch not in keys.command.epochs:
            known = " ".join(map(str, keys.downlink.epochs))
            raise typer.BadParameter(
                f"epoch {epoch} is not loaded here, the rover would not be understood; loaded: {known}"
            )
        rotate(epoch, timeout, contact, station, as_json)

    return made


def _say(*lines: str) -> None:
    text_out("\n".join(lines))
