"""Bench's end of the barrier: one master, several participants; each runs a tick when it is called.

`begin` sends TICK to one participant, `finish` waits for its DONE; between the two the bench can work itself (it
computes the next step of the plant while onboard computes). A participant that dies or does not answer within the limit
ends the run with its name.
"""

from __future__ import annotations

import contextlib
import select
import socket
from collections.abc import Callable, Set

from protocol.barrier import Channel, Done, Hello, Receiver, Stop, Tick, Welcome, encode
from protocol.conventions import TICK_NS

ANSWER_LIMIT_S = 120.0
GATHER_S = 0.001  # poll period of the other ports while participants connect: a handshake takes several polls


class ParticipantLostError(RuntimeError):
    """A participant closed its connection or did not answer."""

    def __init__(self, name: str, what: str) -> None:
        super().__init__(f"{name}: {what}")
        self.name = name


class Participant:
    """One connection of the barrier."""

    def __init__(self, name: str, connection: socket.socket, receiver: Receiver) -> None:
        self.name = name
        self.wake_tick = 0
        self.sent: dict[str, int] = {}
        self._socket = connection
        self._receiver = receiver
        self._waiting_for: int | None = None

    def begin(self, number: int, now_ns: int, channels: tuple[Channel, ...], machine: tuple[float, ...] = ()) -> None:
        """Send TICK: the participant runs this tick."""
        self._waiting_for = number
        try:
            self._socket.sendall(encode(Tick(number, now_ns, channels, machine)))
        except OSError as error:
            raise ParticipantLostError(self.name, f"gone before tick {number} ({error})") from error

    def finish(self, alive: Callable[[], None]) -> Done:
        """Wait for DONE. `alive` is called twice a second while waiting and raises if a process has died."""
        waited_s = 0.0
        while True:
            if not select.select([self._socket], [], [], 0.5)[0]:
                alive()
                waited_s += 0.5
                if waited_s > ANSWER_LIMIT_S:
                    what = f"no answer to tick {self._waiting_for} in {ANSWER_LIMIT_S:.0f} s"
                    raise ParticipantLostError(self.name, what)
                continue
            try:
                data = self._socket.recv(65536)
            except OSError as error:
                what = f"connection lost in tick {self._waiting_for} ({error})"
                raise ParticipantLostError(self.name, what) from error
            if not data:
                raise ParticipantLostError(self.name, f"closed the barrier in tick {self._waiting_for}")
            for message in self._receiver.receive(data):
                assert isinstance(message, Done) and message.number == self._waiting_for, message
                self.sent, self.wake_tick = message.sent, message.wake_tick
                return message

    def stop(self, reason: str) -> None:
        """Send STOP: the run is over."""
        with contextlib.suppress(OSError):  # it may be gone already
            self._socket.sendall(encode(Stop(reason)))

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()


class Barrier:
    """Server of the barrier; participants register by name."""

    def __init__(self, host: str = "127.0.0.1") -> None:
        self._server = socket.create_server((host, 0))
        self.address = f"tcp:{host}:{self._server.getsockname()[1]}"
        self.participants: dict[str, Participant] = {}

    def gather(self, names: Set[str], alive: Callable[[], None]) -> None:
        """Wait until all of `names` have sent HELLO."""
        while not names <= self.participants.keys():
            if not select.select([self._server], [], [], GATHER_S)[0]:
                alive()
                continue
            connection, _ = self._server.accept()
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            receiver = Receiver()
            messages: list[object] = []
            while not messages:
                data = connection.recv(4096)
                if not data:
                    raise ParticipantLostError("unknown", "left before HELLO")
                messages += receiver.receive(data)
            hello = messages[0]
            assert isinstance(hello, Hello)
            connection.sendall(encode(Welcome(TICK_NS, 1)))
            self.participants[hello.name] = Participant(hello.name, connection, receiver)

    def drop(self, name: str) -> None:
        """Remove a killed participant from the barrier."""
        self.participants.pop(name).close()

    def close(self, reason: str = "") -> None:
        """Stop all participants and close."""
        for participant in self.participants.values():
            participant.stop(reason)
        for participant in self.participants.values():
            participant.close()
        self._server.close()
