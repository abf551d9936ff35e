"""One operator station's end of the link without I/O: datagrams and time in, datagrams and news out.

    receive(datagram, now) -> news: items, events, reports, products, progress
    request(name, arguments, now) -> request id, kept asking until its outcome is known
    send(now) -> datagrams: requests, bitmaps of transfers, acknowledgements of events

Nothing but what halts the rover is sent before it was heard: its boot id is part of every uplink datagram, and what it
was built from has to be as here. Times are the station's clock; `FarClock` turns them into onboard time, `Known` has
what telemetry told, `Fetched` the products, `Crossing` what a restart of the rover meets.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from ground.session.crossing import Crossing
from ground.session.far_clock import FarClock
from ground.session.fetched import Fetched, product_name
from ground.session.kept import NOTHING, Kept
from ground.session.known import Known
from ground.session.news import News, ReportHeard
from ground.session.schedule import Schedule
from protocol import WireError, bulk, commands, transactions
from protocol.contacts import Windows
from protocol.link import DOWNLINK_KEY_ID, Kind, LinkKeys, Opener, Sealer, payload_limit
from protocol.versions import OURS, Versions

_LOST = "the rover restarted (boot {}) before {} had come whole; ask again: what came is kept"
VIEWER = "this station has no command key (command_keys): it may watch, not command"
NOT_SENT = "never sent: its station ended before"
ALWAYS = Schedule()


class Session:
    """The station's state: what was asked, what is known of the rover, what is on its way."""

    def __init__(
        self, keys: LinkKeys, station: int, *, up_bps: float = 256e3, kept: Kept = NOTHING,
        schedule: Schedule = ALWAYS, utc_ns: int = 0,
    ) -> None:  # fmt: skip
        """schedule: of contacts. utc_ns: at the zero of the station's clock."""
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
        self._known = Known(self.far_clock, self._crossing)
        self.items = self._known.items
        self.texts: list[str] = []  # to be told to people; who tells them clears it
        self.asked_by = ""  # who asks, where a request does not say it
        self.only_halts = False  # True: there are no counters for anything else
        self.keeps = True  # False: what is heard cannot be kept, so events are not acknowledged
        self.counts: dict[str, int] = {"ok": 0}
        self.heard_ns: int | None = None
        self._fetched = Fetched(payload_limit(up_bps), keys.downlink, self.texts)
        self.products = self._fetched.products
        self._timed: dict[int, int] = {}  # when each first went to a rover that is heard: the round trip
        self._awaited: set[int] = set()  # requests that are completed and whose product is to come
        self._unsaid: list[News] = []

    @property
    def versions(self) -> Versions | None:
        """What the rover was built from; None until this boot has said it."""
        return self._known.versions

    @property
    def boot_id(self) -> int:
        """The newest heard of the rover; 0 until then."""
        return self._opener.boot_id

    @property
    def kept(self) -> Kept:
        """What should outlive this station."""
        heard = self._opener.highest(DOWNLINK_KEY_ID)
        return Kept(self.boot_id, self._opener.epoch, heard, self.far_clock.rtt_ns)

    @property
    def mismatch(self) -> str:
        """What the rover was built from that is not as here, both named; '' where all is alike or nothing is known."""
        return "" if self.versions is None else OURS.differences(self.versions)

    @property
    def commanding(self) -> bool:
        """Whether ordinary commands go out: the rover was heard and is of our versions. What halts it always does."""
        return bool(self.boot_id) and self.versions == OURS

    def windows(self, now_ns: int) -> Windows | None:
        """Of contact, on this station's clock; None while they are in onboard time and that is not known."""
        return self._schedule.here(self.utc_ns, self.far_clock, now_ns)

    def in_contact(self, now_ns: int) -> bool:
        """Whether something may be sent now."""
        windows = self.windows(now_ns)
        return windows is not None and windows.is_open(now_ns)

    def contact_since_ns(self, now_ns: int) -> int | None:
        """When the present contact began, 0 where there are no windows; None outside."""
        windows = self.windows(now_ns)
        if windows is None or not windows.is_open(now_ns):
            return None
        return max((begin for begin, _ in windows.spans if begin <= now_ns), default=0)

    def onboard_of_utc_ns(self, utc_ns: int, now_ns: int) -> int | None:
        """Onboard time of a UTC instant; None until the rover was heard."""
        onboard_ns = self.far_clock.onboard_ns(now_ns)
        return None if onboard_ns is None else onboard_ns + (utc_ns - self.utc_ns - now_ns)

    def windows_for_rover(self, now_ns: int) -> tuple[float, ...] | None:
        """The next contact windows as `contacts_set` takes them; None until the rover was heard."""
        return self._schedule.for_rover(self.utc_ns, self.far_clock, now_ns)

    def request(self, name: str, arguments: commands.Arguments, now_ns: int, lifetime_s: float = 0.0,
                start_s: float = 0.0, *, asked_by: str = "") -> int:
        """A new request, its id. It is not executed when it arrives later than its lifetime (0: any time).

        start_s: onboard time before which it is not to begin (0: at once); the lifetime counts from then.
        asked_by: for the archive; else `asked_by` of the session.

        Raises ValueError as commands.check does, and at a viewer. Where the rover is known to be of other versions it
        has FAILED at once, unless it halts the rover.
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
        """What halts the rover was asked for after this unheard request, which is sent no more."""
        text = f"`{commands.command(by).typed}` was asked for after it; not sent again, nothing was heard of it"
        report = self.requester.end(request_id, transactions.State.CANCELLED, transactions.Code.NONE, text, now_ns)
        self._unsaid += self._heard([report], now_ns)

    def unsaid(self) -> list[News]:
        """News that no datagram brought: what was refused here as it was asked. Each once."""
        news, self._unsaid = self._unsaid, []
        return news

    def close(self, now_ns: int) -> list[News]:
        """The station ends: news of what it has never sent."""
        return self._heard(self.requester.close(NOT_SENT, now_ns), now_ns)

    def _refuse(self, now_ns: int) -> list[News]:
        """Both ends do not speak of the same thing: no command but those that halt the rover."""
        reports = self.requester.refuse(f"not sent: {self.mismatch}; only stop, safe, emergency-stop", now_ns)
        return self._heard(reports, now_ns)

    def _heard(self, reports: list[transactions.Report], now_ns: int) -> list[News]:
        named = self.requester.requests
        return [ReportHeard(now_ns, named[report.request_id].telecommand.name, report) for report in reports]

    @property
    def transfers(self) -> dict[str, tuple[int, int]]:
        """Chunks there and chunks in all of each product that is on its way."""
        return self._fetched.transfers

    def recall(self, kept_chunks: Callable[[], Iterable[bytes]]) -> None:
        """Where the chunks are that were heard before a restart of the station; asked once, when of use."""
        self._fetched.kept_chunks = kept_chunks

    def awaits_product(self, request_id: int) -> bool:
        """Whether a request is completed and what it sends is to come, or has."""
        request = self.requester.requests[request_id]
        return bool(product_name(request.telecommand)) and request.state == transactions.State.COMPLETED

    def product_of(self, request_id: int) -> bulk.Product | None:
        """What a completed request brought: the object that its report names, else the newest announced since."""
        request = self.requester.requests[request_id]
        if request.report is not None and request.report.data:
            return next((p for p in self.products.values() if p.object_id == request.report.data[0]), None)
        asked, since_ns = request.telecommand, request.made_ns
        return self._fetched.newest(product_name(asked), since_ns)

    def receive(self, datagram: bytes, now_ns: int) -> tuple[str, list[News]]:
        """One datagram of the link: the verdict ("ok" or the check that failed), and what is new by it."""
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
        """What was known of the boot before is known no more; news of the requests that end by it."""
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
            ended = transactions.State.FAILED, transactions.Code.RESTARTED
            reports.append(self.requester.end(request_id, *ended, text, now_ns))
        self._awaited.clear()
        return self._heard(reports, now_ns)

    def _dispatch(self, kind: Kind, payload: bytes, now_ns: int) -> list[News]:
        if kind == Kind.MAVLINK:
            return self._take_telemetry(payload, now_ns)
        if kind == Kind.REPORT:
            return self._take_report(payload, now_ns)
        if kind == Kind.BULK_CHUNK:
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
        """Sealed datagrams that are due; none outside of contact.

        What halts the rover goes to any boot; nothing else does before the rover was heard.
        """
        if self.viewer or not self.in_contact(now_ns):
            return []
        self.sealer.boot_id = self.boot_id
        asked = self.requester.send(now_ns, halting_only=not self.commanding or self.only_halts)
        if self.commanding and self.heard_ns is not None:
            self._timed |= {i: now_ns for p in asked if (i := commands.request_id_of(p) or 0)
                            and self.requester.requests[i].sent == 1}
        sealed = [self.sealer.seal_halt(p) if commands.halts(p) else self.sealer.seal(Kind.TELECOMMAND, p)
                  for p in asked]
        if not self.boot_id or self.only_halts:
            return sealed
        before = self.sealer.counter - sum(not commands.halts(p) for p in asked)
        payloads = [(Kind.REPORT, p) for p in self._known.events.acknowledgements(now_ns)] if self.keeps else []
        payloads += [(Kind.BULK_BITMAP, p) for p in self._fetched.send(now_ns)] if self.heard_ns is not None else []
        sealed += [self.sealer.seal(kind, payload) for kind, payload in payloads]
        self._crossing.said(self.sealer.counter - before, now_ns)
        return sealed

    def next_due_ns(self, now_ns: int) -> int | None:
        """When `send` should be called again; None: not before something was heard."""
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
