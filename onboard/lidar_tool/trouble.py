"""Why a scanner's port cannot be had, in one line that says what to do."""

from __future__ import annotations

import errno
import os
import socket
import stat
from pathlib import Path

EX_NOINPUT, EX_NOHOST, EX_UNAVAILABLE, EX_NOPERM, EX_CONFIG = 66, 68, 69, 77, 78
_TCP_LIMIT_S = 2.0


class PortTroubleError(RuntimeError):
    """The scanner cannot be used; `code` is the exit code."""

    def __init__(self, code: int, text: str) -> None:
        super().__init__(text)
        self.code = code


def explain(address: str) -> PortTroubleError | None:
    """Why the port of an address cannot be opened; None where it can now."""
    kind, _, rest = address.partition(":")
    return _tty(rest.rpartition("@")[0] or rest) if kind == "tty" else _tcp(rest)


def _tty(path: str) -> PortTroubleError | None:
    strange = PortTroubleError(EX_NOINPUT, f"{path} is no serial device; {_terminals()}")
    try:
        if not stat.S_ISCHR(os.stat(path).st_mode):
            return strange
        descriptor = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    except OSError as error:
        return _unopened(path, error)
    terminal = os.isatty(descriptor)
    os.close(descriptor)
    return None if terminal else strange


def _unopened(path: str, error: OSError) -> PortTroubleError:
    if error.errno == errno.ENOENT:
        return PortTroubleError(EX_NOINPUT, f"no device {path}; is the sensor plugged in? {_terminals()}")
    if error.errno == errno.EACCES:
        hint = f"`sudo usermod -aG {_group(path)} $USER` and a new login let you in"
        return PortTroubleError(EX_NOPERM, f"{path} may not be opened by this user; {hint}")
    if error.errno == errno.EBUSY:
        return PortTroubleError(EX_UNAVAILABLE, f"{path} is in use; `fuser {path}` tells by which program")
    return PortTroubleError(EX_UNAVAILABLE, f"{path} cannot be opened: {error.strerror}")


def _terminals() -> str:
    found = sorted(str(path) for path in Path("/dev").glob("ttyACM*"))
    return f"there is {', '.join(found)}" if found else "there is no /dev/ttyACM*"


def _group(path: str) -> str:
    try:
        return Path(path).group()
    except (OSError, KeyError):
        return "dialout"


def _tcp(where: str) -> PortTroubleError | None:
    host, _, port = where.rpartition(":")
    try:
        socket.create_connection((host, int(port)), _TCP_LIMIT_S).close()
    except socket.gaierror:
        return PortTroubleError(EX_NOHOST, f"no computer or sensor is called {host!r}")
    except ConnectionRefusedError:
        return PortTroubleError(EX_UNAVAILABLE, f"nothing listens on {where}; a Hokuyo listens on port 10940")
    except TimeoutError:
        hint = "is the sensor powered, and this computer in its network (factory address 192.168.0.10)?"
        return PortTroubleError(EX_UNAVAILABLE, f"no answer from {where} within {_TCP_LIMIT_S:g} s; {hint}")
    except OSError as error:
        return PortTroubleError(EX_UNAVAILABLE, f"{where} cannot be reached: {error.strerror}")
    return None
