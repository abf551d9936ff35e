"""Both ends of carrier B: plain UDP sockets, without a session (protocol.direct).

The rover listens. Each listener gets a socket of its own, connected to its address: the system then keeps what it sends
in a queue of its own, which a flood from other addresses does not fill.
"""

from __future__ import annotations

import re
import secrets
import socket
from contextlib import suppress

from onboard.drivers.link_end import LinkEnd, LinkEndError
from protocol import direct
from protocol.direct import Address
from protocol.link import MAX_DATAGRAM, LinkKeys

_BUFFER_BYTES = 1 << 22  # the system gives what it allows
_LOCATOR = re.compile(r"udp/(\[[0-9a-fA-F:]+\]|[^:/\[\]]+):(\d{1,5})")
_WAITING = 64  # datagrams kept before the first `take`; the rest waits in the socket
_SOCKETS = 64  # listeners with a socket of their own; the rest share one


def parse_locator(text: str) -> Address:
    """`udp/HOST:PORT`. Raises ValueError."""
    found = _LOCATOR.fullmatch(text)
    if not found or int(found[2]) > 65_535:
        raise ValueError("udp/HOST:PORT was expected")
    return found[1].strip("[]"), int(found[2])


class UdpRoverEnd(LinkEnd):
    """The rover's end. Raises ValueError for an endpoint that is no locator, LinkEndError where it cannot be had."""

    def __init__(self, endpoint: str, keys: LinkKeys) -> None:
        super().__init__()
        self._listeners = direct.Listeners(keys, secrets.token_bytes(16))
        self._own: dict[Address, socket.socket] = {}
        self._family, self._at = _resolved(endpoint)
        self._main = socket.socket(self._family, socket.SOCK_DGRAM)
        try:
            self._main.bind(self._at)  # without SO_REUSEADDR: a port that is taken must be an error
        except OSError as error:
            self._main.close()
            raise LinkEndError(error.strerror or str(error)) from error
        self._at = self._main.getsockname()
        _prepare(self._main)

    @property
    def port(self) -> int:
        """Where it listens; an endpoint with port 0 asks for any free one."""
        return int(self._at[1])

    @property
    def open(self) -> bool:
        """Whether anybody listens."""
        return self.linked

    @property
    def linked(self) -> bool:
        """Whether anybody listens."""
        return not self.failed and bool(self._listeners.addresses(self.clock_ns()))

    def knock(self) -> None:
        """The stations knock."""

    def take(self, most: int) -> list[bytes]:
        """The datagrams that have arrived, at most `most`; those of listeners first."""
        got: list[bytes] = []
        now_ns = self.clock_ns()
        for source in (*self._own.values(), self._main) if not self.failed else ():
            self._drain(source, got, most, now_ns)
        self._follow(now_ns)
        self.taken += len(got)
        return got

    def _drain(self, source: socket.socket, got: list[bytes], most: int, now_ns: int) -> None:
        for _ in range(most - len(got)):
            try:
                datagram, (host, port, *_) = source.recvfrom(MAX_DATAGRAM + 1)
            except BlockingIOError:
                return
            except OSError:  # somebody's port is closed: he says so once
                continue
            is_word, answer = self._listeners.receive(datagram, (host, port), now_ns)
            if answer is not None:
                with suppress(OSError):
                    self._main.sendto(answer, (host, port))
            if not is_word:
                got.append(datagram)

    def _follow(self, now_ns: int) -> None:
        """Sockets for those who listen now, and for nobody else."""
        wanted = self._listeners.addresses(now_ns)
        for gone in self._own.keys() - set(wanted):
            self._own.pop(gone).close()
        for address in wanted:
            if address not in self._own and len(self._own) < _SOCKETS:
                with suppress(OSError):
                    self._own[address] = self._connected(address)

    def _connected(self, address: Address) -> socket.socket:
        made = socket.socket(self._family, socket.SOCK_DGRAM)
        try:
            for each in (self._main, made):
                each.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            made.bind(self._at)
            made.connect(address)
        except OSError:
            made.close()
            raise
        finally:  # nobody else may have the port
            self._main.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 0)
        made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 0)
        _prepare(made)
        return made

    def put(self, datagram: bytes) -> None:
        """To each who listens; where nobody does it is lost."""
        if self.failed:
            return
        for address in self._listeners.addresses(self.clock_ns()):
            own = self._own.get(address)
            with suppress(OSError):  # full, or nobody there: what must arrive is repeated above
                own.send(datagram) if own is not None else self._main.sendto(datagram, address)

    def close(self) -> None:
        """Ends it; may be called again."""
        self.failed = True
        for each in (*self._own.values(), self._main):
            each.close()


class UdpGroundEnd(LinkEnd):
    """A station's end. one_way_s: the link's delay. Raises ValueError for an endpoint that is no locator."""

    def __init__(self, endpoint: str, keys: LinkKeys, station: int, one_way_s: float) -> None:
        super().__init__()
        self.opening_s = direct.opening_s(one_way_s)
        self._caller = direct.Caller(keys, station, secrets.randbits(62))
        family, self._rover = _resolved(endpoint)
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        _prepare(self._socket)
        self._connected = False
        self._got: list[bytes] = []

    @property
    def open(self) -> bool:
        """Whether the rover has answered a hello."""
        return self._caller.open

    @property
    def linked(self) -> bool:
        """Whether the rover has answered within the lease."""
        return not self.failed and self._caller.linked(self.clock_ns())

    def knock(self) -> None:
        """A hello where one is due, and its answer; datagrams that come meanwhile are kept for `take`."""
        self._turn(self._got, _WAITING)

    def take(self, most: int) -> list[bytes]:
        """The datagrams that have arrived, at most `most`."""
        got, self._got = self._got[:most], self._got[most:]
        self._turn(got, most)
        self.taken += len(got)
        return got

    def _turn(self, got: list[bytes], most: int) -> None:
        now_ns = self.clock_ns()
        if self.failed:
            return
        for _ in range(most - len(got)):
            try:
                datagram = self._socket.recv(MAX_DATAGRAM + 1)
            except BlockingIOError:
                break
            except OSError:  # the rover's port is closed: it may open again
                continue
            if not self._caller.receive(datagram, now_ns):
                got.append(datagram)
        hello = self._caller.send(now_ns)
        if hello is not None:
            self._send(hello)

    def _send(self, data: bytes) -> None:
        with suppress(OSError):  # no way there now, or a full queue: it is lost, as on a dead link
            if not self._connected:
                self._socket.connect(self._rover)
                self._connected = True
            self._socket.send(data)

    def put(self, datagram: bytes) -> None:
        """Puts a datagram; where nobody is there it is lost."""
        if not self.failed:
            self._send(datagram)

    def close(self) -> None:
        """Gives up the place at the rover; may be called again."""
        bye = None if self.failed else self._caller.bye()
        for _ in range(2 if bye else 0):
            self._send(bye or b"")
        self.failed = True
        self._socket.close()


def _resolved(endpoint: str) -> tuple[socket.AddressFamily, Address]:
    host, port = parse_locator(endpoint)
    try:
        family, *_, at = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
    except OSError as error:
        raise ValueError(f"{host}: {error.strerror}") from error
    return family, (str(at[0]), int(at[1]))


def _prepare(made: socket.socket) -> None:
    made.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER_BYTES)
    made.setblocking(False)
