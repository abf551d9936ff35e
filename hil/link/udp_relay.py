"""Carrier B's link: a UDP relay that delays and loses by `hil.link.impairment`. What it carries is a zenoh session.

    rover, listens on UDP  <--- [up model] <--- this relay <--- ground, connects to the relay's UDP port
                            ---> [down model] --->

Handshake, declarations and keep-alives of zenoh are delayed and lost like everything else. Wall clock only.
"""

from __future__ import annotations

import socket
from types import TracebackType
from typing import Any, Self

from hil.link.impairment import Profile, both_directions
from hil.link.record import Recorder

_MOST = 65_535
_BUFFER_BYTES = 1 << 20
Address = tuple[str, int]


class UdpRelay:
    """Both sockets and both models. Use it inside `with`. Raises OSError where the ground's port cannot be had.

    rover: where the rover listens. ground: where this listens for the ground; port 0: a free one, see `port`.
    """

    def __init__(self, profile: Profile, seed: int, rover: Address, ground: Address, recorder: Recorder | None) -> None:
        self.down, self.up = both_directions(profile, seed)
        self._recorder, self._rover = recorder, rover
        self._ground: Address | None = None  # the one that spoke last
        self._to_rover, self._to_ground = _socket(("", 0)), _socket(ground)
        self.port: int = self._to_ground.getsockname()[1]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._to_rover.close()
        self._to_ground.close()

    def turn(self, now_ns: int) -> None:
        """Takes what has come, puts what is due."""
        for source, model, name in ((self._to_rover, self.down, "down"), (self._to_ground, self.up, "up")):
            for datagram, sender in _received(source):
                if source is self._to_ground:
                    self._ground = sender
                fate = model.offer(datagram, now_ns)
                if self._recorder is not None:
                    self._recorder.note(name, datagram, now_ns, fate, model.arrivals_ns)
        for datagram in self.up.due(now_ns):
            self._to_rover.sendto(datagram, self._rover)
        for datagram in self.down.due(now_ns):
            if self._ground is not None:
                self._to_ground.sendto(datagram, self._ground)

    def report(self) -> dict[str, Any]:
        """Counts per direction."""
        return {"down": self.down.counts.report(), "up": self.up.counts.report()}


def _socket(address: Address) -> socket.socket:
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER_BYTES)
    made.setblocking(False)
    try:
        made.bind(address)
    except OSError:
        made.close()
        raise
    return made


def _received(source: socket.socket) -> list[tuple[bytes, Address]]:
    got = []
    while True:
        try:
            got.append(source.recvfrom(_MOST))
        except (BlockingIOError, ConnectionError):
            return got
