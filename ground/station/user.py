"""Who sits at this station, for the archive: where several people share it, one asks who sent the rover there."""

from __future__ import annotations

import getpass
import os
import socket


def by_hand(way: str) -> str:
    """A way of asking with user and computer: `command line alice@desk`."""
    try:
        user = getpass.getuser()
    except (KeyError, OSError):  # a user id without a name
        user = str(os.getuid())
    return f"{way} {user}@{socket.gethostname()}"
