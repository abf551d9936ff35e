"""One operator station's end of the link without I/O: datagrams and time in, datagrams and news out.

    receive(datagram, now) -> news: items, events, reports, products, progress
    request(name, arguments, now) -> request id; the request is retransmitted until its outcome is known
    send(now) -> datagrams: requests, bitmaps of transfers, acknowledgements of events

Until the first downlink arrives the station sends only halting commands: all others carry the rover's boot id and need
matching versions. Times are the station's clock; `FarClock` converts them to onboard time, `LatestTelemetry` has the
telemetry, `ProductReceiver` the products, `Crossing` the datagrams in flight while the rover restarts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from ground.link.latest_telemetry import LatestTelemetry
from ground.link.news import News, ReportHeard
from ground.link.product_receiver import ProductReceiver, product_name
from ground.link.restart_refusals import Crossing
from ground.link.rover_clock import FarClock
from ground.link.saved_state import NOTHING, SavedLinkState
from ground.link.schedule import Schedule
from protocol import WireError
from protocol.link import bulk, transactions
from protocol.link.contacts import Windows
from protocol.link.datagrams import DOWNLINK_KEY_ID, DatagramKind, LinkKeys, Opener, Sealer, payload_limit
from protocol.link.versions import OURS, Versions
from protocol.tables import commands

_LOST = "the rover restarted (boot {}) before {} had come whole; ask again: what came is kept"
VIEWER = "this station has no command key (command_keys): it may watch, not command"
NOT_SENT = "never sent: its station ended before"
ALWAYS = Schedule()


class Session:
    """State of one station: requests, known state of the rover, transfers."""

    def __init__(
        self,
        keys: LinkKeys,
        station: int,
        *,
        up_bps: float = 256e3,
        kept: SavedLinkState = NOTHING,
        schedule: Schedule = ALWAYS,
        utc_ns: int = 0,
    ) -> None:
        """schedule: contact windows. utc_ns: UTC at the zero of the station's clock.

        Raises ValueError without a station key.
        """
        self.viewer = not keys.command.key_ids
        if not self.viewer and keys.command.key(station) is None:
            raise ValueError(f"no key of station {station}")
        self.station = station
        self._keys, self._schedule, self.utc_ns = keys, schedule, utc_ns
        self._opener = Opener(keys.downlink, newest_boot_id=kept.boot_id, epoch=None if kept.epoch < 0 else kept.epoch)
        if kept.heard >= 0:
            self._opener.heard_before(DOWNLINK_KEY_ID, kept.heard)
        epoch = self._opener.epoch
        self.sealer = Sealer(keys.command.key(station, epoch) or b"", station, kept.boot_id, epoch=epoch)
        self.requester = transactions.Requester(station)
        self.far_clock = FarClock(kept.rtt_ns)
        self._crossing = Crossing()
        self._known = LatestTelemetry(self.far_clock, self._crossing)
        self.items = self._known.items
        self.texts: list[str] = []  # messages for people; the reader clears the list
        self.asked_by = ""  # origin of a request that does not name one
        self.only_halts = False  # True: no counters are left for any other command
        self.keeps = True  # False: the archive cannot be written, so events are not acknowledged
        self.counts: dict[str, int] = {"ok": 0}
        self.heard_ns: int | None = None
        self._fetched = ProductReceiver(payload_limit(up_bps), keys.downlink, self.texts)
        self.products = self._fetched.products
        self._timed: dict[int, int] = {}  # request id -> first sending to a rover in contact; for the round trip
        self._awaited: set[int] = set()  # completed requests whose product has not arrived
        self._unsaid: list[News] = []

    @property
    def versions(self) -> Versions | None:
        """Versions of the rover; None until this boot has sent them."""
        return self._known.versions

    @property
    def boot_id(self) -> int:
        """Newest boot id of the rover; 0 until the first reception."""
        return self._opener.boot_id

    @property
    def kept(self) -> SavedLinkState:
        """Link state to save across restarts of the station."""
        heard = self._opener.highest(DOWNLINK_KEY_ID)
        return SavedLinkState(self.boot_id, self._opener.epoch, heard, self.far_clock.rtt_ns)

    @property
    def mismatch(self) -> str:
        """Versions in which the rover differs from this station, both named; "" if none differs or none is known."""
        return "" if self.versions is None else OURS.differences(self.versions)

    @property
    def commanding(self) -> bool:
        """True if ordinary commands are sent: the rover was received and has our versions.

        Halting commands are always sent.
        """
        return bool(self.boot_id) and self.versions == OURS

    def windows(self, now_ns: int) -> Windows | None:
        """Return the contact windows on this station's clock; None while they need onboard time and it is not known."""
        return self._schedule.here(self.utc_ns, self.far_clock, now_ns)

    def in_contact(self, now_ns: int) -> bool:
        """Return whether a contact window is open now."""
        windows = self.windows(now_ns)
        return windows is not None and windows.is_open(now_ns)

    def contact_since_ns(self, now_ns: int) -> int | None:
        """Return the begin of the present contact, 0 if there are no windows; None outside of contact."""
        windows = self.windows(now_ns)
        if windows is None or not windows.is_open(now_ns):
            return None
        return max((begin for begin, _ in windows.spans if begin <= now_ns), default=0)

    def onboard_of_utc_ns(self, utc_ns: int, now_ns: int) -> int | None:
        """Return the onboard time of a UTC instant, ns; None until the rover is received."""
        onboard_ns = self.far_clock.onboard_ns(now_ns)
        return None if onboard_ns is None else onboard_ns + (utc_ns - self.utc_ns - now_ns)

    def windows_for_rover(self, now_ns: int) -> tuple[float, ...] | None:
        """Return the next contact windows as `contacts_set` takes them; None until the rover is received."""
        return self._schedule.for_rover(self.utc_ns, self.far_clock, now_ns)

    def request(
        self,
        name: str,
        arguments: commands.Arguments,
        now_ns: int,
        lifetime_s: float = 0.0,
        start_s: float = 0.0,
        *,
        asked_by: str = "",
    ) -> int:
        """Make a request and return its id. The rover does not execute it after its lifetime (0: no limit).

        start_s: onboard time before which it may not begin (0: at once); the lifetime counts from then.
        asked_by: origin, for the archive; "": `asked_by` of the session.

        Raises ValueError like commands.check, and on a viewer. If the rover's versions differ, the request is FAILED at
        once, unless it halts the rover.
        """
        if self.viewer:
            raise commands.RefusedError(VIEWER)
        onboard_ns = self.far_clock.onboard_ns(now_ns)
        issued_ns = max(0, onboard_ns or 0)
        start_ns = round(start_s * 1e9)
        known = lifetime_s and onboard_ns is not None
        expiry_ns = max(issued_ns, start_ns) + round(lifetime_s * 1e9) if known else 0
        request_id = self.requester.request(
            name, arguments, now_ns, issued_ns=issued_ns, expiry_ns=expiry_ns, start_ns=start_ns
        )
        self.requester.requests[request_id].asked_by = asked_by or self.asked_by
        if product := product_name(self.requester.requests[request_id].telecommand):
            self._fetched.asked(product, now_ns)
        if name in commands.HALTING:
            for moving in self.requester.unheard_moves:
                self.halted(moving, name, now_ns)
        if self.mismatch:
            self._unsaid += self._refuse(now_ns)
        return request_id

    def halted(self, request_id: int, by: str, now_ns: int) -> None:
        """Cancel an unconfirmed request because a halting command was requested after it."""
        text = f"`{commands.command(by).typed}` was asked for after it; not sent again, nothing was heard of it"
        report = self.requester.end(
            request_id, transactions.RequestState.CANCELLED, transactions.Code.NONE, text, now_ns
        )
        self._unsaid += self._heard([report], now_ns)

    def unsaid(self) -> list[News]:
        """Return news that no datagram brought, such as requests refused here. Each once."""
        news, self._unsaid = self._unsaid, []
        return news

    def close(self, now_ns: int) -> list[News]:
        """End the station; returns news of the requests never sent."""
        return self._heard(self.requester.close(NOT_SENT, now_ns), now_ns)

    def _refuse(self, now_ns: int) -> list[News]:
        """Refuse all commands that do not halt the rover: the versions of both ends differ."""
        reports = self.requester.refuse(f"not sent: {self.mismatch}; only stop, safe, emergency-stop", now_ns)
        return self._heard(reports, now_ns)

    def _heard(self, reports: list[transactions.Report], now_ns: int) -> list[News]:
        named = self.requester.requests
        return [ReportHeard(now_ns, named[report.request_id].telecommand.name, report) for report in reports]

    @property
    def transfers(self) -> dict[str, tuple[int, int]]:
        """Present and total number of chunks of each product in transfer."""
        return self._fetched.transfers

    def recall(self, kept_chunks: Callable[[], Iterable[bytes]]) -> None:
        """Set the source of datagrams received before a restart of the station; it is called once, at first need."""
        self._fetched.kept_chunks = kept_chunks

    def awaits_product(self, request_id: int) -> bool:
        """Return whether a request is completed and sends a product, arrived or not."""
        request = self.requester.requests[request_id]
        return bool(product_name(request.telecommand)) and request.state == transactions.RequestState.COMPLETED

    def product_of(self, request_id: int) -> bulk.Product | None:
        """Return the product of a completed request: the object its report names, else the newest announced since."""
        request = self.requester.requests[request_id]
        if request.report is not None and request.report.data:
            return next((p for p in self.products.values() if p.object_id == request.report.data[0]), None)
        asked, since_ns = request.telecommand, request.made_ns
        return self._fetched.newest(product_name(asked), since_ns)

    def receive(self, datagram: bytes, now_ns: int) -> tuple[str, list[News]]:
        """Process one datagram. Returns the verdict ("ok" or the check that failed) and the news."""
        before, news = self.boot_id, list[News]()
        try:
            opened = self._opener.open(datagram)
            if opened.station != DOWNLINK_KEY_ID:
                raise WireError("sender", f"key {opened.station}")
            if self.boot_id != before:
                news += self._rover_booted(before, now_ns)
            if self._opener.epoch != self.sealer.epoch and not self.viewer:
                self.sealer.use(self._keys.command.key(self.station, self._opener.epoch) or b"", self._opener.epoch)
            self.heard_ns = now_ns
            news += self._dispatch(opened.kind, opened.payload, now_ns)
        except WireError as error:
            self.counts[error.kind] = self.counts.get(error.kind, 0) + 1
            return error.kind, news
        self.counts["ok"] += 1
        return "ok", news

    def _rover_booted(self, before: int, now_ns: int) -> list[News]:
        """Discard the state of the old boot; returns news of the requests that end by the reboot."""
        self.sealer.boot_id = self.boot_id
        if not before:
            return []
        self._known.forget()
        self._crossing.booted(now_ns if self.heard_ns is None else self.heard_ns - self.far_clock.rtt_ns)
        self._timed.clear()
        reports = self.requester.rover_booted(self.boot_id, now_ns)
        awaited = self._awaited & self.requester.requests.keys()
        for request_id in sorted(i for i in awaited if not self.product_of(i)):
            text = _LOST.format(self.boot_id, product_name(self.requester.requests[request_id].telecommand))
            ended = transactions.RequestState.FAILED, transactions.Code.RESTARTED
            reports.append(self.requester.end(request_id, *ended, text, now_ns))
        self._awaited.clear()
        return self._heard(reports, now_ns)

    def _dispatch(self, kind: DatagramKind, payload: bytes, now_ns: int) -> list[News]:
        if kind == DatagramKind.MAVLINK:
            return self._take_telemetry(payload, now_ns)
        if kind == DatagramKind.REPORT:
            return self._take_report(payload, now_ns)
        if kind == DatagramKind.BULK_CHUNK:
            return self._fetched.receive(payload, now_ns)
        raise WireError("kind", f"{kind.name} does not come down")

    def _take_telemetry(self, payload: bytes, now_ns: int) -> list[News]:
        news = self._known.receive(payload, now_ns)
        return news + (self._refuse(now_ns) if self.mismatch else [])

    def _take_report(self, payload: bytes, now_ns: int) -> list[News]:
        report = self.requester.receive(payload, now_ns)
        if report is None:
            return []
        request = self.requester.requests[report.request_id]
        if report.request_id in self._timed:
            self.far_clock.measure(now_ns - self._timed.pop(report.request_id))
            self.requester.rtt_ns = self.far_clock.rtt_ns
        if self.awaits_product(report.request_id) and self.product_of(report.request_id) is None:
            self._awaited.add(report.request_id)
        return [ReportHeard(now_ns, request.telecommand.name, report)]

    def send(self, now_ns: int) -> list[bytes]:
        """Return the sealed datagrams that are due; none outside of contact.

        Halting commands are valid for any boot; all others wait until the rover is received.
        """
        if self.viewer or not self.in_contact(now_ns):
            return []
        self.sealer.boot_id = self.boot_id
        asked = self.requester.send(now_ns, halting_only=not self.commanding or self.only_halts)
        if self.commanding and self.heard_ns is not None:
            self._timed |= {
                i: now_ns
                for p in asked
                if (i := commands.request_id_of(p) or 0) and self.requester.requests[i].sent == 1
            }
        sealed = [
            self.sealer.seal_halt(p) if commands.halts(p) else self.sealer.seal(DatagramKind.TELECOMMAND, p)
            for p in asked
        ]
        if not self.boot_id or self.only_halts:
            return sealed
        before = self.sealer.counter - sum(not commands.halts(p) for p in asked)
        payloads = [(DatagramKind.REPORT, p) for p in self._known.events.acknowledgements(now_ns)] if self.keeps else []
        payloads += (
            [(DatagramKind.BULK_BITMAP, p) for p in self._fetched.send(now_ns)] if self.heard_ns is not None else []
        )
        sealed += [self.sealer.seal(kind, payload) for kind, payload in payloads]
        self._crossing.said(self.sealer.counter - before, now_ns)
        return sealed

    def next_due_ns(self, now_ns: int) -> int | None:
        """Return the time of the next `send`; None: not before the next reception."""
        due = [self.requester.next_due_ns(halting_only=not self.commanding or self.only_halts)]
        if self.viewer:
            return None
        if not self.in_contact(now_ns):
            windows = self.windows(now_ns)
            return None if windows is None else windows.next_begin_ns(now_ns)
        if self.only_halts:
            return due[0]
        if self.boot_id and self.keeps:
            due.append(self._known.events.next_due_ns())
        if self.heard_ns is not None:
            due.append(self._fetched.next_due_ns(now_ns))
        return min((at for at in due if at is not None), default=None)
