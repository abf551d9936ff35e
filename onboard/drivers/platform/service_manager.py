"""Notifications to the service manager (sd_notify(3)), own code: READY, STATUS, WATCHDOG, STOPPING.

systemd names a datagram socket in NOTIFY_SOCKET, a path or @NAME in the abstract namespace, and in WATCHDOG_USEC the
longest silence after which it ends and restarts the program. Without them nothing is sent. Nothing here waits: a
message that the manager does not take at once is lost, and the next one comes in time.

Only the loop of the ticks calls `beat`, after a tick that was read, computed, sent and recorded: a core that hangs, or
a disk or port that delays the tick, starves the watchdog. No thread and no timer may feed it.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Callable, Mapping
from contextlib import suppress

EVERY_NS = 1_000_000_000  # between two status messages
BEATS = 4  # least number within the manager's limit


class Service:
    """Connection to the service manager. environment: that of the process."""

    def __init__(self, environment: Mapping[str, str]) -> None:
        address = environment.get("NOTIFY_SOCKET", "")
        self._address = f"\0{address[1:]}" if address.startswith("@") else address
        self._line = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK | socket.SOCK_CLOEXEC)
        self.patience_ns = _patience_ns(environment)
        self._every_ns = min(EVERY_NS, self.patience_ns // BEATS) if self.patience_ns else EVERY_NS
        self._told_ns: int | None = None

    def tell(self, *words: str) -> None:
        """Send one datagram of KEY=VALUE words."""
        if self._address:
            with suppress(OSError):  # the manager is gone, or does not read now
                self._line.sendto("\n".join(words).encode(), self._address)

    def beat(self, now_ns: int, status: Callable[[], str]) -> None:
        """Notify that a tick is done: READY at the first; then WATCHDOG and STATUS in time."""
        if not self._address or (self._told_ns is not None and now_ns - self._told_ns < self._every_ns):
            return
        ready = ("READY=1",) if self._told_ns is None else ()
        fed = ("WATCHDOG=1",) if self.patience_ns else ()
        self._told_ns = now_ns
        self.tell(*ready, *fed, f"STATUS={status()}")

    def close(self) -> None:
        """Close the socket; nothing more is sent."""
        self._line.close()


def _patience_ns(environment: Mapping[str, str]) -> int:
    """Watchdog limit of the manager; 0: there is none, or it is for another process."""
    if environment.get("WATCHDOG_PID", str(os.getpid())) != str(os.getpid()):
        return 0
    limit_us = environment.get("WATCHDOG_USEC", "")
    return int(limit_us) * 1000 if limit_us.isdecimal() else 0
