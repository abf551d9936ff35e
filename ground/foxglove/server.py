"""WebSocket server for Foxglove: it publishes what the station's link brings, and takes no commands.

A client that subscribes gets the newest map, path and scan at once, for these come seldom. Subscriptions arrive in a
thread of the library; `turn` publishes in the link's own.
"""

from __future__ import annotations

import queue
from collections.abc import Sequence
from contextlib import suppress
from types import TracebackType
from typing import Any, Self

import foxglove
from foxglove.channels import GridChannel, PointCloudChannel
from foxglove.websocket import ChannelView, Client, ServerListener

from ground.foxglove import shapes
from ground.foxglove.messages import CHANNELS, link, messages
from ground.link.news import News, ProductHeard
from ground.link.session import Session
from ground.station.station import StationError
from protocol import WireError
from protocol.products import decode_ldem
from protocol.products.scan import decode_scan

NAME = "El Dorado"
_LINK_NS = 1_000_000_000


class _Listener(ServerListener):
    """Notes the topics that are subscribed to."""

    def __init__(self) -> None:
        self.topics: queue.SimpleQueue[str] = queue.SimpleQueue()

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        """Called in a thread of the library."""
        self.topics.put(channel.topic)


class FoxgloveServer:
    """The server. Use it inside `with`, and call `turn` from one thread. Raises StationError if the port is in use."""

    def __init__(self, host: str, port: int) -> None:
        self._host, self._wanted_port = host.strip("[]"), port
        self._context, self._listener = foxglove.Context(), _Listener()
        self._channels: dict[str, Any] = {}
        self._newest: dict[str, tuple[Any, int]] = {}
        self._boot_id, self._next_link_ns = 0, 0

    def __enter__(self) -> Self:
        for topic, row in CHANNELS.items():
            schema = {"type": "object", "title": row.schema, "properties": dict(row.fields)}
            self._channels[topic] = foxglove.Channel(topic, schema=schema, context=self._context)
        self._channels["/map"] = GridChannel("/map", context=self._context)
        self._channels["/points"] = PointCloudChannel("/points", context=self._context)
        try:
            self._server = foxglove.start_server(
                name=NAME,
                host=self._host,
                port=self._wanted_port,
                context=self._context,
                server_listener=self._listener,
            )
        except RuntimeError as error:
            why = str(error).rpartition(": ")[2]
            raise StationError(
                f"port {self._wanted_port} of {self._host}, for Foxglove: {why}; name another with --foxglove-port"
            ) from None
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._server.stop()

    @property
    def port(self) -> int:
        """Port that clients connect to."""
        return self._server.port

    def turn(self, news: Sequence[News], session: Session, now_ns: int) -> None:
        """Publish one turn's news of the session."""
        if session.boot_id and session.boot_id != self._boot_id:  # 0: nothing was received in this session yet
            if self._boot_id:
                self._server.clear_session()  # onboard time restarts: clients drop what they have
                self._newest.clear()
            self._boot_id = session.boot_id
        for message in messages(news, session.items):
            self._publish(message.topic, message.value, message.at_ns)
        for one in news:
            if isinstance(one, ProductHeard):
                self._publish_product(one, session)
        if now_ns >= self._next_link_ns or now_ns < self._next_link_ns - _LINK_NS:  # a new session restarts its clock
            self._next_link_ns = now_ns + _LINK_NS
            self._publish_link(session, now_ns)
        self._repeat()

    def _publish(self, topic: str, value: Any, at_ns: int) -> None:
        self._channels[topic].log(value, log_time=max(0, at_ns))
        if topic == "/path" or topic not in CHANNELS:
            self._newest[topic] = (value, at_ns)

    def _publish_product(self, heard: ProductHeard, session: Session) -> None:
        onboard_ns = session.far_clock.onboard_ns(heard.at_ns) or 0
        with suppress(WireError):  # a damaged product is reported by the station
            if heard.product.name == "ldem":
                self._publish("/map", shapes.grid(decode_ldem(heard.product.data), onboard_ns), onboard_ns)
            elif heard.product.name == "scan":
                self._publish("/points", shapes.cloud(decode_scan(heard.product.data)), onboard_ns)

    def _publish_link(self, session: Session, now_ns: int) -> None:
        if session.heard_ns is None:
            return
        value = link(
            (now_ns - session.heard_ns) / 1e9,
            session.far_clock.rtt_ns / 1e9,
            session.counts,
            session.in_contact(now_ns),
        )
        self._publish("/link", value, session.far_clock.onboard_ns(now_ns) or 0)

    def _repeat(self) -> None:
        """Publish the newest map, path or scan again for a new subscription."""
        with suppress(queue.Empty):
            while True:
                topic = self._listener.topics.get_nowait()
                if topic in self._newest:
                    self._publish(topic, *self._newest[topic])
