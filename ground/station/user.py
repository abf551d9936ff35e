"""User at this station, for the archive: with several people at one station it records the author of each request."""

from __future__ import annotations

import getpass
import os
import socket


def by_hand(way: str) -> str:
    """Return the origin of a request with user and computer: `command line alice@desk`."""
    try:
        user = getpass.getuser()
    except (KeyError, OSError):  # a user id without a name
        user = str(os.getuid())
    return f"{way} {user}@{socket.gethostname()}"
