"""Decoder of the rover's MAVLink bundles: values by the rows of tables.telemetry; events once each, acknowledged."""

from __future__ import annotations

from typing import Any, NamedTuple

from protocol import WireError
from protocol.generated import eldorado_dialect as dialect
from protocol.link import events
from protocol.tables import telemetry

_SEVERITIES = ("critical", "critical", "critical", "error", "warning", "info", "info", "debug")
_ACK_NS = 1_000_000_000
_MAGIC, _FRAME_BYTES = 0xFD, 12  # MAVLink 2: bytes of header and checksum; no frame here is signed


class Value(NamedTuple):
    """One item at onboard time; messages without a stamp take that of the message before."""

    onboard_ns: int
    name: str
    value: float


class Event(NamedTuple):
    """One new event."""

    onboard_ns: int
    serial: int
    severity: str
    name: str
    text: str


class TelemetryReceiver:
    """Decoder for one boot of the rover."""

    def __init__(self) -> None:
        self._mavlink = dialect.MAVLink(None)
        self._events = events.EventReceiver()
        self.onboard_ns = 0
        self.foreign = 0  # messages of another dialect
        self._acked_ns = -_ACK_NS
        self._ack_due_ns: int | None = None

    def receive(self, payload: bytes, now_ns: int) -> list[Value | Event]:
        """Return values and new events of one bundle. Raises WireError("mavlink") on a malformed one."""
        heard: list[Value | Event] = []
        for message in self._messages(payload):
            self._read_stamp(message)
            if message.get_type() == "EVENT":
                self._ack_due_ns = max(now_ns, self._acked_ns + _ACK_NS)
                if self._events.receive(message.serial):
                    name, text = events.texts(message)
                    severity = _SEVERITIES[message.severity & 7]
                    heard.append(Event(message.time_boot_us * 1000, message.serial, severity, name, text))
                continue
            heard += self._values(message)
        return heard

    def acknowledgements(self, now_ns: int) -> list[bytes]:
        """Return Kind.REPORT payloads that acknowledge events; at most one a second."""
        payloads = self._events.send(now_ns)
        if payloads:
            self._acked_ns, self._ack_due_ns = now_ns, None
        return payloads

    def next_due_ns(self) -> int | None:
        """Return the time of the acknowledgement that waits for its second; None if none waits."""
        return self._ack_due_ns

    def _values(self, message: Any) -> list[Value]:
        try:
            return [Value(self.onboard_ns, name, value) for name, value in telemetry.values(message).items()]
        except (ValueError, OverflowError) as error:  # an infinite angle cannot be wrapped
            raise WireError("mavlink", f"{message.get_type()}: {error}") from error

    def _messages(self, payload: bytes) -> list[Any]:
        """Return the readable messages. A message with a foreign layout is skipped by its length, and counted."""
        found, at = list[Any](), 0
        while at < len(payload):
            if payload[at] != _MAGIC or at + _FRAME_BYTES > len(payload):
                raise WireError("mavlink", f"no frame at byte {at} of {len(payload)}")
            size = _FRAME_BYTES + payload[at + 1]
            try:
                found.append(self._mavlink.decode(bytearray(payload[at : at + size])))
            except dialect.MAVError:
                self.foreign += 1
            at += size
        return found

    def _read_stamp(self, message: Any) -> None:
        stamp_ms = getattr(message, "time_boot_ms", None)
        if stamp_ms is not None:
            self.onboard_ns = stamp_ms * 1_000_000
