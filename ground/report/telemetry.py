"""Battery, currents, uncertainty and link from a record: the rover's telemetry and the frames of its bus."""

from __future__ import annotations

import math

import numpy as np

from ground.link.telemetry import TelemetryReceiver, Value
from onboard.record.schema import PAYLOAD, read_frames, read_link
from onboard.records import F64
from pictures.run_time_line import Lines
from protocol import WireError
from protocol.generated.can_codec import TABLE
from protocol.link.datagrams import DatagramKind

WHEELS = 4
_STATUS = {
    row.can_id: int(row.name.split("_")[1]) - 1
    for row in TABLE.values()
    if row.name.startswith("WHEEL_") and row.name.endswith("_STATUS")
}


class Collector:
    """Collector of the messages of a run's records, in their order. time_s: on the run's axis of time."""

    def __init__(self) -> None:
        self._receiver = TelemetryReceiver()
        self._items: dict[str, list[tuple[float, float]]] = {}
        self._currents: list[list[tuple[float, float]]] = [[] for _ in range(WHEELS)]
        self._sent: list[tuple[float, float]] = []
        self._received: list[tuple[float, float]] = []

    def next_boot(self) -> None:
        """Begin the record of the next boot: its telemetry has stamps and events of its own."""
        self._receiver = TelemetryReceiver()

    def out_link(self, time_s: float, data: bytes) -> None:
        """Take a message of /out/link; a payload that cannot be read counts as bytes only."""
        at = 0
        while at < len(data):
            kind, size = PAYLOAD.unpack_from(data, at)
            at += PAYLOAD.size
            self._sent.append((time_s, 8.0 * size))
            if kind == DatagramKind.MAVLINK:
                self._telemetry(time_s, data[at : at + size])
            at += size

    def in_link(self, time_s: float, data: bytes) -> None:
        """Take a message of /in/link: what reached the rover, refused messages included."""
        self._received += [(time_s, 8.0 * len(message.payload)) for message in read_link(data)]

    def in_can(self, time_s: float, data: bytes) -> None:
        """Take a message of /in/can: the currents of the drive motors. A damaged frame is left out."""
        for frame in read_frames(data):
            wheel = _STATUS.get(frame.can_id)
            if wheel is None:
                continue
            try:
                self._currents[wheel].append((time_s, TABLE[frame.can_id].decode(frame.data).drive_current_a))
            except WireError:
                continue

    def item(self, name: str) -> F64:
        """Return an item's values: (k, 2) of time in s and value; none that is NaN."""
        return _rows(self._items.get(name, []))

    def lines(self) -> Lines:
        """Return the lines of the time line."""
        return Lines(
            self.item("voltage_v"),
            self.item("charge_ratio"),
            self.item("current_a"),
            [_rows(rows) for rows in self._currents] if any(self._currents) else (),
            _rows(self._sent),
            _rows(self._received),
        )

    def _telemetry(self, time_s: float, payload: bytes) -> None:
        try:
            heard = self._receiver.receive(payload, 0)
        except WireError:
            return
        for value in heard:
            if isinstance(value, Value) and math.isfinite(value.value):
                self._items.setdefault(value.name, []).append((time_s, value.value))


def _rows(pairs: list[tuple[float, float]]) -> F64:
    return np.array(pairs, dtype=np.float64).reshape(-1, 2)
