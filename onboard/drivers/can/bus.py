"""CAN bus behind one interface, chosen by a URI; only the can_*.py modules of this folder import python-can.

    socketcan:can0                         the rover; the kernel's stamps and filter
    socketcand:127.0.0.1:29536/rover       a socketcand server or the bench's hub, where the kernel has no AF_CAN
    virtual:name                           inside one process

`open_bus` opens one and waits for it; `CanPort` manages one through a run and never waits.
"""

from __future__ import annotations

import re
import threading
from collections.abc import Callable, Sequence

from onboard.config import ConfigError
from onboard.drivers.can.base import CanBus as CanBus
from onboard.drivers.can.base import NoCanError
from onboard.records import BusStatus, BusTrouble, Frame, PortState
from onboard.records.status import BUS_CLOSED

FIRST_LIMIT_S = 5.0
FORMS = "socketcan:INTERFACE, socketcand:HOST:PORT/BUS or virtual:NAME"


def open_bus(uri: str, filtered: bool = False) -> CanBus:
    """Open the bus that a URI names. filtered: the kernel drops ids outside the blocks of the DBC.

    Raises ConfigError for a URI of another form, OSError with what to do if the bus cannot be opened.
    """
    return _opener(uri, filtered)()


def _opener(uri: str, filtered: bool) -> Callable[[], CanBus]:
    kind, _, rest = uri.partition(":")  # each loads its own part of python-can: socketcand a parser of XML
    if kind == "socketcan" and re.fullmatch(r"[\w.-]{1,15}", rest):
        from onboard.drivers.can.socketcan import open_socketcan

        return lambda: open_socketcan(rest, filtered)
    if kind == "virtual" and rest:
        from can.interfaces.virtual import VirtualBus

        return lambda: CanBus(VirtualBus(rest))
    match = re.fullmatch(r"([^:/]+):(\d{1,5})/([\w.-]+)", rest)
    if kind == "socketcand" and match:
        from onboard.drivers.can.socketcand import open_socketcand

        return lambda: open_socketcand(match[1], int(match[2]), match[3])
    raise ConfigError(f"can.uri = {uri!r} names no bus; write {FORMS}")


class _Attempt:
    """One opening outside the tick. A daemon thread: a server that accepts and stays silent delays nothing."""

    def __init__(self, opening: Callable[[], CanBus]) -> None:
        self.bus: CanBus | None = None
        self.error: OSError | None = None
        self._abandoned = False
        self._lock = threading.Lock()
        self._opening = opening
        self.thread = threading.Thread(target=self._run, name="can opening", daemon=True)
        self.thread.start()

    def _run(self) -> None:
        try:
            bus = self._opening()
        except OSError as error:
            self.error = error
            return
        with self._lock:
            if not self._abandoned:
                self.bus = bus
                return
        bus.close()

    def abandon(self) -> None:
        """Close the bus if the attempt opens one."""
        with self._lock:
            self._abandoned = True
        if self.bus:
            self.bus.close()


class CanPort:
    """The bus of one run: opened, lost, opened again by `connect`; counts of frames are of the open bus.

    The constructor waits for the first opening; a failure shows in `status` and does not end the run. Raises
    ConfigError for a URI of another form, OSError if no later attempt can succeed (no CAN in this kernel).
    """

    def __init__(self, uri: str, filtered: bool = False) -> None:
        self._open = _opener(uri, filtered)
        self.served = uri.startswith("socketcand:")  # the other end has to accept the connection
        self._bus: CanBus | None = None
        self._attempt: _Attempt | None = None
        self._words = ""
        self._errors = [0] * len(BusTrouble)  # of the buses before this one
        self._failures = 0
        self.openings = 0
        self.connect()
        self._first()

    @property
    def state(self) -> PortState:
        """State as last seen."""
        return self._bus.state if self._bus else PortState.CLOSED

    @property
    def status(self) -> BusStatus:
        """Status of the whole run."""
        errors = tuple(map(sum, zip(self._errors, self._bus.errors, strict=True))) if self._bus else self._errors
        words = self._bus.error if self._bus else self._words or BUS_CLOSED
        return BusStatus(self.state, words, self._failures, self.openings, tuple(errors))

    @property
    def received(self) -> int:
        """Frames received on the open bus, error frames included."""
        return self._bus.received if self._bus else 0

    @property
    def sent(self) -> int:
        """Frames that the open bus has taken."""
        return self._bus.sent if self._bus else 0

    def fileno(self) -> int:
        """Descriptor for poll(); -1 for a virtual or closed bus."""
        return self._bus.fileno() if self._bus else -1

    def connect(self) -> None:
        """Close the open bus and a pending attempt, and start to open the bus again; returns at once."""
        self.close()
        self.openings += 1
        self._attempt = _Attempt(self._open)

    def wait_open(self, limit_s: float | None) -> PortState:
        """Wait until the attempt of `connect` is decided, at most `limit_s`; return the state."""
        if self._attempt:
            self._attempt.thread.join(limit_s)
        self._adopt()
        return self.state

    def read(self, stamp_ns: int) -> list[Frame]:
        """Read as CanBus.read; first take over a bus that has been opened."""
        self._adopt()
        return self._bus.read(stamp_ns) if self._bus else []

    def forget(self) -> None:
        """Drop frames as CanBus.forget."""
        self._adopt()
        if self._bus:
            self._bus.forget()

    def read_upto(self, total: int, stamps_us: Sequence[int], limit_s: float) -> list[Frame]:
        """Read as CanBus.read_upto; empty if there is no bus."""
        return self._bus.read_upto(total, stamps_us, limit_s) if self._bus else []

    def write(self, frames: Sequence[Frame]) -> int:
        """Send as CanBus.write; count failures."""
        failures = self._bus.write(frames) if self._bus else len(frames)
        self._failures += failures
        return failures

    def close(self) -> None:
        """Close the bus and any attempt; no effect if there is none."""
        if self._attempt:
            self._attempt.abandon()
            self._attempt = None
        if self._bus:
            self._errors = [a + b for a, b in zip(self._errors, self._bus.errors, strict=True)]
            self._words = self._bus.error or self._words
            self._bus.close()
            self._bus = None

    def _first(self) -> None:
        attempt = self._attempt
        self.wait_open(FIRST_LIMIT_S)
        if attempt and isinstance(attempt.error, NoCanError):
            raise attempt.error

    def _adopt(self) -> None:
        attempt = self._attempt
        if attempt is None or attempt.thread.is_alive():
            return
        self._bus, self._words, self._attempt = attempt.bus, str(attempt.error or ""), None
