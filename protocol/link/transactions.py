"""Telecommand transactions, both ends: each request is executed once and its outcome is reported, despite losses.

    ground: Requester                                  rover: Executor
      |  telecommand, every max(0.5 s, RTT/2) --------->  |  first: checked, RECEIVED and ACCEPTED or REFUSED
      |  <------------------ report, two copies, 0.2 s    |  again: the last report once more, in two copies too
      |  telecommand, every max(5 s, 2 RTT) ----------->  |  (asks for the outcome, which may have been lost)
      |  <------------------ report: COMPLETED ...        |

A request that halts the rover is sent every max(`halt_retry_ns`, RTT/2) until its first report arrives.

Rule 1: a request id of a station names one request for ever. Ids rise in the order of the requests, also across
        processes of the station. The ground stores its next id on disk, as it stores its counter. The rover refuses a
        known id with other content, and an id older than all that it remembers.
Rule 2: a request that arrives after its expiry is never executed; it is reported EXPIRED.
Rule 3: a request with a start time waits on board until then (at most 32 do). Mode and expiry are checked at that time.
Rule 4: each report carries a serial number per request, so that a late report never overwrites a newer one.
Rule 5: a rover that restarts has lost its transaction state. A request that was sent before is not sent to it again; it
        ends with that reason. Requests that halt are sent again: executing them twice does no harm.
Rule 6: a request issued before a halt that arrives after it never moves the rover (protocol.link.halts).
Rule 7: reports of halting requests are sent first, then those of each station in turn. The number of requests with
        waiting reports is limited per station; the oldest are dropped, and the station asks again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple

from protocol import WireError
from protocol.link.halts import Halts
from protocol.link.report_queue import ReportQueue, key_of
from protocol.link.reports import Code as Code
from protocol.link.reports import Report as Report
from protocol.link.reports import RequestState as RequestState
from protocol.link.reports import decode_report as decode_report
from protocol.link.reports import encode_report as encode_report
from protocol.tables import commands
from protocol.tables.modes import Mode

_RETRY_NS, _ASK_NS = 500_000_000, 5_000_000_000
_MOST_WAITING = 32


# -- the ground's end ------------------------------------------------------------------------------------------


@dataclass(slots=True)
class Request:
    """One request as the ground knows it.

    telecommand, payload: the request and its encoding.
    made_ns: ground time of its creation.
    state: newest state.
    report: newest report.
    history: (ground time ns, report) of each received report.
    sent: number of transmissions.
    next_ns: ground time of the next transmission.
    own: False if taken over from an earlier process of this station.
    asked_by: originator, text for people.
    """

    telecommand: commands.Telecommand
    made_ns: int
    payload: bytes
    state: RequestState = RequestState.REQUESTED
    report: Report | None = None
    history: list[tuple[int, Report]] = field(default_factory=list)
    sent: int = 0
    next_ns: int = 0
    own: bool = True
    asked_by: str = ""


class Requester:
    """Ground's end for one station. Times are the ground's; issue and expiry are given in onboard time.

    first_id: first request id, reserved on disk before use (rule 1).
    rtt_ns: round-trip time; may be set at any time.
    remembered: limit of `requests`; the oldest completed requests are deleted.
    take_id: returns the next request id, if several processes share the ids.
    halt_retry_ns: retransmission interval of a halting request.
    """

    def __init__(self, station: int, first_id: int = 1, rtt_ns: int = 0, remembered: int = 2048) -> None:
        self._remembered = remembered
        self.station, self.next_id, self.rtt_ns = station, first_id, rtt_ns
        self.halt_retry_ns = _RETRY_NS  # shorter if the line has the capacity
        self.take_id: Callable[[], int] = self.count_id
        self.requests: dict[int, Request] = {}
        self._open: dict[int, Request] = {}

    def request(
        self,
        name: str,
        arguments: commands.Arguments,
        now_ns: int,
        *,
        issued_ns: int = 0,
        expiry_ns: int = 0,
        start_ns: int = 0,
    ) -> int:
        """Create a request; `send` returns its datagrams. Raises ValueError as commands.check does."""
        checked = commands.check(name, arguments)
        telecommand = commands.Telecommand(self.take_id(), issued_ns, expiry_ns, name, checked, start_ns)
        made = Request(telecommand, now_ns, commands.encode(telecommand), next_ns=now_ns)
        self.requests[telecommand.request_id] = self._open[telecommand.request_id] = made
        if len(self.requests) > self._remembered:
            oldest = next((i for i in self.requests if i not in self._open), None)
            if oldest is not None:
                del self.requests[oldest]
        return telecommand.request_id

    def count_id(self) -> int:
        """Take the next request id from `next_id`; no other process uses this counter."""
        self.next_id += 1
        return self.next_id - 1

    def send(self, now_ns: int, halting_only: bool = False) -> list[bytes]:
        """Return the payloads of Kind.TELECOMMAND that are due now; with `halting_only` those that halt the rover."""
        out = []
        for request in self._open.values():
            if now_ns < request.next_ns or (halting_only and not commands.halts(request.payload)):
                continue
            heard = request.state != RequestState.REQUESTED
            least_ns = self.halt_retry_ns if commands.halts(request.payload) else _RETRY_NS
            wait_ns = max(_ASK_NS, 2 * self.rtt_ns) if heard else max(least_ns, self.rtt_ns // 2)
            request.next_ns, request.sent = now_ns + wait_ns, request.sent + 1
            out.append(request.payload)
        return out

    @property
    def open(self) -> int:
        """Number of requests without a final report."""
        return len(self._open)

    def next_due_ns(self, halting_only: bool = False) -> int | None:
        """Ground time of the next transmission; None if no request is open."""
        rows = (r for r in self._open.values() if not halting_only or commands.halts(r.payload))
        return min((r.next_ns for r in rows), default=None)

    def receive(self, payload: bytes, now_ns: int) -> Report | None:
        """Process a Kind.REPORT payload; return the report if it is newer and of this station's request, else None.

        Raises WireError on a malformed payload.
        """
        report = decode_report(payload)
        request = self.requests.get(report.request_id)
        if report.station != self.station or request is None:
            return None
        last = request.report
        if last is not None and not 0 < (report.serial - last.serial) & 0xFF < 128:
            return None
        request.report, request.state = report, report.state
        request.history.append((now_ns, report))
        if report.state.final:
            self._open.pop(report.request_id, None)
        else:
            request.next_ns = now_ns + max(_ASK_NS, 2 * self.rtt_ns)
        return report

    def rover_booted(self, boot_id: int, now_ns: int) -> list[Report]:
        """End open requests after a restart of the rover (rule 5); a `reboot` request is completed by it."""
        reports = []
        for request_id, request in list(self._open.items()):
            if not request.sent or request.telecommand.name in commands.HALTING:
                continue
            state, code, text = RequestState.COMPLETED, Code.NONE, f"started again, boot {boot_id}"
            if request.telecommand.name != "reboot":
                heard = request.state.name.lower()
                state, code = RequestState.FAILED, Code.RESTARTED
                text = f"the rover restarted (boot {boot_id}) before its outcome was heard; until then: {heard}"
            reports.append(self.end(request_id, state, code, text, now_ns))
        return reports

    @property
    def unheard_moves(self) -> list[int]:
        """Requests that let the rover move and have no report yet: they are retransmitted."""
        return [
            request_id
            for request_id, request in self._open.items()
            if request.state is RequestState.REQUESTED and commands.command(request.telecommand.name).frees
        ]

    def refuse(self, text: str, now_ns: int) -> list[Report]:
        """End all open requests but halting ones: the ground refuses them itself."""
        reports = []
        for request_id, request in list(self._open.items()):
            if not commands.halts(request.payload):
                reports.append(self.end(request_id, RequestState.FAILED, Code.VERSION, text, now_ns))
        return reports

    def end(self, request_id: int, state: RequestState, code: Code, text: str, now_ns: int) -> Report:
        """End a request with the ground's own report; it is not sent again. A later report of the rover replaces it."""
        request = self.requests[request_id]
        serial = request.report.serial + 1 if request.report else 0
        report = Report(request_id, self.station, serial & 0xFF, state, code, text)
        request.report, request.state = report, report.state
        request.history.append((now_ns, report))
        self._open.pop(request_id, None)
        return report

    def take_over(self, payload: bytes, known: Report | None, now_ns: int) -> None:
        """Take over a request of an earlier process of this station.

        If this boot of the rover reported it, ask for its outcome. A request without a report is not sent, because it
        might be executed late; its reports are accepted. Raises WireError.
        """
        asked = commands.decode(payload)
        state = RequestState.REQUESTED if known is None else known.state
        made = Request(asked, now_ns, payload, state, known, sent=1, next_ns=now_ns, own=False)
        if self.requests.setdefault(asked.request_id, made) is made and known is not None:
            self._open[asked.request_id] = made

    def close(self, text: str, now_ns: int) -> list[Report]:
        """Cancel the requests that were never sent, because the station closes."""
        unsent = [i for i, request in self.requests.items() if not request.sent and not request.state.final]
        return [self.end(request_id, RequestState.CANCELLED, Code.NONE, text, now_ns) for request_id in unsent]

    def abandon(self, request_id: int) -> None:
        """Stop retransmitting a request. Its state stays as last reported; the rover may have executed it."""
        self._open.pop(request_id, None)


