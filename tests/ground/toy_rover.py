"""A rover of a few lines for the tests of the station: executes commands, tells where it is, sends its map.

Sans-I/O like the real one: datagrams and time in, datagrams out. A goto takes `drive_s`, then is completed or failed.
"""

import math
from functools import cache

import numpy as np

from protocol.generated import eldorado_dialect as dialect
from protocol.link import bulk, events, transactions
from protocol.link.datagrams import DOWNLINK_KEY_ID, DatagramKind, LinkKeys, Opener, Sealer, payload_limit
from protocol.link.versions import OURS
from protocol.mavlink_frames import ned_from_enu
from protocol.products import LDEM_CODEC, LdemProduct, MapGrid, encode_ldem
from protocol.tables.modes import Mode
from protocol.tables.telemetry import BY_NAME

TICK_NS = 10_000_000


def a_map(seed: int = 1, cells: int = 200) -> LdemProduct:
    rng = np.random.default_rng(seed)
    heights = np.cumsum(rng.normal(0, 0.01, (cells, cells)), axis=1).astype(np.float32)
    return LdemProduct(MapGrid(0.05, 0.05, 0.1, cells, cells), heights, np.full((cells, cells), 3, np.uint8))


@cache
def an_encoded_map() -> bytes:
    return encode_ldem(a_map())


