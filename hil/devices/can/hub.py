"""Bench's CAN bus on a kernel without AF_CAN: a hub that speaks the socketcand protocol on the loopback interface.

    client                         hub
      | -- connect ----------------> |
      | <------------------ < hi > - |
      | -- < open rover > ---------> |
      | <------------------ < ok > - |
      | -- < rawmode > ------------> |
      | <------------------ < ok > - |     the client must read this alone: no frame may follow in the same read
      | -- < echo > or < send .. > > |     the client's first message in raw mode makes it live
      | <-- < frame 181 .. > ...  -- |

One thread, nothing blocks: the bench's loop calls `poll`. Frames of one client go to the other clients as on a wire.
"""

from __future__ import annotations

import select
import socket
import time
from collections.abc import Sequence
from typing import NamedTuple

from onboard.records import Frame, PortState

QUEUE_BYTES = 1 << 18  # of one client, about 5000 frames
_READ = 1 << 16


class ClientState(NamedTuple):
    """Counts of one client.

    number: number of the client
    state: state of its port
    sent: frames queued for it
    received: frames it sent
    dropped: frames that its full queue refused
    """

    number: int
    state: PortState
    sent: int
    received: int
    dropped: int


class _Client:
    def __init__(self, stream: socket.socket) -> None:
        self.number, self.stream, self.state, self.live = -1, stream, PortState.OPEN, False
        self.sent = self.received = self.dropped = 0
        self.out, self.into = bytearray(b"< hi >"), ""
        self.frames: list[Frame] = []

    def put(self, text: bytes, count: int) -> None:
        if len(self.out) + len(text) > QUEUE_BYTES:
            self.dropped += count
            return
        self.sent += count
        self.out += text
        self.flush()

    def flush(self) -> None:
        try:
            while self.out and self.state is PortState.OPEN:
                del self.out[: self.stream.send(self.out)]
        except BlockingIOError:
            return
        except OSError:
            self.lose(PortState.ERROR)

    def lose(self, state: PortState) -> None:
        self.state, self.live = state, False
        self.out.clear()
        self.stream.close()

    def read(self) -> str:
        """Received text, up to the last complete message."""
        try:
            while self.state is PortState.OPEN:
                data = self.stream.recv(_READ)
                if not data:
                    self.lose(PortState.CLOSED)
                self.into += data.decode("ascii", "replace")
                if len(data) < _READ:
                    break
        except BlockingIOError:
            pass
        except OSError:
            self.lose(PortState.ERROR)
        end = self.into.rfind(">") + 1
        whole, self.into = self.into[:end], self.into[end:][-200:]
        return whole


