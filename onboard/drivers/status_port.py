"""Local socket of `onboard status`: each caller gets one line of JSON, and the connection is closed.

The daemon's end never waits: `serve` takes one caller at most, writes what the kernel takes at once (a report is 3 KB,
a socket's buffer 200) and stores nothing of the caller. It replaces the file of a dead daemon, but not of a living one.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

MOST_PATH = 107  # bytes of a unix socket's path, by the kernel
CALLERS = 4  # that may wait; the kernel refuses more
MOST_BYTES = 1 << 20  # of a report; another program may answer in a place that everybody may write to
LEAST_NS = 50_000_000  # between answers: a caller in a loop costs the ticks little
_MODE = 0o660


class StatusError(Exception):
    """No status; the text has the reason and what to do."""


def usual_places() -> tuple[Path, ...]:
    """Default places of the socket, best first: a service's folder, the user's, the temporary one."""
    personal = os.environ.get("XDG_RUNTIME_DIR")
    return (
        Path("/run/el-dorado/onboard.sock"),
        *((Path(personal) / "el-dorado.sock",) if personal else ()),
        Path(f"/tmp/el-dorado-{os.getuid()}.sock"),
    )


def place_of(setting: str, lockstep: bool) -> Path | None:
    """Socket that status.socket names; None if there is to be no socket."""
    if setting == "off" or (setting == "auto" and lockstep):
        return None
    if setting != "auto":
        return Path(setting)
    return next(path for path in usual_places() if os.access(path.parent, os.W_OK) or path == usual_places()[-1])


class StatusPort:
    """Daemon's end. Raises StatusError if the socket cannot be made."""

    def __init__(self, path: Path) -> None:
        self.path = path
        if len(os.fsencode(path)) > MOST_PATH:
            raise StatusError(f"status.socket = {path}: longer than the {MOST_PATH} bytes of a unix socket")
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM | socket.SOCK_NONBLOCK | socket.SOCK_CLOEXEC)
        self._answered_ns: int | None = None
        try:
            _clear(path)
            self._socket.bind(str(path))
            path.chmod(_MODE)
            self._socket.listen(CALLERS)
        except OSError as error:
            self._socket.close()
            raise StatusError(f"status.socket = {path}: {error.strerror}") from error
        except StatusError:
            self._socket.close()
            raise
        self._own = path.stat().st_ino

    def serve(self, report: Callable[[], bytes], now_ns: int) -> bool:
        """Answer one waiting caller; return whether there was one. report: called only then."""
        if self._answered_ns is not None and now_ns - self._answered_ns < LEAST_NS:
            return False
        try:
            caller, _ = self._socket.accept()
        except OSError:  # no caller, or one that has left
            return False
        with caller:
            caller.setblocking(False)
            self._answered_ns = now_ns
            with suppress(OSError):  # the caller has left, or takes nothing
                caller.send(report())
        return True

    def close(self) -> None:
        """Close the socket. Its file is removed, unless another daemon has put its own there."""
        self._socket.close()
        with suppress(OSError):
            if self.path.stat().st_ino == self._own:
                self.path.unlink()


def ask(paths: Sequence[Path], limit_s: float = 5.0) -> bytes:
    """Return the report of the daemon behind the first of these sockets that answers. Raises StatusError."""
    found = [path for path in paths if path.exists()]
    if not found:
        raise StatusError(
            f"no daemon runs here: there is no {' or '.join(map(str, paths))}. The rover of `make sim` is in "
            "lock-step and has none unless status.socket names it: ask it with `ground status`"
        )
    trouble = ""
    for path in found:
        try:
            return _ask(path, limit_s)
        except TimeoutError:
            trouble = f"{path}: a daemon is there and gave no answer within {limit_s:g} s: it hangs or is stopped"
        except ConnectionRefusedError:
            trouble = trouble or f"no daemon runs here: {path} was left by one that has gone"
        except OSError as error:
            trouble = trouble or f"{path}: {error.strerror}"
    raise StatusError(trouble)


def _ask(path: Path, limit_s: float) -> bytes:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as line:
        line.settimeout(limit_s)
        line.connect(str(path))
        heard = b""
        while len(heard) < MOST_BYTES and (part := line.recv(65536)):
            heard += part
    if not heard.endswith(b"\n"):
        raise StatusError(f"{path}: the answer was cut off; ask again")
    return heard


def _clear(path: Path) -> None:
    """Remove the socket of a dead daemon. Raises StatusError if there is anything else."""
    if not path.exists():
        return
    if not path.is_socket():
        raise StatusError(f"status.socket = {path}: a file that is no socket is there; it is left alone")
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        probe.setblocking(False)
        try:
            probe.connect(str(path))
        except ConnectionRefusedError:
            path.unlink()
            return
        except BlockingIOError:  # its queue is full: a daemon listens
            pass
    raise StatusError(f"status.socket = {path}: another daemon answers there; name a socket for this one, or off")
