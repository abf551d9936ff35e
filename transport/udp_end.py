"""Both ends of carrier B: plain UDP sockets, without a session (protocol.link.direct).

The rover listens. Each listener gets a socket of its own, connected to its address: the system then stores its
datagrams in a separate queue, which a flood from other addresses does not fill.
"""

from __future__ import annotations

import errno
import re
import secrets
import socket
from collections import deque
from contextlib import suppress

from protocol.link import direct
from protocol.link.datagrams import MAX_DATAGRAM, LinkKeys
from protocol.link.direct import Address, Rank, Word
from transport import udp_local
from transport.link_end import LinkEnd, LinkEndError

_BUFFER_BYTES = 1 << 22  # requested; the system may give less
_SHARED_BUFFER_BYTES = 1 << 18  # some 600 datagrams: a few ticks read them, so no one waits long behind a flood
_LOCATOR = re.compile(r"udp/(\[[0-9a-fA-F:]+\]|[^:/\[\]]+):(\d{1,5})")
_WAITING = 64  # datagrams stored before the first `take`; the rest waits in the socket
_SOCKETS = 64  # listeners with a socket of their own; the rest share one
_SHARE, _VIEWER_SHARE = 4, 1  # datagrams per turn of each socket in a take
_RESOLVE_NS = 10_000_000_000
_NOBODY = ("", 0)
# A full queue, no listener, too long, a firewall: the datagram is lost as on a dead link, and the socket is sound.
_PASSING = frozenset({errno.EAGAIN, errno.ECONNREFUSED, errno.ENOBUFS, errno.EMSGSIZE, errno.EPERM})
RATE_BPS = 256_000.0


def parse_locator(text: str) -> Address:
    """Parse `udp/HOST:PORT`. Raises ValueError."""
    found = _LOCATOR.fullmatch(text)
    if not found or int(found[2]) > 65_535:
        raise ValueError("udp/HOST:PORT was expected")
    return found[1].strip("[]"), int(found[2])