class CanHub:
    """CAN hub. `uri` is the value for a client's configuration. Raises OSError if the address is in use."""

    def __init__(self, host: str = "127.0.0.1", port: int = 0, bus: str = "rover") -> None:
        self._server: socket.socket | None = _server(host, port)
        self._address = host, self._server.getsockname()[1]
        self.bus = bus
        self.uri = f"socketcand:{host}:{self._address[1]}/{bus}"
        self.malformed = 0
        self._callers: list[_Client] = []  # open connections
        self._clients: list[_Client] = []  # clients that opened the bus, by number

    @property
    def clients(self) -> tuple[ClientState, ...]:
        """Counts of every client since the start, in the order of connection; lost clients stay as CLOSED or ERROR."""
        return tuple(ClientState(c.number, c.state, c.sent, c.received, c.dropped) for c in self._clients)

    @property
    def live(self) -> int:
        """Number of connected clients past the handshake: frames go to these."""
        return sum(c.live for c in self._clients)

    def listen(self, wanted: bool) -> None:
        """Accept new clients or refuse them, as if no server were there."""
        if wanted and self._server is None:
            self._server = _server(*self._address)
        elif not wanted and self._server is not None:
            self._server.close()
            self._server = None

    def wait_client(self, number: int, limit_s: float) -> int:
        """Block until client `number` is live; returns its number. Raises TimeoutError after `limit_s`."""
        deadline = time.monotonic() + limit_s
        while len(self._clients) <= number or not self._clients[number].live:
            left = deadline - time.monotonic()
            if left <= 0:
                raise TimeoutError(f"CAN client {number} did not come within {limit_s:g} s")
            self.wait(left)
        return number

    def poll(self) -> None:
        """Accept new clients, read and answer, send queued data. Never blocks."""
        self._accept()
        for client in self._callers:
            self._serve(client)
            client.flush()
        if any(client.state is not PortState.OPEN for client in self._callers):
            self._callers = [client for client in self._callers if client.state is PortState.OPEN]

    def wait(self, limit_s: float) -> None:
        """Block until a client has sent something, at most `limit_s`; then poll."""
        streams = [c.stream for c in self._callers if c.state is PortState.OPEN]
        if self._server:
            streams.append(self._server)
        select.select(streams, [], [], limit_s)
        self.poll()

    def write(self, frames: Sequence[Frame]) -> None:
        """Send frames of the emulated nodes to every live client in this order, stamped with their own times.

        A client that opened the bus before this call is live: its first message is read here if it waits.
        """
        if any(not client.live for client in self._callers):
            self.poll()
        self._spread(frames, None)

    def write_error(self, classes: int, detail: int = 0, stamp_ns: int = 0) -> None:
        """Send an error frame to every client; it counts as a frame.

        classes: SocketCAN's error classes (0x40 bus-off, 0x100 restarted)
        detail: byte 1 of its data, in bits 16 to 23 of the id as well: the client drops the data.
        """
        text = f"< error {0x20000000 | detail << 16 | classes:08X} {_seconds(stamp_ns)} >".encode()
        for client in self._clients:
            if client.live:
                client.put(text, 1)

    def read(self, stamp_ns: int = 0) -> list[Frame]:
        """Frames that clients sent since the last call, with this stamp; by client in the order of connection."""
        got: list[Frame] = []
        for client in self._clients:
            got += [Frame(can_id, data, stamp_ns) for can_id, data, _ in client.frames]
            client.frames.clear()
        return got

    def read_upto(self, number: int, total: int, limit_s: float, stamp_ns: int = 0) -> list[Frame]:
        """Block until client `number` has sent `total` frames since it connected, then return as `read`. For lock-step.

        Raises TimeoutError with both counts after `limit_s`, ConnectionError if the client is gone.
        """
        client = self._clients[number]
        deadline = time.monotonic() + limit_s
        self.poll()
        while client.received < total:
            if client.state is not PortState.OPEN:
                raise ConnectionError(f"CAN client {number} is gone after {client.received} of {total} frames")
            left = deadline - time.monotonic()
            if left <= 0:
                raise TimeoutError(f"CAN client {number} sent {client.received} of {total} frames within {limit_s:g} s")
            self.wait(left)
        return self.read(stamp_ns)

    def disconnect(self, number: int) -> None:
        """Disconnect one client (a fault of the scenario); no effect if it is gone."""
        if self._clients[number].state is PortState.OPEN:
            self._clients[number].flush()
            self._clients[number].lose(PortState.CLOSED)

    def close(self) -> None:
        """Close every socket of the hub."""
        for client in self._callers:
            if client.state is PortState.OPEN:
                client.flush()
                client.lose(PortState.CLOSED)
        self.listen(False)

    def _accept(self) -> None:
        while self._server:
            try:
                stream, _ = self._server.accept()
            except BlockingIOError:
                return
            stream.setblocking(False)
            stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            client = _Client(stream)
            self._callers.append(client)
            client.flush()

    def _serve(self, client: _Client) -> None:
        whole = client.read()
        if not whole:
            return
        sent: list[Frame] = []
        for message in whole.split(">")[:-1]:
            words = message.split()
            if len(words) > 3 and words[0] == "<" and words[1] == "send":
                self._sent(words, sent)
            else:
                self._answer(client, words)
        if sent and client.number >= 0:
            client.live = client.state is PortState.OPEN
            client.received += len(sent)
            client.frames += sent
            self._spread(sent, client)

    def _sent(self, words: list[str], into: list[Frame]) -> None:
        try:
            data = bytes([int(word, 16) for word in words[4:]])
            if len(data) != int(words[3], 16):
                raise ValueError(words[3])
            into.append(Frame(int(words[2], 16), data))
        except ValueError:
            self.malformed += 1

    def _answer(self, client: _Client, words: list[str]) -> None:
        match words:
            case ["<", "open", self.bus]:
                client.number = len(self._clients)
                self._clients.append(client)
                client.out += b"< ok >"
            case ["<", "rawmode"] if client.number >= 0:
                client.out += b"< ok >"
            case ["<", "open", other]:
                client.out += f"< error no bus {other} here, it is {self.bus} >".encode()
            case ["<", "echo"] if client.number >= 0:
                client.live = True
            case _:
                self.malformed += 1
        client.flush()

    def _spread(self, frames: Sequence[Frame], origin: _Client | None) -> None:
        receivers = [c for c in self._clients if c.live and c is not origin]
        if not receivers or not frames:
            return
        rows = [f"< frame {can_id:03X} {_seconds(stamp_ns)} {data.hex()} >" for can_id, data, stamp_ns in frames]
        text = "".join(rows).encode()
        for client in receivers:
            client.put(text, len(frames))


def _server(host: str, port: int) -> socket.socket:
    server = socket.create_server((host, port))
    server.setblocking(False)
    return server


def _seconds(stamp_ns: int) -> str:
    return f"{stamp_ns // 1_000_000_000}.{stamp_ns // 1000 % 1_000_000:06d}"
