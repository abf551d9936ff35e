"""Onboard end of the link: checked orders in; reports, telemetry, events and products out, in this priority.

    uplink payloads --> receive --> orders to the executive
    report, event, offer, sample --> queues --> send: a token bucket at 93 % of the line --> payloads to the shell

Rule 1: a report is sent twice, 0.2 s apart, and again whenever the ground asks. Housekeeping: the newest value of each
        message replaces an older one that waits. An event is sent at once and again until the ground acknowledges it.
Rule 2: a more important item that does not fit the bucket yet holds back the less important ones. Products also leave
        room for one datagram in the bucket for each housekeeping period, so housekeeping never waits for them.
Rule 3: the bucket counts the cost on the line: payload, frame, tag, UDP and IP.
Rule 4: outside the contact windows nothing is sent and all queues wait. If no window lies ahead, and for 30 s after a
        datagram arrives far from any window, the rover sends as if there were no windows: no plan can mute it for good.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence

from onboard.config import Link
from onboard.core.telemetry import Packer, TelemetryInputs
from onboard.records import Event, LinkMessage
from onboard.records.status import UNKEPT
from protocol import WireError
from protocol.link import bulk
from protocol.link import datagrams as link
from protocol.link.contacts import Windows
from protocol.link.datagrams import DatagramKind
from protocol.link.events import EventSender
from protocol.link.transactions import Executor, Order, RequestState
from protocol.tables.modes import Mode
from protocol.tables.telemetry import MESSAGES, rate_hz

__all__ = ["Downlink", "Order"]

_SHARE = 0.93
SHED_RATIO = 10
_HEARTBEAT_NS = 1_000_000_000
_SILENCE_NS = 10_000_000_000
_REFUSALS_NS = 10_000_000_000
_NEAR_NS, _ANSWER_NS = 10_000_000_000, 30_000_000_000
_STEADY = ("HEARTBEAT", "LINK_STATE")  # keep their rate while shedding
Payload = tuple[int, bytes]


class Downlink:
    """Owner of all data that the rover sends to the ground. Cheap at 100 Hz while nothing is due.

    last_contact_ns: time of the last authenticated datagram; the start before the first.
    heard_ns: the same for each station.
    mode: commands are checked against it; `sample` sets it, and it may be set in every tick.
    notices: events to report; the caller takes them.
    shedding: housekeeping is ten times less frequent, and no product is sent.
    windows: contact windows.
    now_ns: time of the tick.
    halted: commands that halted the rover before its restart, as saved under HALTS.
    """

    def __init__(self, config: Link, halted: bytes = b"") -> None:
        limit = link.payload_limit(config.rate_bps)
        self._limit, self._rate_Bpns = limit, _SHARE * config.rate_bps / 8e9
        self._depth = 2.0 * link.line_bytes(limit)
        self._tokens, self._filled_ns = self._depth, 0
        kept = {int(station): int(request_id) for station, request_id in json.loads(halted or b"{}").items()}
        self._packer, self._executor, self._events = Packer(), Executor(halted=kept), EventSender()
        self._bulk = bulk.Sender(limit)
        self._frames: dict[tuple[str, int], bytes] = {}  # (message, part) -> newest frame, longest waiting first
        often_first = sorted(MESSAGES, key=rate_hz, reverse=True)  # on a slow line the last one waits for all others
        self._due_ns = dict.fromkeys(("HEARTBEAT", *often_first), 0)
        self._period_ns = {m: round(1e9 / rate_hz(m)) for m in MESSAGES} | {"HEARTBEAT": _HEARTBEAT_NS}
        self._sample_ns = self.now_ns = 0
        self.mode, self.shedding = Mode.BOOT, False
        self.last_contact_ns = 0
        self.heard_ns: dict[int, int] = {}
        self.windows, self._open, self._answer_until_ns = Windows(), True, 0
        self.received, self.refused = 0, dict[str, int]()
        self._told_ns, self._told = -(1 << 62), 0
        self.notices: list[Event] = []
        self.own: dict[int, tuple[RequestState, str]] = {}
        self.sent_bytes = 0

    # -- from the ground ---------------------------------------------------------------------------------------

    def receive(self, messages: Sequence[LinkMessage], now_ns: int) -> list[Order]:
        """Return the new orders: in time, in range, allowed in the present mode; each request gives one at most.

        Orders whose start time has come go first: a stop that arrives in the same tick ends them.
        """
        self.now_ns = now_ns
        orders = self._executor.due(now_ns, self.mode) if self._executor.held else []
        for message in messages:
            if not message.accepted:
                self._refuse(message.verdict)
                continue
            self._contact(message, now_ns)
            try:
                order = self._take(message, now_ns)
            except WireError as error:
                self._refuse(error.kind)
                continue
            if order is not None:
                orders.append(order)
        refused = self.refused_count if messages else self._told
        if refused > self._told and now_ns - self._told_ns >= _REFUSALS_NS:
            self._told_ns, self._told = now_ns, refused
            text = ", ".join(f"{kind} {count}" for kind, count in sorted(self.refused.items()) if kind != link.COPY)
            self.notices.append(Event(now_ns, "warning", "LINK_REFUSED", text))
        return orders

    def _take(self, message: LinkMessage, now_ns: int) -> Order | None:
        if message.kind == DatagramKind.TELECOMMAND:
            return self._executor.receive(message.station, message.payload, now_ns, self.mode)
        if message.kind == DatagramKind.BULK_BITMAP:
            self._bulk.receive(message.payload, now_ns)
        elif message.kind == DatagramKind.REPORT:
            self._events.acknowledge(message.payload)
        else:
            raise WireError("kind", f"{message.kind} is not for a rover")
        return None

    def _contact(self, message: LinkMessage, now_ns: int) -> None:
        self.heard_ns[message.station] = now_ns
        if self.windows.spans and not self.windows.near(now_ns, _NEAR_NS):
            self._answer_until_ns = now_ns + _ANSWER_NS
        if message.verdict == UNKEPT:
            who = f"the mark of a command of station {message.station}"
            text = f"{who} is not kept: others could send it again after a restart"
            self.notices.append(Event(now_ns, "warning", "STATE", text))
        if now_ns - self.last_contact_ns > _SILENCE_NS:
            self._events.hurry(now_ns)
        self.last_contact_ns = now_ns
        self.received += 1

    def _refuse(self, kind: str) -> None:
        self.refused[kind] = self.refused.get(kind, 0) + 1

    # -- from the rover ----------------------------------------------------------------------------------------

    def report(self, request_id: int, state: RequestState, text: str = "", data: Sequence[float] = ()) -> None:
        """Report the state of an order by Order.request_id; for an order of the rover's own, store it in `own`."""
        if request_id >> 32 == 0:
            self.own[request_id] = (state, text)
            return
        self._executor.report(request_id, state, self.now_ns, text, data)

    def event(self, event: Event) -> None:
        """Send an event to the ground; it is stored until acknowledged."""
        self._events.add(self._packer.event(event, self._events.serial + 1), event.now_ns)

    def permit(self, check: Callable[[str, int], None]) -> None:
        """Set the check of who may command: check(name, station) raises RefusedError before an order is made."""
        self._executor.permit = check

    def cancel_waiting(self, reason: str) -> None:
        """Cancel all orders that wait for their start time."""
        self._executor.cancel_waiting(self.now_ns, reason)

    def offer(self, name: str, data: bytes, codec: str, priority: int = 0) -> int:
        """Queue an object for sending and return its id for a report. Drops an unfinished object of the same name."""
        return self._bulk.offer(name, data, codec, self.now_ns, priority)

    @property
    def waits(self) -> list[str]:
        """Orders that wait for their start time, in words."""
        return self._executor.waits

    @property
    def refused_count(self) -> int:
        """Uplink datagrams that failed a check since the start, without duplicates made by a network."""
        return sum(count for kind, count in self.refused.items() if kind != link.COPY)

    @property
    def events_waiting(self) -> int:
        """Number of events that the ground has not acknowledged."""
        return len(self._events)

    def sample(self, view: TelemetryInputs, now_ns: int) -> None:
        """Make the messages that are due from this view."""
        self.mode = view.mode
        if now_ns < self._sample_ns:
            return
        slower = SHED_RATIO if self.shedding else 1
        for name, due_ns in self._due_ns.items():
            if now_ns >= due_ns:
                period_ns = self._period_ns[name] * (1 if name in _STEADY else slower)
                self._due_ns[name] = now_ns - now_ns % period_ns + period_ns  # common phase: few datagrams
                frames = self._packer.message(name, view, now_ns)
                self._frames.update({(name, n): frame for n, frame in enumerate(frames)})
        self._sample_ns = min(self._due_ns.values())

    # -- to the ground -----------------------------------------------------------------------------------------

    def send(self, now_ns: int) -> tuple[Payload, ...]:
        """Return the payloads that may be sent now."""
        self.now_ns = now_ns
        if self.windows.spans and not self._may_speak(now_ns):
            return ()
        self._tokens = min(self._depth, self._tokens + (now_ns - self._filled_ns) * self._rate_Bpns)
        self._filled_ns = now_ns
        out: list[Payload] = []
        if self._executor.waiting(now_ns):
            self._spend(out, DatagramKind.REPORT, self._executor.send(now_ns, self._tokens))
            if self._executor.waiting(now_ns):
                return tuple(out)
        if self._housekeeping(out) and self._events_out(out, now_ns) and self._bulk.busy and not self.shedding:
            self._spend(out, DatagramKind.BULK_CHUNK, self._bulk.send(now_ns, self._tokens - self._kept_bytes(now_ns)))
        return tuple(out)

    def _may_speak(self, now_ns: int) -> bool:
        """Return whether sending is allowed (rule 4). When contact begins, waiting events become due at once."""
        before, windows = self._open, self.windows
        self._open = windows.is_open(now_ns) or windows.over(now_ns) or now_ns < self._answer_until_ns
        if self._open and not before:
            self._events.hurry(now_ns)
        return self._open

    def _kept_bytes(self, now_ns: int) -> float:
        """Bytes of the bucket that products leave free for the datagram of the next housekeeping (rule 2)."""
        ahead_ns = self._sample_ns - now_ns
        return max(0.0, self._depth / 2 - ahead_ns * self._rate_Bpns) if ahead_ns > 0 else 0.0

    def _spend(self, out: list[Payload], kind: DatagramKind, payloads: Iterable[bytes]) -> None:
        for payload in payloads:
            cost = link.line_bytes(len(payload))
            self._tokens -= cost
            self.sent_bytes += cost
            out.append((int(kind), payload))

    def _housekeeping(self, out: list[Payload]) -> bool:
        """Send waiting frames in bundles; return whether none is left."""
        while self._frames:
            bundle, slots = b"", list[tuple[str, int]]()
            for slot, frame in self._frames.items():
                if len(bundle) + len(frame) > self._limit:
                    break
                bundle += frame
                slots.append(slot)
            if link.line_bytes(len(bundle)) > self._tokens:
                return False
            for slot in slots:
                del self._frames[slot]
            self._spend(out, DatagramKind.MAVLINK, (bundle,))
        return True

    def _events_out(self, out: list[Payload], now_ns: int) -> bool:
        """Send due events in bundles; return whether none is left."""
        bundle, serials, whole = b"", list[int](), True
        for serial, frame in self._events.due(now_ns):
            if len(bundle) + len(frame) > self._limit and bundle:
                self._spend(out, DatagramKind.MAVLINK, (bundle,))
                bundle = b""
            if link.line_bytes(len(bundle) + len(frame)) > self._tokens:
                whole = False
                break
            bundle += frame
            serials.append(serial)
        if bundle:
            self._spend(out, DatagramKind.MAVLINK, (bundle,))
        for serial in serials:
            self._events.sent(serial, now_ns)
        return whole

    def digest_items(self) -> tuple[int, ...]:
        """Values of this state that go into the state digest."""
        return (
            round(self._tokens * 1e6),
            self.received,
            self.refused_count,
            self.last_contact_ns,
            len(self._events),
            self._events.serial,
            len(self._frames),
            self.sent_bytes,
            self._executor.held,
            *self._executor.halts.digest_items(),
        )
