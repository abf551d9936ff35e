"""Sockets and file of the gateway: UDP datagrams to and from the pure `Gateway`; signing times, stored before use."""

from __future__ import annotations

import hashlib
import json
import socket
import stat
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Self

from ground.gateway.clients import Address, Door
from ground.gateway.gateway import Gateway
from ground.gateway.signing import stamp_of
from ground.link.news import News
from ground.station.memory import write_safely
from ground.station.station import StationError
from onboard.config import ConfigError

_MOST_PER_TURN = 256
_DATAGRAM = 2048


def utc_stamp() -> int:
    """Return the signing time by the computer's clock."""
    return stamp_of(time.time_ns())


def read_signing_key(path: str) -> bytes:
    """Read the key in a file: 64 hex digits, or `passphrase WORDS`, of which the key is the SHA-256.

    Raises ConfigError in one line that never quotes the file's content.
    """
    try:
        mode = stat.S_IMODE(Path(path).stat().st_mode)
        text = Path(path).read_text().strip() if not mode & 0o077 else ""
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: {getattr(error, 'strerror', None) or 'not a text file'}") from None
    if mode & 0o077:
        raise ConfigError(f"{path}: mode {mode:04o}, others may read this key; chmod 600 it")
    word, _, rest = text.partition(" ")
    if word == "passphrase" and rest.strip():
        return hashlib.sha256(rest.strip().encode()).digest()
    try:
        key = bytes.fromhex(text)
    except ValueError:
        key = b""
    if len(key) != 32:
        raise ConfigError(f"{path}: should hold 64 hex digits, or `passphrase` and words")
    return key


class Marks:
    """The newest signing time of each stream, in a file that is replaced atomically."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def read(self) -> dict[str, int]:
        """Return the stored times; empty if there is no file yet. Raises ConfigError if it is damaged."""
        try:
            return {str(stream): int(at) for stream, at in json.loads(self._path.read_text()).items()}
        except FileNotFoundError:
            return {}
        except (ValueError, AttributeError, TypeError) as error:
            raise ConfigError(f"{self._path}: damaged ({error}); take a new signing key and delete it") from error

    def keep(self, marks: dict[str, int]) -> None:
        """Store the times; they are on the disk when this returns. Raises OSError."""
        self._path.parent.mkdir(parents=True, exist_ok=True)
        write_safely(self._path, marks)


class GatewayShell:
    """Doors with their sockets around one gateway. Use it inside `with`. stamp: returns the signing time."""

    def __init__(self, gateway: Gateway, marks: Marks | None = None, stamp: Callable[[], int] = utc_stamp) -> None:
        self._gateway, self._marks, self._stamp = gateway, marks, stamp
        self._stack = ExitStack()
        self._sockets: dict[str, tuple[Door, socket.socket]] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._stack.close()

    def open(self, door: Door, address: Address) -> Address:
        """Listen on an address and return the actual one (port 0: any free one). Raises StationError."""
        at = self._stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        at.setblocking(False)
        try:
            at.bind(address)
        except OSError as error:
            self._stack.close()
            raise StationError(
                f"UDP {address[0]}:{address[1]}: {error.strerror or error}; "
                "name another port, or end what listens there"
            ) from error
        self._sockets[door.name] = (door, at)
        host, port = at.getsockname()
        return host, port

    def turn(self, news: list[News], now_ns: int) -> None:
        """Run one turn of the operation: receive clients' datagrams, process the session's news, send what is due."""
        heard = []
        for door, at in self._sockets.values():
            for _ in range(_MOST_PER_TURN):
                try:
                    datagram, address = at.recvfrom(_DATAGRAM)
                except (BlockingIOError, ConnectionError):
                    break
                heard += self._gateway.clients.accept(door, address, datagram, self._stamp())
        marks = self._gateway.clients.marks()
        if marks is not None and self._marks is not None:
            self._marks.keep(marks)
        for one in heard:
            self._gateway.act(one, now_ns)
        self._gateway.turn(news, now_ns)
        for name, address, frame in self._gateway.send(self._stamp()):
            try:
                self._sockets[name][1].sendto(frame, address)
            except OSError:
                continue  # no receiver, or its queue is full: telemetry is sent again, clients repeat requests

    def next_due_ns(self) -> int:
        """Return the time at which the gateway is due; sockets are polled in each turn of the clock."""
        return self._gateway.next_due_ns()
