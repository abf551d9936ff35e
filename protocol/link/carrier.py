"""Carrier A: link datagrams over zenoh to the node that carries them on. Settings, key names and opening probe.

Carrier A, endpoints tcp/...: a reliable local bus to a carrying node (the link emulator; otherwise a modem's node):

    link end (rover or ground)                     carrier (the link emulator)
      subscribes data, then probe answers            subscribes data, then probe questions
      | er2/probe/SIDE/q  "probe N" --------------->  |   again every 20 ms, N counts up
      | <--------------- er2/probe/SIDE/a  "probe N"  |   each question is answered with its own words
      | er2/probe/SIDE/q  "ready" ----------------->  |   after the first answer: this side is open

A sample put right after a declaration may be lost, because the declaration is still under way. Declarations of one
session arrive in their order, so an answered probe proves that both data keys of this side are known too.

Endpoints udp/... are carrier B, without zenoh: `protocol.link.direct`.
"""

from __future__ import annotations

import json

ROVER, GROUND = "rover", "ground"  # the sides
READY = b"ready"
PROBE_PERIOD_NS = 20_000_000
QUEUE_SAMPLES = 65_536
_MESSAGE_BYTES = 4096  # a sample is a datagram; longer data never becomes a sample


def question_key(side: str) -> str:
    """Key of a side's probes."""
    return f"er2/probe/{side}/q"


def answer_key(side: str) -> str:
    """Key of the answers to a side's probes."""
    return f"er2/probe/{side}/a"


def settings(*, connect: str = "", listen: str = "") -> tuple[tuple[str, str], ...]:
    """zenoh configuration of a session on the local bus, as (key, JSON5).

    Scouting is off: the session connects only to the named endpoint. A lost connection is retried without limit.
    """
    rows: list[tuple[str, object]] = [
        ("mode", "peer"),
        ("scouting/multicast/enabled", False),
        ("scouting/gossip/enabled", False),
        ("transport/shared_memory/enabled", False),
        ("transport/link/tx/batch_size", _MESSAGE_BYTES),  # both ends use the smaller one
        ("transport/link/rx/max_message_size", _MESSAGE_BYTES),
        ("connect/endpoints", [connect] if connect else []),
        ("connect/timeout_ms", -1),
        ("connect/exit_on_failure", False),
        ("connect/retry", {"period_init_ms": 50, "period_max_ms": 1000, "period_increase_factor": 2}),
        ("listen/endpoints", [listen] if listen else []),
        ("open/return_conditions/connect_scouted", False),
    ]
    return tuple((key, json.dumps(item)) for key, item in rows)


DIRECT = "udp/"  # prefix of the endpoints of carrier B


class Probe:
    """Opening handshake of one link end, without I/O. `open` is True when the carrier has answered."""

    def __init__(self) -> None:
        self._number = 0
        self._next_ns = 0
        self.open = False

    def send(self, now_ns: int) -> bytes | None:
        """Return the next probe if one is due."""
        if self.open or now_ns < self._next_ns:
            return None
        self._number += 1
        self._next_ns = now_ns + PROBE_PERIOD_NS
        return b"probe %d" % self._number

    def receive(self, answer: bytes) -> bytes | None:
        """Process an answer; return the message to send once if this answer opens the link end, else None."""
        word, _, number = answer.partition(b" ")
        if self.open or word != b"probe" or not number.isdigit() or not 1 <= int(number) <= self._number:
            return None
        self.open = True
        return READY
