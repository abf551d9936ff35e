"""Sockets of the bridge: telemetry packets out, telecommand packets in, each over UDP or TCP. Nothing here blocks.

    udp:HOST:PORT   telemetry is sent to it; telecommands are received on it        one packet a datagram
    tcp:HOST:PORT   the bridge listens for both; each client gets or sends packets  one packet after the other

A TCP client whose backlog exceeds 1 MiB because it reads too slowly is disconnected; it may connect again.
"""

from __future__ import annotations

import ipaddress
import socket
from contextlib import suppress
from types import TracebackType
from typing import NamedTuple, Self

from ground.ccsds.bridge import Bridge
from ground.link.news import News
from ground.station.station import StationError
from protocol import WireError
from protocol.ccsds import space_packets

_MOST_PER_TURN = 64
_BACKLOG_BYTES = 1 << 20
_CLIENTS = 8
_WAKE_NS = 100_000_000


class Address(NamedTuple):
    """Address to which packets go or from which they come."""

    carrier: str
    host: str
    port: int

    @property
    def is_local(self) -> bool:
        """True if only this machine can reach the address."""
        return ipaddress.IPv4Address(self.host).is_loopback


def parse_address(text: str) -> Address:
    """Parse an address like `udp:127.0.0.1:10015`. Raises ValueError with what was found and what is allowed."""
    carrier, _, rest = text.partition(":")
    host, _, port = rest.rpartition(":")
    try:
        if carrier not in ("udp", "tcp") or not 0 <= int(port) <= 65_535:
            raise ValueError
        ipaddress.IPv4Address(host)
    except ValueError:
        raise ValueError(f"{text} should be like udp:127.0.0.1:10015 or tcp:127.0.0.1:10015") from None
    return Address(carrier, host, int(port))


def _opened(address: Address, listen: bool) -> socket.socket:
    kind = socket.SOCK_STREAM if address.carrier == "tcp" else socket.SOCK_DGRAM
    at = socket.socket(socket.AF_INET, kind)
    try:
        if kind == socket.SOCK_STREAM:
            at.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if listen:
            at.bind((address.host, address.port))
        if kind == socket.SOCK_STREAM:
            at.listen(_CLIENTS)
        at.setblocking(False)
    except OSError as error:
        at.close()
        raise StationError(
            f"{address.carrier}:{address.host}:{address.port}: {error.strerror or error}; "
            "name another port, or end what listens there"
        ) from error
    return at


class _Client:
    """One TCP connection."""

    def __init__(self, peer: socket.socket) -> None:
        peer.setblocking(False)
        self.peer, self.splitter, self.backlog = peer, space_packets.Splitter(), bytearray()

    def read(self) -> list[bytes]:
        """Return whole packets.

        Raises OSError if the client has disconnected, WireError if its data are not space packets.
        """
        try:
            data = self.peer.recv(65_536)
        except BlockingIOError:
            return []
        if not data:
            raise ConnectionResetError
        return self.splitter.receive(data)

    def write(self, data: bytes) -> None:
        """Send as much as the socket takes; the rest waits.

        Raises OSError if the client has disconnected or does not read.
        """
        self.backlog += data
        with suppress(BlockingIOError):
            del self.backlog[: self.peer.send(self.backlog)]
        if len(self.backlog) > _BACKLOG_BYTES:
            raise ConnectionAbortedError


class Port:
    """One open address. damaged: number of TCP clients disconnected because their data were not packets."""

    def __init__(self, address: Address, listen: bool) -> None:
        self._address, self._at = address, _opened(address, listen or address.carrier == "tcp")
        self._clients: list[_Client] = []
        self.damaged = 0

    @property
    def bound(self) -> tuple[str, int]:
        """Actual address and port; a configured port of 0 selects any free one."""
        host, port = self._at.getsockname()
        return host, port

    def close(self) -> None:
        """Close the socket and all client connections."""
        for client in self._clients:
            client.peer.close()
        self._at.close()

    def read(self) -> list[bytes]:
        """Return the packets received."""
        if self._address.carrier == "udp":
            return self._datagrams()
        self._accept()
        found: list[bytes] = []
        for client in list(self._clients):
            try:
                found += client.read()
            except WireError:
                self.damaged += 1
                self._hang_up(client)
            except OSError:
                self._hang_up(client)
        return found

    def write(self, packets: list[bytes]) -> None:
        """Send packets to the UDP address or to all connected clients; having no receiver is not an error."""
        if self._address.carrier == "udp":
            for packet in packets:
                try:
                    self._at.sendto(packet, self._address[1:])
                except OSError:
                    continue  # no receiver, or the queue is full: telemetry is sent again
            return
        self._accept()
        for client in list(self._clients):
            try:
                client.write(b"".join(packets))
            except OSError:
                self._hang_up(client)

    def _datagrams(self) -> list[bytes]:
        found = []
        for _ in range(_MOST_PER_TURN):
            try:
                found.append(self._at.recv(space_packets.MOST_BYTES))
            except (BlockingIOError, ConnectionError):
                break
        return found

    def _accept(self) -> None:
        try:
            peer, _ = self._at.accept()
        except OSError:  # nobody, one that has left already, or no descriptor is free now
            return
        if len(self._clients) >= _CLIENTS:
            peer.close()
        else:
            self._clients.append(_Client(peer))

    def _hang_up(self, client: _Client) -> None:
        client.peer.close()
        self._clients.remove(client)


class BridgeShell:
    """The bridge with its ports, attached to an operation of the station (`operate.Beside`). Use it inside `with`.

    telecommands: None: no telecommands are accepted.
    """

    def __init__(self, bridge: Bridge, telemetry: Address, telecommands: Address | None) -> None:
        self._bridge, self._now_ns = bridge, 0
        self.telemetry = Port(telemetry, listen=False)
        try:
            self.telecommands = Port(telecommands, listen=True) if telecommands is not None else None
        except StationError:
            self.telemetry.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.telemetry.close()
        if self.telecommands is not None:
            self.telecommands.close()

    def turn(self, news: list[News], now_ns: int) -> None:
        """Run one turn of the operation."""
        self._now_ns = now_ns
        for packet in self.telecommands.read() if self.telecommands is not None else ():
            self._bridge.receive(packet, now_ns)
        self._bridge.turn(news, now_ns)
        self.telemetry.write(self._bridge.send())

    def next_due_ns(self) -> int:
        """Return the time of the next turn. The wall clock polls the sockets each turn; otherwise 0.1 s is enough."""
        return self._now_ns + _WAKE_NS
