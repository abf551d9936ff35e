"""One operator station's end of the link without I/O: datagrams and time in, datagrams and news out.

    receive(datagram, now) -> news: items, events, reports, products, progress
    request(name, arguments, now) -> request id, kept asking until its outcome is known
    send(now) -> datagrams: requests, bitmaps of transfers, acknowledgements of events

Nothing is sent before the rover was heard: its boot id is part of every uplink datagram. Times are the station's clock;
`FarClock` turns them into onboard time for the expiry of requests.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from ground.telemetry import TelemetryReceiver, Value
from protocol import WireError, bulk, commands, transactions
from protocol.link import DOWNLINK_KEY_ID, Kind, LinkKeys, Opener, Sealer, payload_limit

_BULK_WAKE_NS = 100_000_000
_BULK_TAIL_NS = 10_000_000_000


class Item(NamedTuple):
    """A telemetry value; the newest wins."""

    at_ns: int
    onboard_ns: int
    name: str
    value: float


class EventHeard(NamedTuple):
    """An event of the rover, once."""

    at_ns: int
    onboard_ns: int
    serial: int
    severity: str
    name: str
    text: str


class ReportHeard(NamedTuple):
    """News of one of this station's requests."""

    at_ns: int
    name: str
    report: transactions.Report


class ProductHeard(NamedTuple):
    """A whole object, its SHA-256 checked."""

    at_ns: int
    product: bulk.Product


class Progress(NamedTuple):
    """How far a transfer is, in chunks."""

    at_ns: int
    name: str
    have: int
    total: int


News = Item | EventHeard | ReportHeard | ProductHeard | Progress


@dataclass(slots=True)
class FarClock:
    """Onboard time as seen from here: the smallest age of what was heard is taken for the one-way delay's own."""

    rtt_ns: int = 0
    _ahead_ns: int | None = None

    def hear(self, onboard_ns: int, now_ns: int) -> None:
        """A stamp of the rover that arrived now."""
        ahead_ns = onboard_ns - now_ns
        self._ahead_ns = ahead_ns if self._ahead_ns is None else max(self._ahead_ns, ahead_ns)

    def forget(self) -> None:
        """The rover booted: its clock begins anew."""
        self._ahead_ns = None

    def measure(self, answered_ns: int) -> None:
        """The first answer to a request came after this time: a round trip, and more where its first copy was lost.

        So a smaller one is taken at once and a larger one only by an eighth.
        """
        larger_ns = self.rtt_ns + (answered_ns - self.rtt_ns) // 8
        self.rtt_ns = answered_ns if not self.rtt_ns else min(answered_ns, larger_ns)

    def onboard_ns(self, now_ns: int) -> int | None:
        """What the rover's clock shows about now; None until it was heard."""
        return None if self._ahead_ns is None else now_ns + self._ahead_ns + self.rtt_ns // 2