class ToyRover:
    def __init__(self, keys: LinkKeys, boot_id: int = 1, rate_bps: float = 64e3, drive_s: float = 3.0) -> None:
        self._sealer = Sealer(keys.downlink.key(DOWNLINK_KEY_ID), DOWNLINK_KEY_ID, boot_id)
        self._opener = Opener(keys.command, boot_id=boot_id)
        self._executor, self._events = transactions.Executor(), events.EventSender()
        self._bulk = bulk.Sender(payload_limit(rate_bps))
        self._mavlink = dialect.MAVLink(None)
        self._bytes_per_tick = 0.93 * rate_bps / 8 * TICK_NS / 1e9
        self._tokens = 0.0
        self._drive_ns, self._busy = round(drive_s * 1e9), {}
        self.map = an_encoded_map()
        self.executed: list[str] = []
        self.refused = 0
        self.versions = OURS
        self.lease_of = 0  # station that holds the lease
        self.more_items: dict[str, float] = {}  # sent beside the rest; orders of wheels have WHEELS with them
        self.fails, self.names_object, self.tells = False, True, True

    def receive(self, datagram: bytes, now_ns: int) -> None:
        try:
            opened = self._opener.open(datagram)
        except ValueError:
            self.refused += 1
            return
        self.deliver(opened, now_ns)

    def deliver(self, opened, now_ns: int) -> None:
        """Input of the real rover's core: an accepted LinkMessage or Opened."""
        if opened.kind == DatagramKind.TELECOMMAND:
            order = self._executor.receive(opened.station, opened.payload, now_ns, Mode.STANDBY)
            if order is not None:
                self._execute(order, now_ns)
        elif opened.kind == DatagramKind.BULK_BITMAP:
            self._bulk.receive(opened.payload, now_ns)
        elif opened.kind == DatagramKind.REPORT:
            self._events.acknowledge(opened.payload)

    @property
    def events_waiting(self) -> int:
        return len(self._events)

    def _execute(self, order: transactions.Order, now_ns: int) -> None:
        self.executed.append(order.name)
        data: tuple[float, ...] = ()
        if order.name == "goto":
            self.cancel(now_ns, "another goto came")
            self._busy[order.request_id] = now_ns + self._drive_ns
            self._executor.report(order.request_id, transactions.RequestState.STARTED, now_ns)
            return
        if order.name == "lease_ask" and self.lease_of:
            self._executor.report(order.request_id, transactions.RequestState.STARTED, now_ns)
            return
        if order.name == "stop":
            self.cancel(now_ns, "stopped by the operator")
        if order.name == "get":
            object_id = self._bulk.offer("ldem", self.map, LDEM_CODEC, now_ns)
            data = (object_id,) if self.names_object else ()
        self._executor.report(order.request_id, transactions.RequestState.COMPLETED, now_ns, data=data)

    def tick(self, now_ns: int) -> list[bytes]:
        return [self._sealer.seal(kind, payload) for kind, payload in self.tick_payloads(now_ns)]

    def tick_payloads(self, now_ns: int) -> list[tuple[int, bytes]]:
        for request_id, until_ns in list(self._busy.items()):
            if now_ns >= until_ns:
                del self._busy[request_id]
                state = transactions.RequestState.FAILED if self.fails else transactions.RequestState.COMPLETED
                self._executor.report(request_id, state, now_ns, "no way" if self.fails else "there")
                self.event(now_ns, "FAILED" if self.fails else "ARRIVED", "no way" if self.fails else "there")
        self._tokens = min(self._tokens + self._bytes_per_tick, 2000.0)
        out: list[tuple[int, bytes]] = [(DatagramKind.REPORT, p) for p in self._executor.send(now_ns)]
        if self.tells and now_ns % 500_000_000 == 0:
            out.append((DatagramKind.MAVLINK, self._telemetry(now_ns)))
        for serial, frame in self._events.due(now_ns):
            out.append((DatagramKind.MAVLINK, frame))
            self._events.sent(serial, now_ns)
        self._tokens -= sum(len(p) + 60 for _, p in out)
        chunks = self._bulk.send(now_ns, self._tokens)
        self._tokens -= sum(len(p) + 60 for p in chunks)
        return out + [(DatagramKind.BULK_CHUNK, p) for p in chunks]

    def _telemetry(self, now_ns: int) -> bytes:
        ms = now_ns // 1_000_000
        nan = math.nan
        mode = Mode.AUTONOMOUS if self._busy else Mode.STANDBY
        messages = (
            self._mavlink.rover_state_encode(ms, 0, nan, nan, nan, 0.0, 0.1, 0.01, 1, mode, 0),
            self._mavlink.link_state_encode(ms, *self.versions, self.lease_of, 0),
            self._mavlink.local_position_ned_encode(ms, *ned_from_enu(ms / 1000, 2.0, 0.0), 0.0, 0.0, 0.0),
            self._mavlink.items_encode(ms, [float(self.refused)] + [nan] * 7, [BY_NAME["link_refused"].id] + [0] * 7),
            *self._more(ms),
        )
        return b"".join(message.pack(self._mavlink) for message in messages)

    def _more(self, ms: int) -> list[object]:
        """Return the frames of `more_items`, and the wheels' if it orders them: they turn as ordered, halfway."""
        named = [(BY_NAME[name].id, value) for name, value in self.more_items.items()]
        made: list[object] = []
        for at in range(0, len(named), 8):
            part = named[at : at + 8] + [(0, 0.0)] * (8 - len(named[at : at + 8]))
            made.append(self._mavlink.items_encode(ms, [value for _, value in part], [number for number, _ in part]))
        if "steer_ordered_1_rad" in self.more_items:
            steer = [self.more_items[f"steer_ordered_{n}_rad"] / 2 for n in (1, 2, 3, 4)]
            rate = [self.more_items[f"rate_ordered_{n}_radps"] / 2 for n in (1, 2, 3, 4)]
            made.append(self._mavlink.wheels_encode(ms, steer, rate, [0] * 4))
        return made

    def cancel(self, now_ns: int, reason: str) -> None:
        """Ends what is under way, as a stop or another goto does."""
        for request_id in self._busy:
            self._executor.report(request_id, transactions.RequestState.CANCELLED, now_ns, reason)
        self._busy.clear()

    def event(self, now_ns: int, name: str, text: str) -> None:
        message = self._mavlink.event_encode(now_ns // 1000, self._events.serial + 1, 6, name.encode(), text.encode())
        self._events.add(message.pack(self._mavlink), now_ns)
