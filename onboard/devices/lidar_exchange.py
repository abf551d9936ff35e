"""The phases of the session with the scanner, as a table: what is asked in each, how long it may take, what follows.

Text replies are read twice and must agree (II but for its time): a sum has 6 bits, two replies damaged alike are rare.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

from protocol import scip

_MS = 1_000_000
AGAIN_NS = 50 * _MS  # after a refusal that may pass: the sensor boots or wakes
TRIES = 4  # of a request whose reply came damaged, before its timeout is waited for


class Phase(IntEnum):
    """Where the session stands."""

    DOWN = 0
    SYNC = 1
    TIMING = 2
    VERSION = 3
    GEOMETRY = 4
    STATE = 5
    WRONG = 6
    QUIET = 7
    HEALTH = 8
    LASER = 9
    STREAM = 10
    SUSPECT = 11
    STOP = 12
    DARK = 13


class Exchange(NamedTuple):
    """A request and the phase that follows its reply; if none comes within limit_ns, SYNC does."""

    command: bytes
    then: Phase
    limit_ns: int = 1000 * _MS
    twice: bool = False


EXCHANGES: dict[Phase, Exchange] = {
    Phase.SYNC: Exchange(scip.request("QT"), Phase.VERSION, 150 * _MS),
    Phase.TIMING: Exchange(scip.request("TM", "2"), Phase.SYNC, 150 * _MS),
    Phase.VERSION: Exchange(scip.request("VV"), Phase.GEOMETRY, twice=True),
    Phase.GEOMETRY: Exchange(scip.request("PP"), Phase.STATE, twice=True),
    Phase.STATE: Exchange(scip.request("II"), Phase.QUIET, twice=True),
    Phase.HEALTH: Exchange(scip.request("II"), Phase.QUIET, twice=True),
    Phase.LASER: Exchange(scip.request("BM"), Phase.STREAM),
    Phase.SUSPECT: Exchange(scip.request("II"), Phase.SYNC, 300 * _MS, twice=True),
    Phase.STOP: Exchange(scip.request("QT"), Phase.DARK, 300 * _MS),
    Phase.DARK: Exchange(scip.request("II"), Phase.QUIET, twice=True),
}
PASSING = frozenset(("0A", "0B", "0L", "0M", "10"))
"""Statuses that refuse now and may not later."""


def comparable(answer: scip.Reply) -> bytes | dict[str, str]:
    """What of a text reply must be the same in both readings. Raises WireError where its text is not whole."""
    pairs = scip.parse_text(answer)
    return {key: text for key, text in pairs.items() if key != "TIME"} if answer.echo == b"II" else answer.body
