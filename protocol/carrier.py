"""How datagrams ride on zenoh between a link end and whoever carries them: settings, key names, the opening probe.

Carrier A, endpoints tcp/...: a reliable local bus to a node that carries on (the link emulator; else a modem's):

    link end (rover or ground)                     carrier (the link emulator)
      subscribes data, then probe answers            subscribes data, then probe questions
      | er2/probe/SIDE/q  "probe N" --------------->  |   again every 20 ms, N counts up
      | <--------------- er2/probe/SIDE/a  "probe N"  |   each question is answered with its own words
      | er2/probe/SIDE/q  "ready" ----------------->  |   after the first answer: this side is open

A sample put right after a declaration may be lost, because the declaration is still under way. Declarations of one
session arrive in their order, so an answered probe proves that both data keys of this side are known too.

Carrier B, endpoints udp/...: one zenoh session over the link itself. The rover listens, the ground connects; samples
are best-effort, and no probe is needed: what is above repeats what it must. Measured with zenoh 1.10:

Rule 1: a handshake takes four one-way trips and nothing of it is sent again, so a try may take 4.8 of them and 1 s, no
        longer; the default of 10 s never opens at 2.6 s, and far too long a time waits for what was lost. Who waits
        for a session waits three tries.
Rule 2: a lease of 90 s with 12 keep-alives outlives a blackout of 60 s.
Rule 3: a batch is a datagram: at most 1200 B, or UDP is cut up by IP. A put is never blocked and never queued for long.
Rule 4: declarations are sent once, those of the numbers that stand for keys too. Where an end stays deaf or mute it
        declares its subscription anew in another spelling, and at last the ground opens the session anew (Watchdog).
"""

from __future__ import annotations

import json
from enum import Enum

ROVER, GROUND = "rover", "ground"  # the sides
READY = b"ready"
PROBE_PERIOD_NS = 20_000_000
QUEUE_SAMPLES = 65_536


def question_key(side: str) -> str:
    """Key of a side's probes."""
    return f"er2/probe/{side}/q"


def answer_key(side: str) -> str:
    """Key of the answers to a side's probes."""
    return f"er2/probe/{side}/a"


def settings(*, connect: str = "", listen: str = "") -> tuple[tuple[str, str], ...]:
    """zenoh configuration of a session on the local bus, as (key, JSON5).

    Nothing is searched for and nothing is offered but the named endpoint; a lost neighbour is called again for ever.
    """
    rows: list[tuple[str, object]] = [
        ("mode", "peer"),
        ("scouting/multicast/enabled", False),
        ("scouting/gossip/enabled", False),
        ("transport/shared_memory/enabled", False),
        ("connect/endpoints", [connect] if connect else []),
        ("connect/timeout_ms", -1),
        ("connect/exit_on_failure", False),
        ("connect/retry", {"period_init_ms": 50, "period_max_ms": 1000, "period_increase_factor": 2}),
        ("listen/endpoints", [listen] if listen else []),
        ("open/return_conditions/connect_scouted", False),
    ]
    return tuple((key, json.dumps(item)) for key, item in rows)


DIRECT = "udp/"  # how the endpoints of carrier B begin
_TRIES = 2
_OPENINGS, _PAUSE_S = 3, 1.0
_LEASE_MS, _KEEP_ALIVES, _BATCH_BYTES = 90_000, 12, 1200


def handshake_s(one_way_s: float) -> float:
    """How long one try to open carrier B's session may take (rule 1)."""
    return 4.8 * one_way_s + 1.0


def opening_s(one_way_s: float) -> float:
    """How long to wait for carrier B's session before nobody is there: three tries with zenoh's pauses."""
    return _OPENINGS * (handshake_s(one_way_s) + _PAUSE_S)


def direct_settings(*, connect: str = "", listen: str = "", one_way_s: float) -> tuple[tuple[str, str], ...]:
    """zenoh configuration of carrier B's session, as (key, JSON5); one_way_s: the link's delay."""
    open_ms = round(1000 * handshake_s(one_way_s))
    rows: list[tuple[str, object]] = [
        ("transport/unicast/open_timeout", open_ms),
        ("transport/unicast/accept_timeout", open_ms),
        ("transport/link/tx/lease", _LEASE_MS),
        ("transport/link/tx/keep_alive", _KEEP_ALIVES),
        ("transport/link/tx/batch_size", _BATCH_BYTES),
        ("routing/interests/timeout", 30_000),
        ("open/return_conditions/declares", False),
        ("connect/retry", {"period_init_ms": 500, "period_max_ms": 1000, "period_increase_factor": 2}),
    ]
    base = [row for row in settings(connect=connect, listen=listen) if row[0] != "connect/retry"]
    return (*base, *((key, json.dumps(item)) for key, item in rows))


class Cure(Enum):
    """What an end of a direct session should do now."""

    NONE = 0
    DECLARE = 1  # its subscription anew, by the other of `spellings`
    REOPEN = 2  # the session


def spellings(key: str) -> tuple[str, str]:
    """Two expressions for one key: each crosses the link as a number that is told once, and may be lost, too."""
    return key, key + "/**"


class Watchdog:
    """Finds a direct session that is linked and deaf or mute, because a declaration was lost (rule 4).

    Only before the first sample and the first sign that ours are wanted: a link that has worked is in a blackout, and
    is let be. may_reopen: the ground's end; the rover's cannot know whether anybody has something to say.
    """

    def __init__(self, one_way_s: float, may_reopen: bool) -> None:
        self._wait_ns = round(1e9 * (2.0 + 3 * one_way_s))
        self._may_reopen = may_reopen
        self._since_ns: int | None = None
        self._tries = 0
        self._heard = self._wanted = False

    def step(self, now_ns: int, *, linked: bool, heard: bool, wanted: bool) -> Cure:
        """heard: something came since the last call; wanted: the other end is known to subscribe."""
        if not linked or self._since_ns is None:
            self._since_ns, self._tries, self._heard, self._wanted = now_ns, 0, False, False
            return Cure.NONE
        self._heard, self._wanted = self._heard or heard, self._wanted or wanted
        sound = self._heard and self._wanted if self._may_reopen else self._heard
        if sound or now_ns - self._since_ns < self._wait_ns:
            return Cure.NONE
        self._since_ns, self._tries = now_ns, self._tries + 1
        if self._tries <= _TRIES:
            return Cure.DECLARE
        if not self._may_reopen:
            return Cure.NONE
        self._since_ns = None
        return Cure.REOPEN


class Probe:
    """The opening of one link end, without I/O: what to put on the question key, and whether the way is open."""

    def __init__(self) -> None:
        self._number = 0
        self._next_ns = 0
        self.open = False

    def send(self, now_ns: int) -> bytes | None:
        """The next probe when it is time for one."""
        if self.open or now_ns < self._next_ns:
            return None
        self._number += 1
        self._next_ns = now_ns + PROBE_PERIOD_NS
        return b"probe %d" % self._number

    def receive(self, answer: bytes) -> bytes | None:
        """An answer; returns what to put once when it opens the way."""
        word, _, number = answer.partition(b" ")
        if self.open or word != b"probe" or not number.isdigit() or not 1 <= int(number) <= self._number:
            return None
        self.open = True
        return READY
