"""Reader of link key files: only the owner may have access, and the keys must be of the expected direction."""

from __future__ import annotations

import stat
from pathlib import Path

from protocol.link.datagrams import Keyring, parse_keys


class KeyFileError(ValueError):
    """A key file cannot be used; the text is one line that begins with its path and never quotes a secret."""


def read_any_keys(path: str) -> Keyring:
    """Read the keys in a file. Raises KeyFileError."""
    try:
        mode = stat.S_IMODE(Path(path).stat().st_mode)
        keys = parse_keys(Path(path).read_text()) if not mode & 0o077 else None
    except OSError as error:
        raise KeyFileError(f"{path}: {error.strerror}") from error
    except ValueError as error:
        raise KeyFileError(f"{path}: {error}") from None  # the cause could quote a secret
    if keys is None:
        raise KeyFileError(f"{path}: mode {mode:04o}, others may read this key; chmod 600 it")
    return keys


def read_keys(path: str, direction: str) -> Keyring:
    """Read the keys in a file and check their direction. Raises KeyFileError."""
    keys = read_any_keys(path)
    if keys.direction != direction:
        raise KeyFileError(f"{path}: holds keys of {keys.direction}, should be of {direction}")
    return keys
