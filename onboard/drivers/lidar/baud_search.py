"""Search for the bit rate of a scanner on a serial line, and its change to the wanted rate. No I/O.

    QT at each rate until one brings the echo -> SSbbbbbb at that rate -> QT at the wanted rate -> found

A sensor in mid-scan answers when its scan is over, so each rate gets the time of a scan at the slowest rate.
"""

from __future__ import annotations

from typing import NamedTuple

from protocol import scip

_QUIT = b"\n" + scip.request("QT")
_ANSWERS = (b"QT\n00P\n\n", b"QT\n10Q\n\n")  # the second during time adjustment, which the session ends
_WAIT_NS = 600_000_000
_KEPT = 64  # newest bytes that are stored: an answer may start in them


class Move(NamedTuple):
    """Action on the line: first set the rate (None: unchanged), then write the bytes."""

    rate_bps: int | None = None
    data: bytes = b""


class BaudSearch:
    """Search; call `step` with the bytes read until `done`. found: the sensor answers at the wanted rate."""

    def __init__(self, wanted_bps: int, rates_bps: tuple[int, ...]) -> None:
        self.done = False
        self.found = False
        self._wanted_bps = wanted_bps
        self._left = [*(rate for rate in rates_bps if rate != wanted_bps), wanted_bps]  # taken from the end
        self._rate_bps = 0
        self._setting = False
        self._heard = b""
        self._until_ns: int | None = None

    def step(self, data: bytes, now_ns: int) -> Move:
        """Return the action to take now; none while an answer may still come."""
        self._heard = self._heard[-_KEPT:] + data
        if self._until_ns is None:
            return self._try(now_ns)
        if self._setting and self._told():
            self._left, self._setting = [self._wanted_bps], False
            return self._try(now_ns)
        if not self._setting and any(answer in self._heard for answer in _ANSWERS):
            return self._answered(now_ns)
        return self._try(now_ns) if now_ns >= self._until_ns else Move()

    def _answered(self, now_ns: int) -> Move:
        if self._rate_bps == self._wanted_bps:
            self.done = self.found = True
            return Move()
        self._setting, self._heard, self._until_ns = True, b"", now_ns + _WAIT_NS
        return Move(data=scip.request("SS", f"{self._wanted_bps:06d}"))

    def _told(self) -> bool:
        """Return whether the reply to SS came; only the new rate shows its result."""
        return f"SS{self._wanted_bps:06d}\n".encode() in self._heard and self._heard.endswith(b"\n\n")

    def _try(self, now_ns: int) -> Move:
        if not self._left:
            self.done = True
            return Move()
        self._rate_bps, self._heard, self._until_ns, self._setting = self._left.pop(), b"", now_ns + _WAIT_NS, False
        return Move(self._rate_bps, _QUIT)
