"""A CAN bus over TCP: the client of a socketcand server, or of the bench's hub.

    server: < hi >   client: < open rover >   server: < ok >   client: < rawmode >   server: < ok >   client: < echo >
    then   client: < send 181 8 1 2a .. >     server: < frame 181 12.345678 012A.. > or < error 20000040 12.345678 >

python-can has such a client too; tests hold both to the same frames. Its send blocks, an end of file is "no message"
for ever; it took a seventh of the flight program's time in lock-step and 0.1 s of its start.
"""

from __future__ import annotations

import select
import socket
from collections import deque
from collections.abc import Sequence

from onboard.drivers.can_bus import CanBus, Heard, Kind
from onboard.records import Frame, PortState

_CONNECT_LIMIT_S, _ANSWER_LIMIT_S = 2.0, 30.0
_READ, _LONGEST = 1 << 16, 200
_FLAGS = 0x1FFFFFFF  # of an error frame's id


def open_socketcand(host: str, port: int, bus: str) -> CanBus:
    """Connects and opens the bus. Raises OSError."""
    try:
        stream = socket.create_connection((host, port), _CONNECT_LIMIT_S)
        try:
            _shake_hands(stream, bus)
        except OSError:
            stream.close()
            raise
        return SocketcandBus(stream)
    except OSError as error:
        where = f"socketcand:{host}:{port}/{bus}"
        raise OSError(f"{where} cannot be opened ({error}); is the bench or a socketcand server running?") from error


def _shake_hands(stream: socket.socket, bus: str) -> None:
    stream.settimeout(_ANSWER_LIMIT_S)
    stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    for expected, word in ((b"< hi >", f"< open {bus} >"), (b"< ok >", "< rawmode >"), (b"< ok >", "< echo >")):
        told = b""
        while not told.endswith(b">") and (byte := stream.recv(1)):  # not one byte of a frame that follows
            told += byte
        if told != expected:
            raise ConnectionError(f"expected {expected.decode()}, given {told.decode(errors='replace') or 'nothing'}")
        stream.sendall(word.encode())


class SocketcandBus(CanBus):
    """One stream past its handshake. Nothing blocks: what the line does not take goes with the next call."""

    def __init__(self, stream: socket.socket) -> None:
        super().__init__()
        self._socket = stream
        self._socket.setblocking(False)
        self.malformed = 0
        self._rest = b""  # of a message that has begun
        self._unsent = b""
        self._heard: deque[Heard] = deque()

    def write(self, frames: Sequence[Frame]) -> int:
        """See CanBus; a tick's frames are taken all or, while earlier ones wait, not at all."""
        if not (frames and self._flush()) or self._unsent:
            return len(frames)
        rows = [f"< send {can_id:03X} {len(data):X} {data.hex(' ')} >" for can_id, data, _ in frames]
        self._unsent = "".join(rows).encode()
        if not self._flush():
            return len(frames)
        self.sent += len(frames)
        return 0

    def close(self) -> None:
        """See CanBus."""
        self.state = PortState.CLOSED
        self._heard.clear()
        self._socket.close()

    def _flush(self) -> bool:
        """Sends what the line takes of what waits; whether there is a line."""
        try:
            if self._unsent and self.state is not PortState.CLOSED:
                self._unsent = self._unsent[self._socket.send(self._unsent) :]
        except BlockingIOError:
            pass
        except OSError:
            self.state = PortState.CLOSED
        return self.state is not PortState.CLOSED

    def _receive(self) -> Heard | None:
        if not self._heard and self.state is not PortState.CLOSED:
            self._fill()
        return self._heard.popleft() if self._heard else None

    def _fill(self) -> None:
        self._flush()
        try:
            data = self._socket.recv(_READ)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self.state = PortState.CLOSED
            return
        *whole, rest = (self._rest + data).split(b">")
        self._rest = rest[-_LONGEST:]
        for message in whole:
            heard = _parse(message)
            if heard is None:
                self.malformed += 1
            else:
                self._heard.append(heard)

    def _wait(self, limit_s: float) -> None:
        select.select([self._socket], [], [], limit_s)


def _parse(message: bytes) -> Heard | None:
    """A message without its closing bracket; None for one that is not understood."""
    words = message.split()
    if len(words) < 4 or words[0] != b"<":
        return None
    try:
        can_id = int(words[2], 16)
        if words[1] == b"error":
            return Heard(can_id & _FLAGS, b"", Kind.ERROR)
        data = bytes.fromhex(b"".join(words[4:]).decode("ascii"))
    except ValueError:
        return None
    if words[1] != b"frame":
        return None
    return Heard(can_id, data, Kind.DATA if len(words[2]) == 3 else Kind.FOREIGN)
