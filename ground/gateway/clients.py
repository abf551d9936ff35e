"""Clients of the gateway: ground programs at the addresses of its doors, each known from its first accepted frame.

A client is known until it is silent for 30 s; clients named at the start are known always. This module checks the
frames of each door (format, checksum, signature) and writes the messages to each client, numbered and signed for it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

from ground.gateway import frames
from ground.gateway.desks.missions import Asker, To
from ground.gateway.frames import Writer
from ground.gateway.signing import Verifier
from ground.gateway.texts import Text
from protocol import WireError

Address = tuple[str, int]
_SILENT_NS = 30_000_000_000
_MOST_CLIENTS = 32


class Door(NamedTuple):
    """One way into the gateway.

    name: of the door.
    verifier: check of signatures; None: frames need no signature.
    key: signing key for frames to the clients; None: unsigned.
    """

    name: str
    verifier: Verifier | None = None
    key: bytes | None = None


class ClientMessage(NamedTuple):
    """Message that has passed the checks of its door.

    first: True if it came as MAVLink 1.
    """

    door: Door
    address: Address
    message: Any
    first: bool = False


@dataclass(slots=True)
class Client:
    """One ground program.

    door, address: where its frames come from.
    writer: encodes the frames to it.
    heard_ns: time of its newest frame; None: named at the start, known always.
    target: its system and component.
    joins: True if it joins the pieces of a text: its newest frame was MAVLink 2, or it has sent none.
    """

    door: Door
    address: Address
    writer: Writer
    heard_ns: int | None
    target: tuple[int, int] = (0, 0)
    joins: bool = True

    @property
    def key(self) -> tuple[str, Address]:
        """Key of the client: door and address."""
        return self.door.name, self.address

    @property
    def asker(self) -> Asker:
        """Identity used in replies: client key, system and component id."""
        return Asker(self.key, self.target)


class Clients:
    """All clients. counts: frames accepted ("ok"), and refused frames by kind."""

    def __init__(self) -> None:
        self.counts: dict[str, int] = {"ok": 0}
        self._clients: dict[tuple[str, Address], Client] = {}
        self._doors: dict[str, Door] = {}

    @property
    def known(self) -> tuple[tuple[str, Address], ...]:
        """Door and address of each client."""
        return tuple(self._clients)

    def know(self, door: Door, address: Address) -> None:
        """Add a client that gets telemetry from the start, without having sent anything."""
        client = Client(door, address, Writer(door.key), None)
        self._clients[client.key] = client

    def accept(self, door: Door, address: Address, datagram: bytes, stamp: int) -> list[ClientMessage]:
        """Return the accepted messages of a datagram. Refused frames are counted and change nothing."""
        self._doors[door.name] = door
        heard = []
        for frame in frames.cut(datagram):
            try:
                message = frames.decode(frame)
                if door.verifier is not None:
                    door.verifier.check(frame, stamp)
            except WireError as error:
                self.counts[error.kind] = self.counts.get(error.kind, 0) + 1
                continue
            self.counts["ok"] += 1
            heard.append(ClientMessage(door, address, message, frames.first(frame)))
        return heard

    def marks(self) -> dict[str, int] | None:
        """Return the newest signing times if there are new ones.

        The caller stores them before it acts on the messages.
        """
        news = [door.verifier.news() for door in self._doors.values() if door.verifier is not None]
        known = [marks for marks in news if marks is not None]
        return {stream: at for marks in known for stream, at in marks.items()} if known else None

    def of(self, heard: ClientMessage, now_ns: int) -> Client | None:
        """Return the sender of a message and register it if new; None, and counted, if there are too many clients."""
        key = (heard.door.name, heard.address)
        client = self._clients.get(key)
        if client is None:
            if len(self._clients) >= _MOST_CLIENTS:
                self.counts["clients"] = self.counts.get("clients", 0) + 1
                return None
            client = self._clients[key] = Client(heard.door, heard.address, Writer(heard.door.key), now_ns)
        elif client.heard_ns is not None:
            client.heard_ns = now_ns
        client.joins = not heard.first
        return client

    def forget(self, now_ns: int) -> None:
        """Remove clients that have been silent for more than 30 s."""
        for key, client in list(self._clients.items()):
            if client.heard_ns is not None and now_ns - client.heard_ns > _SILENT_NS:
                del self._clients[key]

    def addressed(self, messages: Iterable[To], stamp: int) -> list[tuple[str, Address, bytes]]:
        """Return door, address and datagram of each message, in order; none for a client that is no longer known."""
        out = []
        for key, message in messages:
            for client in self._clients.values() if key is None else filter(None, [self._clients.get(key)]):
                out += [(*client.key, client.writer.write(one, stamp)) for one in _for(client, message)]
        return out


def _for(client: Client, message: Any) -> list[Any]:
    return message.messages(joins=client.joins) if isinstance(message, Text) else [message]
