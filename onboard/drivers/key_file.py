"""Reader of link key files: only the owner may have access, and the keys must be of the expected direction."""

from __future__ import annotations

import stat
from pathlib import Path

from onboard.config import ConfigError
from protocol.link import Keyring, parse_keys


def read_any_keys(path: str) -> Keyring:
    """Read the keys in a file. Raises ConfigError, one line that begins with the path and never quotes a secret."""
    try:
        mode = stat.S_IMODE(Path(path).stat().st_mode)
        keys = parse_keys(Path(path).read_text()) if not mode & 0o077 else None
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror}") from error
    except ValueError as error:
        raise ConfigError(f"{path}: {error}") from None  # the cause could quote a secret
    if keys is None:
        raise ConfigError(f"{path}: mode {mode:04o}, others may read this key; chmod 600 it")
    return keys


def read_keys(path: str, direction: str) -> Keyring:
    """Read the keys in a file and check their direction. Raises ConfigError."""
    keys = read_any_keys(path)
    if keys.direction != direction:
        raise ConfigError(f"{path}: holds keys of {keys.direction}, should be of {direction}")
    return keys