class Session:
    """The station's state: what was asked, what is known of the rover, what is on its way."""

    def __init__(self, keys: LinkKeys, station: int, *, up_bps: float = 256e3, newest_boot_id: int = 0) -> None:
        key = keys.command.key(station)
        if key is None:
            raise ValueError(f"no key of station {station}")
        self.station = station
        self.sealer = Sealer(key, station, newest_boot_id, epoch=keys.command.epochs[-1])
        self.requester = transactions.Requester(station)
        self.far_clock = FarClock()
        self.items: dict[str, Item] = {}
        self.products: dict[int, bulk.Product] = {}
        self.keeps = True  # False: what is heard cannot be kept, so events are not acknowledged
        self.counts: dict[str, int] = {"ok": 0}
        self.heard_ns: int | None = None
        self._opener = Opener(keys.downlink, newest_boot_id=newest_boot_id)
        self._bulk = bulk.Receiver(payload_limit(up_bps))
        self._bulk_heard_ns: int | None = None
        self._product_ns: dict[int, int] = {}
        self._timed: set[int] = set()
        self._telemetry = TelemetryReceiver()

    @property
    def boot_id(self) -> int:
        """The newest heard of the rover; 0 until then."""
        return self._opener.boot_id

    def request(self, name: str, arguments: commands.Arguments, now_ns: int, lifetime_s: float = 0.0,
                start_s: float = 0.0) -> int:
        """A new request, its id. It is not executed when it arrives later than its lifetime (0: any time).

        start_s: onboard time before which it is not to begin (0: at once); the lifetime counts from then.

        Raises ValueError as commands.check does.
        """
        onboard_ns = self.far_clock.onboard_ns(now_ns)
        issued_ns = max(0, onboard_ns or 0)
        start_ns = round(start_s * 1e9)
        known = lifetime_s and onboard_ns is not None
        expiry_ns = max(issued_ns, start_ns) + round(lifetime_s * 1e9) if known else 0
        request_id = self.requester.request(
            name, arguments, now_ns, issued_ns=issued_ns, expiry_ns=expiry_ns, start_ns=start_ns
        )
        if self.boot_id:
            self._timed.add(request_id)  # it goes out at once, so its answer tells the round trip
        return request_id

    def awaits_product(self, request_id: int) -> bool:
        """Whether a request is completed and what it sends is to come, or has."""
        request = self.requester.requests[request_id]
        sends = request.telecommand.name == "get" or commands.command(request.telecommand.name).sends
        return bool(sends) and request.state == transactions.State.COMPLETED

    def product_of(self, request_id: int) -> bulk.Product | None:
        """What a completed request brought: the object that its report names, else the newest announced since."""
        request = self.requester.requests[request_id]
        if request.report is not None and request.report.data:
            return self.products.get(int(request.report.data[0]))
        asked, since_ns = request.telecommand, request.made_ns
        wanted = asked.arguments.get("product") or commands.command(asked.name).sends
        return next((p for p in reversed(self.products.values())
                     if p.name == wanted and self._product_ns[p.object_id] >= since_ns), None)

    def receive(self, datagram: bytes, now_ns: int) -> tuple[str, list[News]]:
        """One datagram of the link: the verdict ("ok" or the check that failed), and what is new by it."""
        before = self.boot_id
        try:
            opened = self._opener.open(datagram)
            if opened.station != DOWNLINK_KEY_ID:
                raise WireError("sender", f"key {opened.station}")
            if self.boot_id != before:
                self._rover_booted(before, now_ns)
            self.heard_ns = now_ns
            news = self._dispatch(opened.kind, opened.payload, now_ns)
        except WireError as error:
            self.counts[error.kind] = self.counts.get(error.kind, 0) + 1
            return error.kind, []
        self.counts["ok"] += 1
        return "ok", news

    def _rover_booted(self, before: int, now_ns: int) -> None:
        self.sealer.boot_id = self.boot_id
        if before:
            self.requester.rover_booted(self.boot_id, now_ns)
            self.far_clock.forget()
            self._telemetry = TelemetryReceiver()

    def _dispatch(self, kind: Kind, payload: bytes, now_ns: int) -> list[News]:
        if kind == Kind.MAVLINK:
            return self._take_telemetry(payload, now_ns)
        if kind == Kind.REPORT:
            return self._take_report(payload, now_ns)
        if kind == Kind.BULK_CHUNK:
            return self._take_chunk(payload, now_ns)
        raise WireError("kind", f"{kind.name} does not come down")

    def _take_telemetry(self, payload: bytes, now_ns: int) -> list[News]:
        news: list[News] = []
        heard = self._telemetry.receive(payload, now_ns)
        for one in heard:
            if isinstance(one, Value):
                item = Item(now_ns, one.onboard_ns, one.name, one.value)
                known = self.items.get(one.name)
                if known is None or known.onboard_ns <= item.onboard_ns:
                    self.items[one.name] = item
                news.append(item)
            else:
                news.append(EventHeard(now_ns, *one))
        if any(isinstance(one, Value) for one in heard):
            self.far_clock.hear(self._telemetry.onboard_ns, now_ns)
        return news

    def _take_report(self, payload: bytes, now_ns: int) -> list[News]:
        report = self.requester.receive(payload, now_ns)
        if report is None:
            return []
        request = self.requester.requests[report.request_id]
        if report.request_id in self._timed:
            self._timed.discard(report.request_id)
            self.far_clock.measure(now_ns - request.made_ns)
            self.requester.rtt_ns = self.far_clock.rtt_ns
        return [ReportHeard(now_ns, request.telecommand.name, report)]

    def _take_chunk(self, payload: bytes, now_ns: int) -> list[News]:
        self._bulk_heard_ns = now_ns
        product = self._bulk.receive(payload, now_ns)
        object_id, announced = int.from_bytes(payload[:4], "little"), payload[8:10] == b"\xff\xff"
        if announced and object_id in self.products:
            self._product_ns[object_id] = now_ns  # offered again with the same content: nothing is sent twice
        if product is not None:
            self.products[product.object_id] = product
            self._product_ns[product.object_id] = now_ns
            return [ProductHeard(now_ns, product)]
        return [Progress(now_ns, name, have, total) for name, (have, total) in self._bulk.progress().items()]

    def send(self, now_ns: int) -> list[bytes]:
        """Sealed datagrams that are due. Empty until the rover was heard."""
        if not self.boot_id:
            return []
        self.sealer.boot_id = self.boot_id
        payloads: list[tuple[Kind, bytes]] = [(Kind.TELECOMMAND, p) for p in self.requester.send(now_ns)]
        if self.keeps:
            payloads += [(Kind.REPORT, p) for p in self._telemetry.acknowledgements(now_ns)]
        payloads += [(Kind.BULK_BITMAP, p) for p in self._bulk.send(now_ns)]
        return [self.sealer.seal(kind, payload) for kind, payload in payloads]

    def next_due_ns(self, now_ns: int) -> int | None:
        """When `send` should be called again; None: not before something was heard."""
        if not self.boot_id:
            return None
        due = [self.requester.next_due_ns(), self._telemetry.next_due_ns() if self.keeps else None]
        if self._bulk_heard_ns is not None and (
            self._bulk.progress() or now_ns - self._bulk_heard_ns < _BULK_TAIL_NS
        ):
            due.append((now_ns // _BULK_WAKE_NS + 1) * _BULK_WAKE_NS)
        return min((at for at in due if at is not None), default=None)