# -- the rover's end -------------------------------------------------------------------------------------------


class Order(NamedTuple):
    """A checked command to execute.

    request_id: id that is unique over stations; use it in `report`.
    name: name of the command.
    arguments: checked values by name.
    station: the station that issued it.
    """

    request_id: int
    name: str
    arguments: dict[str, commands.Value]
    station: int

    def number(self, name: str) -> float:
        """Return an argument that is a number."""
        value = self.arguments[name]
        assert isinstance(value, float)
        return value

    def points(self, name: str) -> tuple[tuple[float, float], ...]:
        """Return an argument that is a list of points."""
        flat = self.arguments[name]
        assert isinstance(flat, tuple)
        return tuple(zip(flat[::2], flat[1::2]))


@dataclass(slots=True)
class _Known:
    """A received request: its payload and its last report."""

    payload: bytes
    report: Report


class Executor:
    """Rover's end for all stations: each request becomes an Order at most once.

    capacity: requests remembered per station.
    halted: highest halting request id of each station, stored before a restart.
    permit: raises RefusedError if a station may not issue a command.
    """

    def __init__(self, capacity: int = 4096, halted: Mapping[int, int] = MappingProxyType({})) -> None:
        self._capacity = capacity
        self.halts = Halts(halted)
        self._known: dict[int, dict[int, _Known]] = {}
        self._forgotten: dict[int, int] = {}
        self._queue = ReportQueue()
        self._waiting: dict[int, commands.Telecommand] = {}  # key -> requests with a later start time, by that time
        self.permit: Callable[[str, int], None] = lambda name, station: None

    def receive(self, station: int, payload: bytes, now_ns: int, mode: Mode) -> Order | None:
        """Process a Kind.TELECOMMAND payload; return an Order if it is new and may be executed now.

        A refused request is reported with what is allowed. Raises WireError on a payload without a request id.
        """
        request_id = commands.request_id_of(payload)
        if request_id is None:
            raise WireError("telecommand", f"{len(payload)} B")
        seen = self._known.setdefault(station, {}).get(request_id)
        halts = commands.halts(payload)  # executed under any id: a station that lost its numbers may stop the rover
        if seen is not None and not (halts and seen.payload != payload):
            self._again(seen, payload, now_ns)
            return None
        first = Report(request_id, station, 0, RequestState.RECEIVED)
        if request_id <= self._forgotten.get(station, -1) and not halts:
            text = "the request id is older than all that are remembered"
            self._say(first._replace(state=RequestState.FAILED, code=Code.FORGOTTEN_ID, text=text), now_ns)
            return None
        self._remember(station, request_id, _Known(payload, first))
        key = station << 32 | request_id
        try:
            asked = commands.decode(payload)
        except WireError as error:
            self.report(key, RequestState.FAILED, now_ns, str(error), code=Code.UNKNOWN_COMMAND)
            return None
        return self._checked(key, asked, now_ns, mode)

    def _checked(self, key: int, asked: commands.Telecommand, now_ns: int, mode: Mode) -> Order | None:
        if asked.name in commands.HALTING and asked.start_ns <= now_ns:
            self.halts.note(key >> 32, asked, now_ns)
        if asked.expiry_ns and now_ns > asked.expiry_ns:
            late_s = (now_ns - asked.expiry_ns) / 1e9
            self.report(key, RequestState.EXPIRED, now_ns, f"{asked.name} arrived {late_s:.1f} s after its expiry")
            return None
        if older := self.halts.older(key >> 32, asked):
            self.report(key, RequestState.CANCELLED, now_ns, older, code=Code.OVERTAKEN)
            return None
        try:
            code = Code.RANGE
            arguments = commands.check(asked.name, asked.arguments)
            if asked.start_ns > now_ns:
                self._hold(key, asked._replace(arguments=arguments), now_ns)
                return None
            code = Code.LEASE
            self.permit(asked.name, key >> 32)
            code = Code.MODE
            commands.check_mode(asked.name, mode)
        except ValueError as error:
            self.report(key, RequestState.FAILED, now_ns, str(error), code=code)
            return None
        self.report(key, RequestState.ACCEPTED, now_ns)
        return Order(key, asked.name, arguments, key >> 32)

    def _hold(self, key: int, asked: commands.Telecommand, now_ns: int) -> None:
        if asked.expiry_ns and asked.expiry_ns < asked.start_ns:
            raise ValueError(f"{asked.name}: its expiry, {asked.expiry_ns / 1e9:.1f} s, is before its start")
        if len(self._waiting) == _MOST_WAITING:
            text = f"{_MOST_WAITING} requests wait for their time already; stop ends them"
            self.report(key, RequestState.FAILED, now_ns, text, code=Code.TOO_MANY)
            return
        self._waiting[key] = asked
        self._waiting = dict(sorted(self._waiting.items(), key=lambda row: row[1].start_ns))
        self.report(
            key, RequestState.ACCEPTED, now_ns, f"waits until {asked.start_ns / 1e9:.1f} s, now {now_ns / 1e9:.1f} s"
        )

    @property
    def held(self) -> int:
        """Number of requests that wait for their start time."""
        return len(self._waiting)

    @property
    def waits(self) -> list[str]:
        """Waiting requests as text, the earliest first: command, start, station and request id."""
        return [
            f"{asked.name} at {asked.start_ns / 1e9:.1f} s ({key >> 32}#{key & 0xFFFFFFFF})"
            for key, asked in self._waiting.items()
        ]

    def due(self, now_ns: int, mode: Mode) -> list[Order]:
        """Return the orders whose start time has come and that may be executed now, the earliest first."""
        orders = []
        for key in [key for key, asked in self._waiting.items() if asked.start_ns <= now_ns]:
            order = self._checked(key, self._waiting.pop(key), now_ns, mode)
            orders += [order] if order is not None else []
        return orders

    def cancel_waiting(self, now_ns: int, reason: str) -> None:
        """Cancel all requests that wait for their start time."""
        for key in self._waiting:
            self.report(key, RequestState.CANCELLED, now_ns, reason)
        self._waiting.clear()

    def _again(self, seen: _Known, payload: bytes, now_ns: int) -> None:
        if seen.payload != payload:
            text = "the request id was used before for another request; a station whose numbers are lost needs new keys"
            self._say(seen.report._replace(state=RequestState.FAILED, code=Code.REUSED_ID, text=text), now_ns)
        elif key_of(seen.report.station, seen.report.request_id) not in self._queue:
            self._say(seen.report, now_ns)

    def _remember(self, station: int, request_id: int, known: _Known) -> None:
        table = self._known[station]
        table[request_id] = known
        if len(table) > self._capacity:
            oldest = next(iter(table))
            del table[oldest]
            self._forgotten[station] = max(self._forgotten.get(station, -1), oldest)

    def report(
        self,
        request_id: int,
        state: RequestState,
        now_ns: int,
        text: str = "",
        data: Sequence[float] = (),
        *,
        code: int = 0,
    ) -> None:
        """Report the progress or outcome of an Order; two copies are sent. An unknown request id is ignored."""
        known = self._known.get(request_id >> 32, {}).get(request_id & 0xFFFFFFFF)
        if known is None or known.report.state.final:
            return
        made = known.report._replace(
            serial=known.report.serial + 1, state=state, code=int(code), text=text, data=tuple(map(float, data))
        )
        known.report = made
        self._queue.drop(request_id)  # the newest report contains all
        self._say(made, now_ns)

    def _say(self, report: Report, now_ns: int) -> None:
        known = self._known.get(report.station, {}).get(report.request_id)
        self._queue.add(report, known is not None and commands.halts(known.payload), now_ns)

    def waiting(self, now_ns: int) -> bool:
        """True if a report is due and was not sent."""
        return self._queue.waiting(now_ns)

    def send(self, now_ns: int, budget_bytes: float = float("inf")) -> list[bytes]:
        """Return due payloads of Kind.REPORT in the order of rule 7, while their bytes on the line fit the budget."""
        return self._queue.send(now_ns, budget_bytes)
