"""The flight program's own ports in a bench of one process: bus, scanner and link, each fed from a queue.

    hostilities -> queue of the kernel, bounded -> CanBus, LidarPort, LinkPort: budgets, counts, checks -> Inputs

Budgets of bytes, frames and datagrams apply; budgets of time do not, since the bench has no wall clock. Input that
arrives while a queue is full is lost, as in a kernel.
"""

from __future__ import annotations

import socket
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

from onboard.config import Config
from onboard.drivers.can.base import CanBus
from onboard.drivers.lidar.byte_port import LidarPort
from onboard.drivers.link.port import LinkPort
from onboard.records import Chunk, Frame, LinkMessage
from protocol.link.datagrams import bench_keys
from transport.link_end import LinkEnd

MOST_FRAMES, MOST_BYTES, MOST_DATAGRAMS = 4_000, 65_536, 8_192  # of the kernel's queues


@dataclass(frozen=True, slots=True)
class _Message:
    """Data frame in the form of python-can."""

    arbitration_id: int
    data: bytes
    arrived_ns: int
    is_error_frame = is_remote_frame = is_extended_id = False


class _Wire:
    """A python-can bus with a queue of frames."""

    def __init__(self) -> None:
        self.waiting: deque[_Message] = deque()

    def recv(self, timeout: float) -> _Message | None:
        """Return the next frame, or None."""
        return self.waiting.popleft() if self.waiting else None


class CanDoor(CanBus):
    """The bus port. Frames keep their time of arrival, as the kernel stamps them."""

    def __init__(self) -> None:
        self._wire = _Wire()
        super().__init__(self._wire)
        self.clock_ns = lambda: 0

    def feed(self, frames: Iterable[Frame]) -> None:
        """Put frames on the bus."""
        for frame in frames:
            if len(self._wire.waiting) < MOST_FRAMES:
                self._wire.waiting.append(_Message(*frame))

    def _stamp_ns(self, message: _Message, stamp_ns: int) -> int:
        return message.arrived_ns


class LidarDoor(LidarPort):
    """The scanner's port on one end of a socket pair."""

    def __init__(self) -> None:
        super().__init__("in memory")
        self._far, near = socket.socketpair()
        self._far.setblocking(False)
        near.setblocking(False)
        self._fd, self._fed = near.detach(), 0
        self._opened()

    @property
    def waiting(self) -> int:
        """Number of bytes not read yet."""
        return self._fed - self.received

    def connect(self) -> None:
        """Nothing to do: it is open."""

    def feed(self, data: bytes) -> None:
        """Send the scanner's bytes."""
        self._fed += self._far.send(data[: MOST_BYTES - self.waiting])

    def drain(self) -> None:
        """Discard bytes in transit after the end of a connection."""
        self._fill(self.waiting)
        self._pending.clear()

    def close(self) -> None:
        """Close both ends."""
        super().close()
        self._far.close()


class _End(LinkEnd):
    """Link end with a queue of datagrams."""

    open = linked = True

    def __init__(self) -> None:
        super().__init__()
        self.waiting: deque[bytes] = deque()

    def knock(self) -> None:
        """Nothing to do: it is open."""

    def take(self, most: int) -> list[bytes]:
        """See LinkEnd."""
        got = [self.waiting.popleft() for _ in range(min(most, len(self.waiting)))]
        self.taken, self.emptied = self.taken + len(got), not self.waiting
        return got

    def put(self, datagram: bytes) -> None:
        """Nothing to do: the bench reads the rover's datagrams elsewhere."""

    def close(self) -> None:
        """Nothing to do."""


class Doors:
    """The three ports of a flight. The caller closes it."""

    def __init__(self, config: Config, seed: int) -> None:
        self._end, self._can, self._lidar = _End(), CanDoor(), LidarDoor()
        self._link = LinkPort("", bench_keys(seed), config.link.boot_count, end=self._end)
        self._link.clock_ns = lambda: 0

    def can(self, frames: Iterable[Frame], now_ns: int) -> tuple[Frame, ...]:
        """Put frames on the bus and return those that the flight program reads in this tick."""
        self._can.feed(frames)
        return tuple(self._can.read(now_ns))

    def lidar(self, pieces: list[tuple[int, bytes]] | None, now_ns: int, strange: bool) -> tuple[Chunk, ...]:
        """Do the same for the scanner; pieces None while its port is closed.

        Bytes keep their time of arrival. While the scanner is strange or bytes wait, it is the time of reading.
        """
        if pieces is None:
            self._lidar.drain()
            return ()
        if not (strange or self._lidar.waiting):
            return tuple(Chunk(at_ns, data) for at_ns, data in pieces)
        self._lidar.feed(b"".join(data for _, data in pieces))
        return self._lidar.read(now_ns)

    def link(self, datagrams: Iterable[bytes], now_ns: int) -> tuple[LinkMessage, ...]:
        """Do the same for the link."""
        room = MOST_DATAGRAMS - len(self._end.waiting)
        self._end.waiting.extend([*datagrams][:room])
        return self._link.read(now_ns)

    def close(self) -> None:
        """Close sockets and threads."""
        self._lidar.close()
        self._link.close()
