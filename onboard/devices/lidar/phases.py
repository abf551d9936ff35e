"""TABLE of the phases of the scanner session: request, time limit and next phase of each.

Text replies are read twice and must agree (II except for its time): their sum has 6 bits, and two replies damaged alike
are rare.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

from protocol import scip

_MS = 1_000_000
AGAIN_NS = 50 * _MS  # wait after a temporary refusal: the sensor boots or wakes
TRIES = 4  # repeats after a damaged reply, before the timeout applies


class Phase(IntEnum):
    """Phase of the session."""

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
    PROBE = 14
    TIME_ON = 15
    TIME = 16
    TIME_OFF = 17


CONNECTING = frozenset((Phase.DOWN, Phase.SYNC, Phase.TIMING, Phase.VERSION, Phase.GEOMETRY, Phase.PROBE, Phase.STATE,
                        Phase.WRONG))  # fmt: skip
"""In these the sensor has not told all that must be known of it."""
SEEDING = frozenset((Phase.TIME_ON, Phase.TIME, Phase.TIME_OFF))


class Exchange(NamedTuple):
    """One row: a request and the phase after its reply.

    command: bytes of the request.
    then: phase after the reply.
    limit_ns: time limit of the reply; after it the phase is SYNC.
    twice: the reply is text that must be read twice.
    refused: phase after a refusal, if the session can go on without.
    note: key of `info` for the result.
    timed: the time of its reply counts, so it is never repeated: the reply could belong to either request.
    """

    command: bytes
    then: Phase
    limit_ns: int = 1000 * _MS
    twice: bool = False
    refused: Phase | None = None
    note: str = ""
    timed: bool = False


EXCHANGES: dict[Phase, Exchange] = {
    Phase.SYNC: Exchange(scip.request("QT"), Phase.VERSION, 150 * _MS),
    Phase.TIMING: Exchange(scip.request("TM", "2"), Phase.SYNC, 150 * _MS, refused=Phase.SYNC),
    Phase.VERSION: Exchange(scip.request("VV"), Phase.GEOMETRY, twice=True),
    Phase.GEOMETRY: Exchange(scip.request("PP"), Phase.PROBE, twice=True),
    Phase.PROBE: Exchange(scip.request("%ST"), Phase.STATE, 300 * _MS, refused=Phase.STATE, note="%ST"),
    Phase.STATE: Exchange(scip.request("II"), Phase.QUIET, twice=True),
    Phase.HEALTH: Exchange(scip.request("II"), Phase.QUIET, twice=True),
    Phase.TIME_ON: Exchange(scip.request("TM", "0"), Phase.TIME, 300 * _MS, refused=Phase.QUIET, note="TM"),
    Phase.TIME: Exchange(
        scip.request("TM", "1"), Phase.TIME_OFF, 300 * _MS, refused=Phase.TIME_OFF, note="TM", timed=True
    ),
    Phase.TIME_OFF: Exchange(scip.request("TM", "2"), Phase.QUIET, 300 * _MS, refused=Phase.SYNC, note="TM"),
    Phase.LASER: Exchange(scip.request("BM"), Phase.STREAM),
    Phase.SUSPECT: Exchange(scip.request("II"), Phase.SYNC, 300 * _MS, twice=True),
    Phase.STOP: Exchange(scip.request("QT"), Phase.DARK, 300 * _MS),
    Phase.DARK: Exchange(scip.request("II"), Phase.QUIET, twice=True),
}
PASSING = frozenset(("0A", "0B", "0L", "0M", "10"))
"""Statuses that refuse now and may not later."""


def comparable(answer: scip.Reply) -> bytes | dict[str, str]:
    """Return the part of a text reply that must agree in both readings. Raises WireError if its text is damaged."""
    pairs = scip.parse_text(answer)
    return {key: text for key, text in pairs.items() if key != "TIME"} if answer.echo == b"II" else answer.body