class UdpRoverEnd(LinkEnd):
    """The rover's end. rate_bps: of the downlink, which bounds the copies to several listeners.

    Raises ValueError for an endpoint that is no locator, LinkEndError if it cannot be opened.
    """

    def __init__(self, endpoint: str, keys: LinkKeys, rate_bps: float = RATE_BPS) -> None:
        super().__init__()
        self._listeners = direct.Listeners(keys, secrets.token_bytes(16))
        self._copies = direct.Copies(rate_bps)
        self._own: dict[Address, socket.socket] = {}
        self._order: deque[Address | None] = deque([None])  # sockets in the order of reading; None: the shared one
        self._astray: set[Address] = set()  # have a socket, but sent to the shared one
        self._asked: dict[Address, str] = {}  # sender -> rover's own address that it used
        host, port = parse_locator(endpoint)
        try:
            self._family, self._at = _resolved(host, port)
        except ValueError as error:  # before the network is up no name is known
            raise LinkEndError(str(error)) from error
        self._main = socket.socket(self._family, socket.SOCK_DGRAM)
        try:
            self._main.bind(self._at)  # without SO_REUSEADDR: a port that is taken must be an error
        except OSError as error:
            self._main.close()
            raise LinkEndError(error.strerror or str(error)) from error
        self._at = self._main.getsockname()
        _prepare(self._main, _SHARED_BUFFER_BYTES)
        udp_local.prepare(self._main)

    @property
    def port(self) -> int:
        """Port where it listens; an endpoint with port 0 requests any free one."""
        return int(self._at[1])

    @property
    def open(self) -> bool:
        """True if anybody listens."""
        return self.linked

    @property
    def linked(self) -> bool:
        """True if anybody listens."""
        return not self.failed and bool(self._listeners.addresses(self.clock_ns()))

    def knock(self) -> None:
        """Do nothing: the stations knock."""

    def take(self, most: int) -> list[bytes]:
        """Return arrived datagrams, at most `most`; protocol words and errors count too.

        Each socket in turn has a share, so that none of them can delay the others.
        """
        got: list[bytes] = []
        if self.failed:
            return got
        now_ns = self.clock_ns()
        ranks, left, empty = self._listeners.ranks(now_ns), most, set[Address | None]()
        while left > 0 and len(empty) < len(self._order):
            at = self._order[0]
            self._order.rotate(-1)
            if at not in empty:
                share = min(left, _VIEWER_SHARE if ranks.get(at or _NOBODY) is Rank.VIEWER else _SHARE)
                done = self._drain(at, share, got, now_ns)
                left -= done
                if done < share:
                    empty.add(at)
        self.emptied = len(empty) == len(self._order)
        self._follow(now_ns)
        self.taken += len(got)
        return got

    def _drain(self, at: Address | None, share: int, got: list[bytes], now_ns: int) -> int:
        """Read from a socket; return how much of its share was used; less: it is empty."""
        source = self._main if at is None else self._own[at]
        for done in range(share):
            try:
                datagram, sender, local = udp_local.received(source, MAX_DATAGRAM + 1)
            except BlockingIOError:
                return done
            except OSError:  # a listener's port is closed: reported once
                continue
            is_word, answer = self._listeners.receive(datagram, sender, now_ns)
            listens = answer is not None and answer[0] == Word.LISTENING
            if at is None and listens:
                self._asked[sender] = local
            if answer is not None:
                with suppress(OSError):
                    udp_local.send(self._main, answer, sender, local or self._asked.get(sender, ""))
            if not is_word:
                got.append(datagram)
            elif at is None and listens and sender in self._own:
                self._astray.add(sender)
        return share

    def _follow(self, now_ns: int) -> None:
        """Open sockets for present listeners and close the others."""
        wanted = self._listeners.addresses(now_ns)
        for gone in self._own.keys() - set(wanted):
            self._forget(gone)
        for gone in self._asked.keys() - set(wanted):
            del self._asked[gone]
        for address in wanted:
            fresh = address not in self._own and len(self._own) < _SOCKETS
            if fresh or address in self._astray:
                with suppress(OSError):
                    self._adopt(address, self._connected(address))
        self._astray.clear()

    def _adopt(self, address: Address, made: socket.socket) -> None:
        """Use a new socket for a listener; if it has one, only when the rover's own address has changed."""
        own = self._own.get(address)
        if own is not None and own.fileno() >= 0 and own.getsockname() == made.getsockname():
            made.close()
            return
        if own is not None:
            self._forget(address)
        self._own[address] = made
        self._order.append(address)

    def _forget(self, address: Address) -> None:
        self._own.pop(address).close()
        self._order.remove(address)

    def _connected(self, address: Address) -> socket.socket:
        made = socket.socket(self._family, socket.SOCK_DGRAM)
        try:
            for each in (self._main, made):
                each.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            made.bind((self._asked.get(address) or self._at[0], self._at[1]))
            made.connect(address)
        except OSError:
            made.close()
            raise
        finally:  # no other program may have the port: it is enough that one socket does not share it
            self._main.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 0)
        _prepare(made)
        return made

    def put(self, datagram: bytes) -> None:
        """Send to the listeners, within the budget for copies; without a listener it is lost."""
        if self.failed:
            return
        now_ns = self.clock_ns()
        for address in self._copies.of(self._listeners.ranks(now_ns), len(datagram), now_ns):
            self._send(datagram, address)

    def _send(self, datagram: bytes, address: Address) -> None:
        own = self._own.get(address)
        try:
            if own is not None:
                _sent(own, datagram)
                return
        except OSError as error:
            if error.errno in _PASSING:  # a higher layer repeats what must arrive
                return
            self._forget(address)  # its local address is gone
            self._asked.pop(address, None)
        with suppress(OSError):
            udp_local.send(self._main, datagram, address, self._asked.get(address, ""))

    def close(self) -> None:
        """Close the end; may be called again."""
        self.failed = True
        for each in (*self._own.values(), self._main):
            each.close()


