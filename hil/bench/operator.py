"""An operator without a station: orders at exact times, by the link's own datagrams, over a link without delay.

    orders -> Requester -> sealed datagram -> opened and checked as the rover's port does -> LinkMessage
    the rover's reports -> Requester: what became of each order

He asks again until an order's outcome is known, which is also his sign of life. Telemetry and products he leaves alone,
events he does not acknowledge.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from onboard.drivers.link_port import checked
from onboard.records import LinkMessage
from protocol import commands
from protocol.link import Kind, Opener, Sealer, bench_keys
from protocol.transactions import Request, Requester

STATION = 1


@dataclass(frozen=True, slots=True)
class Order:
    """A command by its name in protocol.commands, asked at `at_s` of bench time."""

    at_s: float
    name: str
    arguments: Mapping[str, commands.Value] = field(default_factory=dict)


def orders_of(script: str) -> tuple[Order, ...]:
    """The lines `at SECONDS: COMMAND` of an operator's script. Raises ValueError for one that is no command."""
    lines = [line.partition("#")[0].strip() for line in script.splitlines()]
    timed = [line[3:].partition(":") for line in lines if line.startswith("at ")]
    return tuple(Order(float(at_s), *commands.parse(words.split())) for at_s, _, words in timed)


class Operator:
    """Both ends of the uplink, keys from the seed as on the bench."""

    def __init__(self, orders: Sequence[Order], seed: int, boot_id: int) -> None:
        keys = bench_keys(seed).command
        key = keys.key(STATION)
        assert key is not None, "bench keys have a station 1"
        self._waiting = sorted(orders, key=lambda order: order.at_s)
        self._requester = Requester(STATION)
        self._sealer, self._opener = Sealer(key, STATION, boot_id), Opener(keys, boot_id=boot_id)

    def ask(self, order: Order) -> None:
        """One order more, at its time or, where that is past, in the next tick."""
        self._waiting = sorted([*self._waiting, order], key=lambda order: order.at_s)

    def messages(self, now_ns: int) -> tuple[LinkMessage, ...]:
        """What reaches the rover in the tick at `now_ns`. Raises ValueError for an order that is no command."""
        return tuple(checked(self._opener, datagram, now_ns) for datagram in self.datagrams(now_ns))

    def datagrams(self, now_ns: int) -> tuple[bytes, ...]:
        """The same as it leaves the station."""
        while self._waiting and now_ns >= round(self._waiting[0].at_s * 1e9):
            order = self._waiting.pop(0)
            self._requester.request(order.name, order.arguments, now_ns)
        payloads = self._requester.send(now_ns) if self._requester.open else ()
        return tuple(self.seal(Kind.TELECOMMAND, data) for data in payloads)

    def seal(self, kind: Kind, payload: bytes) -> bytes:
        """A datagram of this station, whatever is in it."""
        return self._sealer.seal(kind, payload)

    def hear(self, payloads: Iterable[tuple[int, bytes]], now_ns: int) -> None:
        """What the rover sent in this tick."""
        for kind, data in payloads:
            if kind == Kind.REPORT:
                self._requester.receive(data, now_ns)

    @property
    def done(self) -> bool:
        """Whether every order was given and its outcome is known."""
        return not (self._waiting or self._requester.open)

    @property
    def requests(self) -> tuple[Request, ...]:
        """The orders given so far, with what became of each."""
        return tuple(self._requester.requests.values())
