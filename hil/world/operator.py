"""Operator without a station: commands at exact times, in the link's own datagrams, over a link without delay.

    commands -> Requester -> sealed datagram -> opened and checked as the rover's port does -> LinkMessage
    the rover's reports -> Requester: outcome of each command

The operator retransmits until the outcome of a command is known, which also keeps the contact alive. It ignores
telemetry and products and does not acknowledge events.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from onboard.drivers.link.port import checked
from onboard.records import LinkMessage
from protocol.link.datagrams import DatagramKind, Opener, Sealer, bench_keys
from protocol.link.transactions import Request, Requester
from protocol.tables import commands

STATION = 1


@dataclass(frozen=True, slots=True)
class TimedCommand:
    """A command by its name in protocol.tables.commands, sent at `at_s` of bench time."""

    at_s: float
    name: str
    arguments: Mapping[str, commands.Value] = field(default_factory=dict)


def orders_of(script: str) -> tuple[TimedCommand, ...]:
    """Lines `at SECONDS: COMMAND` of an operator's script. Raises ValueError for an unknown command."""
    lines = [line.partition("#")[0].strip() for line in script.splitlines()]
    timed = [line[3:].partition(":") for line in lines if line.startswith("at ")]
    return tuple(TimedCommand(float(at_s), *commands.parse(words.split())) for at_s, _, words in timed)


class Operator:
    """Both ends of the uplink, with the bench keys of the seed."""

    def __init__(self, orders: Sequence[TimedCommand], seed: int, boot_id: int) -> None:
        keys = bench_keys(seed).command
        key = keys.key(STATION)
        assert key is not None, "bench keys have a station 1"
        self._waiting = sorted(orders, key=lambda order: order.at_s)
        self._requester = Requester(STATION)
        self._sealer, self._opener = Sealer(key, STATION, boot_id), Opener(keys, boot_id=boot_id)

    def ask(self, order: TimedCommand) -> None:
        """Add a command, sent at its time or, if that is past, in the next tick."""
        self._waiting = sorted([*self._waiting, order], key=lambda order: order.at_s)

    def messages(self, now_ns: int) -> tuple[LinkMessage, ...]:
        """Messages that reach the rover in the tick at `now_ns`. Raises ValueError for an unknown command."""
        return tuple(checked(self._opener, datagram, now_ns) for datagram in self.datagrams(now_ns))

    def datagrams(self, now_ns: int) -> tuple[bytes, ...]:
        """Same messages as sealed datagrams, as they leave the station."""
        while self._waiting and now_ns >= round(self._waiting[0].at_s * 1e9):
            order = self._waiting.pop(0)
            self._requester.request(order.name, order.arguments, now_ns)
        payloads = self._requester.send(now_ns) if self._requester.open else ()
        return tuple(self.seal(DatagramKind.TELECOMMAND, data) for data in payloads)

    def seal(self, kind: DatagramKind, payload: bytes) -> bytes:
        """Sealed datagram of this station with any payload."""
        return self._sealer.seal(kind, payload)

    def hear(self, payloads: Iterable[tuple[int, bytes]], now_ns: int) -> None:
        """Receive the payloads that the rover sent in this tick."""
        for kind, data in payloads:
            if kind == DatagramKind.REPORT:
                self._requester.receive(data, now_ns)

    @property
    def done(self) -> bool:
        """True if every command was sent and its outcome is known."""
        return not (self._waiting or self._requester.open)

    @property
    def requests(self) -> tuple[Request, ...]:
        """Commands sent so far, with their outcomes."""
        return tuple(self._requester.requests.values())
