"""Link of carrier B: a UDP relay that delays and loses by `hil.link.impairment`.

    rover, listens on UDP  <--- [up model] <--- this relay <--- ground, connects to the relay's UDP port
                            ---> [down model] --->

Hellos and their answers (protocol.link.direct) are delayed and lost like other datagrams. Each sender port on the
ground's side gets a separate port towards the rover, which distinguishes its listeners by these ports. Wall clock only.
"""

from __future__ import annotations

import socket
from contextlib import suppress
from types import TracebackType
from typing import Any, Self

from hil.link.impairment import Impairment, Profile, both_directions
from hil.link.record import Recorder
from protocol.link.datagrams import MAX_DATAGRAM

_MOST_SESSIONS = 64  # beyond this the oldest session is dropped
_MOST_PER_TURN = 1000  # datagrams of one socket; the rest waits in its buffer
_BUFFER_BYTES = 1 << 20
Address = tuple[str, int]


class _AddressedDatagram(bytes):
    """Datagram with its sender or receiver on the ground's side."""

    ground: Address

    def __new__(cls, data: bytes, ground: Address) -> _AddressedDatagram:
        made = super().__new__(cls, data)
        made.ground = ground
        return made


class UdpRelay:
    """Both sockets and both models. Use it inside `with`. Raises OSError if the ground's port is not available.

    rover: address on which the rover listens
    ground: address on which the relay listens for the ground; port 0: a free one, see `port`
    """

    def __init__(self, profile: Profile, seed: int, rover: Address, ground: Address, recorder: Recorder | None) -> None:
        self.down, self.up = both_directions(profile, seed)
        self._recorder, self._rover = recorder, rover
        self._to_ground = _socket()
        try:
            self._to_ground.bind(ground)
        except OSError:
            self._to_ground.close()
            raise
        self._to_rover: dict[Address, socket.socket] = {}  # by the ground address for which they stand
        self.port: int = self._to_ground.getsockname()[1]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        for each in (self._to_ground, *self._to_rover.values()):
            each.close()

    def turn(self, now_ns: int) -> None:
        """Receive waiting datagrams and send the due ones."""
        for datagram, sender in _received(self._to_ground):
            if sender not in self._to_rover:
                self._open(sender)
            self._offer("up", self.up, _AddressedDatagram(datagram, sender), now_ns)
        for ground, mine in self._to_rover.items():
            for datagram, _ in _received(mine):
                self._offer("down", self.down, _AddressedDatagram(datagram, ground), now_ns)
        for addressed in self.up.due(now_ns):
            assert isinstance(addressed, _AddressedDatagram)
            if addressed.ground in self._to_rover:
                with suppress(ConnectionError):  # no receiver at the moment
                    self._to_rover[addressed.ground].send(addressed)
        for addressed in self.down.due(now_ns):
            assert isinstance(addressed, _AddressedDatagram)
            self._to_ground.sendto(addressed, addressed.ground)

    def _open(self, ground: Address) -> None:
        if len(self._to_rover) == _MOST_SESSIONS:
            self._to_rover.pop(next(iter(self._to_rover))).close()
        self._to_rover[ground] = _socket()
        self._to_rover[ground].connect(self._rover)  # accept datagrams only from the rover

    def _offer(self, name: str, model: Impairment, datagram: _AddressedDatagram, now_ns: int) -> None:
        fate = model.offer(datagram, now_ns)
        if self._recorder is not None:
            self._recorder.note(name, datagram, now_ns, fate, model.arrivals_ns)

    def report(self) -> dict[str, Any]:
        """Counts per direction."""
        return {"down": self.down.counts.report(), "up": self.up.counts.report()}


def _socket() -> socket.socket:
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER_BYTES)
    made.setblocking(False)
    return made


def _received(source: socket.socket) -> list[tuple[bytes, Address]]:
    got: list[tuple[bytes, Address]] = []
    for _ in range(_MOST_PER_TURN):
        try:
            got.append(source.recvfrom(MAX_DATAGRAM + 1))
        except (BlockingIOError, ConnectionError):
            break
    return got