class UdpGroundEnd(LinkEnd):
    """A station's end. Raises ValueError for an endpoint that is no locator.

    one_way_s: delay of the link.
    first_nonce: see `direct.Caller`.
    """

    sends_unasked = True

    def __init__(self, endpoint: str, keys: LinkKeys, station: int, one_way_s: float, first_nonce: int) -> None:
        super().__init__()
        self.opening_s, self.eager_ns = direct.opening_s(one_way_s), direct.eager_ns(one_way_s)
        self._caller = direct.Caller(keys, station, first_nonce, one_way_s)
        self._named = parse_locator(endpoint)
        self._family, self._rover = _resolved(*self._named)
        self._resolve_ns = 0  # earliest time of the next look-up: a name server may take seconds
        self._open_socket()
        self._got: list[bytes] = []

    def _open_socket(self) -> None:
        self._socket = socket.socket(self._family, socket.SOCK_DGRAM)
        _prepare(self._socket)
        self._connected = False

    @property
    def open(self) -> bool:
        """True if the rover has answered a hello."""
        return self._caller.open

    @property
    def linked(self) -> bool:
        """True if the rover has answered within the lease."""
        return not self.failed and self._caller.linked(self.clock_ns())

    def knock(self) -> None:
        """Send a hello if one is due, and read its answer; datagrams that come meanwhile are stored for `take`."""
        self._turn(self._got, _WAITING - len(self._got))

    def take(self, most: int) -> list[bytes]:
        """Return arrived datagrams, at most `most`."""
        got, self._got = self._got[:most], self._got[most:]
        self._turn(got, most - len(got))
        self.taken += len(got)
        return got

    def _turn(self, got: list[bytes], work: int) -> None:
        """Read, and send what is due. work: most datagrams, protocol words and errors to read."""
        if self.failed:
            return
        now_ns, self.emptied = self.clock_ns(), False
        for _ in range(work):
            try:
                datagram = self._socket.recv(MAX_DATAGRAM + 1)
            except BlockingIOError:
                self.emptied = not self._got
                break
            except OSError:  # the rover's port is closed: it may open again
                continue
            if not self._caller.receive(datagram, now_ns):
                got.append(datagram)
        hello = self._caller.send(now_ns)
        if hello is not None:
            self._send(hello)

    def _send(self, data: bytes) -> None:
        try:
            if not self._connected:
                self._socket.connect(self._rover)
                self._connected = True
            _sent(self._socket, data)
        except OSError as error:
            if error.errno not in _PASSING:  # this socket's address has no route to the rover
                self._move()

    def _move(self) -> None:
        """Open another socket, from this computer's present address to the present address of the rover's name."""
        now_ns = self.clock_ns()
        if now_ns >= self._resolve_ns:
            self._resolve_ns = now_ns + _RESOLVE_NS
            with suppress(ValueError):
                self._family, self._rover = _resolved(*self._named)
        self._socket.close()
        self._open_socket()

    def put(self, datagram: bytes) -> None:
        """Send a datagram; without a peer it is lost."""
        if not self.failed:
            self._send(datagram)

    def close(self) -> None:
        """Release the place at the rover and close the socket; may be called again."""
        bye = None if self.failed else self._caller.bye()
        for _ in range(2 if bye else 0):
            self._send(bye or b"")
        self.failed = True
        self._socket.close()


def _sent(own: socket.socket, datagram: bytes) -> None:
    """Send from a connected socket. Raises OSError."""
    try:
        own.send(datagram)
    except ConnectionRefusedError:  # caused by an earlier datagram: this one was not sent
        own.send(datagram)


def _resolved(host: str, port: int) -> tuple[socket.AddressFamily, Address]:
    try:
        family, *_, at = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
    except OSError as error:
        raise ValueError(f"{host}: {error.strerror}") from error
    return family, (str(at[0]), int(at[1]))


def _prepare(made: socket.socket, buffer_bytes: int = _BUFFER_BYTES) -> None:
    made.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, buffer_bytes)
    made.setblocking(False)
