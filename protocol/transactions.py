"""Telecommand transactions, both ends: every request is executed once and its outcome is known, over any loss.

    ground: Requester                                  rover: Executor
      |  telecommand, every max(0.5 s, RTT/2) --------->  |  first: checked, RECEIVED and ACCEPTED or REFUSED
      |  <------------------ report, two copies, 0.2 s    |  again: the last report once more, in two copies too
      |  telecommand, every max(5 s, 2 RTT) ----------->  |  (asks for the outcome, which may have been lost)
      |  <------------------ report: COMPLETED ...        |

What halts the rover is sent every max(`halt_retry_ns`, RTT/2) until it is heard of.

Rule 1: a request id of a station names one request for ever, and ids rise in the order of asking, also over several
        processes of it. The ground keeps its next id on disk, as it keeps its counter; an id with other content than
        before is refused, one older than all that is remembered is refused too.
Rule 2: a request that arrives after its expiry is never executed, and reported EXPIRED.
Rule 3: a request with a start time waits on board until then (at most 32 do); its mode and expiry are looked at then.
Rule 4: each report carries a serial number per request, so that a late one never overwrites a newer.
Rule 5: a rover that restarts has forgotten what it did. A request that was sent before is not sent to it again, but
        ends with that reason; only those that halt are, which do no harm twice.
Rule 6: what was asked before a halt and arrives after it lets nothing move any more (protocol.halts).
Rule 7: reports of what halts the rover leave first, then those of each station in turn. Of a station so many requests'
        reports wait at most, then the oldest are dropped: it asks again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple

from protocol import WireError, commands
from protocol.halts import Halts
from protocol.modes import Mode
from protocol.report_queue import ReportQueue, key_of
from protocol.reports import Code as Code
from protocol.reports import Report as Report
from protocol.reports import State as State
from protocol.reports import decode_report as decode_report
from protocol.reports import encode_report as encode_report

_RETRY_NS, _ASK_NS = 500_000_000, 5_000_000_000
_MOST_WAITING = 32


# -- the ground's end ------------------------------------------------------------------------------------------


@dataclass(slots=True)
class Request:
    """One request as the ground knows it. history: (ground time ns, report) as heard. asked_by: for people."""

    telecommand: commands.Telecommand
    made_ns: int
    payload: bytes
    state: State = State.REQUESTED
    report: Report | None = None
    history: list[tuple[int, Report]] = field(default_factory=list)
    sent: int = 0
    next_ns: int = 0
    own: bool = True  # False: taken over from a process of this station that has ended
    asked_by: str = ""


class Requester:
    """The ground's end of one station. Times are the ground's; issue and expiry are given in onboard time.

    first_id: kept on disk ahead of use (rule 1); take_id: gives the next one, where several processes share them.
    rtt_ns may be set at any time. remembered: requests in `requests`, the oldest of those whose outcome is known are
    forgotten.
    """

    def __init__(self, station: int, first_id: int = 1, rtt_ns: int = 0, remembered: int = 2048) -> None:
        self._remembered = remembered
        self.station, self.next_id, self.rtt_ns = station, first_id, rtt_ns
        self.halt_retry_ns = _RETRY_NS  # less where the line carries it
        self.take_id: Callable[[], int] = self.count_id
        self.requests: dict[int, Request] = {}
        self._open: dict[int, Request] = {}

    def request(
        self, name: str, arguments: commands.Arguments, now_ns: int, *, issued_ns: int = 0, expiry_ns: int = 0,
        start_ns: int = 0,
    ) -> int:
        """A new request; `send` gives its datagrams. Raises ValueError as commands.check does."""
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
        """The next of `next_id`, which nobody else counts."""
        self.next_id += 1
        return self.next_id - 1

    def send(self, now_ns: int, halting_only: bool = False) -> list[bytes]:
        """Payloads of Kind.TELECOMMAND that are due now; or of them those that halt the rover, the others wait."""
        out = []
        for request in self._open.values():
            if now_ns < request.next_ns or (halting_only and not commands.halts(request.payload)):
                continue
            heard = request.state != State.REQUESTED
            least_ns = self.halt_retry_ns if commands.halts(request.payload) else _RETRY_NS
            wait_ns = max(_ASK_NS, 2 * self.rtt_ns) if heard else max(least_ns, self.rtt_ns // 2)
            request.next_ns, request.sent = now_ns + wait_ns, request.sent + 1
            out.append(request.payload)
        return out

    @property
    def open(self) -> int:
        """How many requests still wait for their outcome."""
        return len(self._open)

    def next_due_ns(self, halting_only: bool = False) -> int | None:
        """When `send` has something again; None while nothing is open."""
        rows = (r for r in self._open.values() if not halting_only or commands.halts(r.payload))
        return min((r.next_ns for r in rows), default=None)

    def receive(self, payload: bytes, now_ns: int) -> Report | None:
        """A Kind.REPORT payload. The report where it is news of one of this station's requests, else None.

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
        """The rover came up anew (rule 5): what ends by that. Whoever asked it to has the answer by that."""
        reports = []
        for request_id, request in list(self._open.items()):
            if not request.sent or request.telecommand.name in commands.HALTING:
                continue
            state, code, text = State.COMPLETED, Code.NONE, f"up anew, boot {boot_id}"
            if request.telecommand.name != "reboot":
                heard = request.state.name.lower()
                state, code = State.FAILED, Code.RESTARTED
                text = f"the rover restarted (boot {boot_id}) before its outcome was heard; until then: {heard}"
            reports.append(self.end(request_id, state, code, text, now_ns))
        return reports

    @property
    def unheard_moves(self) -> list[int]:
        """Requests that would let the rover move and of which nothing was heard: they are sent again and again."""
        return [request_id for request_id, request in self._open.items()
                if request.state is State.REQUESTED and commands.command(request.telecommand.name).frees]

    def refuse(self, text: str, now_ns: int) -> list[Report]:
        """None of the open requests is sent any more, but those that halt the rover: the ground's own refusal."""
        reports = []
        for request_id, request in list(self._open.items()):
            if not commands.halts(request.payload):
                reports.append(self.end(request_id, State.FAILED, Code.VERSION, text, now_ns))
        return reports

    def end(self, request_id: int, state: State, code: Code, text: str, now_ns: int) -> Report:
        """The ground's own word on a request, which is sent no more. What the rover says of it later counts."""
        request = self.requests[request_id]
        serial = request.report.serial + 1 if request.report else 0
        report = Report(request_id, self.station, serial & 0xFF, state, code, text)
        request.report, request.state = report, report.state
        request.history.append((now_ns, report))
        self._open.pop(request_id, None)
        return report

    def take_over(self, payload: bytes, known: Report | None, now_ns: int) -> None:
        """A request of an earlier process of this station. It is asked for where this boot of the rover reported it.

        Of one that it never did only a report is taken: sent again it might be done late. Raises WireError.
        """
        asked = commands.decode(payload)
        state = State.REQUESTED if known is None else known.state
        made = Request(asked, now_ns, payload, state, known, sent=1, next_ns=now_ns, own=False)
        if self.requests.setdefault(asked.request_id, made) is made and known is not None:
            self._open[asked.request_id] = made

    def close(self, text: str, now_ns: int) -> list[Report]:
        """Nothing is sent any more: what never was is CANCELLED with that."""
        unsent = [i for i, request in self.requests.items() if not request.sent and not request.state.final]
        return [self.end(request_id, State.CANCELLED, Code.NONE, text, now_ns) for request_id in unsent]

    def abandon(self, request_id: int) -> None:
        """Ask no longer. The rover may have executed it all the same: its state stays what was last heard."""
        self._open.pop(request_id, None)


# -- the rover's end -------------------------------------------------------------------------------------------


class Order(NamedTuple):
    """A command to be carried out, checked. request_id is unique over stations: use it in `report`."""

    request_id: int
    name: str
    arguments: dict[str, commands.Value]
    station: int

    def number(self, name: str) -> float:
        """An argument that is a number."""
        value = self.arguments[name]
        assert isinstance(value, float)
        return value

    def points(self, name: str) -> tuple[tuple[float, float], ...]:
        """An argument that is a list of points."""
        flat = self.arguments[name]
        assert isinstance(flat, tuple)
        return tuple(zip(flat[::2], flat[1::2]))


@dataclass(slots=True)
class _Known:
    """A request that was seen: its payload and the last report of it."""

    payload: bytes
    report: Report


class Executor:
    """The rover's end for all stations: each request becomes an Order at most once.

    capacity: requests remembered per station. halted: highest request id that halted, by station, of before a restart.
    permit: raises RefusedError where a station may not give a command.
    """

    def __init__(self, capacity: int = 4096, halted: Mapping[int, int] = MappingProxyType({})) -> None:
        self._capacity = capacity
        self.halts = Halts(halted)
        self._known: dict[int, dict[int, _Known]] = {}
        self._forgotten: dict[int, int] = {}
        self._queue = ReportQueue()
        self._waiting: dict[int, commands.Telecommand] = {}  # key -> what starts later, by its start time
        self.permit: Callable[[str, int], None] = lambda name, station: None

    def receive(self, station: int, payload: bytes, now_ns: int, mode: Mode) -> Order | None:
        """A Kind.TELECOMMAND payload: an Order where it is new and may be done now.

        What may not be done is reported with what would be allowed. Raises WireError on a payload without a request id.
        """
        request_id = commands.request_id_of(payload)
        if request_id is None:
            raise WireError("telecommand", f"{len(payload)} B")
        seen = self._known.setdefault(station, {}).get(request_id)
        halts = commands.halts(payload)  # obeyed under any id: a station that lost its numbers may stop the rover
        if seen is not None and not (halts and seen.payload != payload):
            self._again(seen, payload, now_ns)
            return None
        first = Report(request_id, station, 0, State.RECEIVED)
        if request_id <= self._forgotten.get(station, -1) and not halts:
            text = "the request id is older than all that are remembered"
            self._say(first._replace(state=State.FAILED, code=Code.FORGOTTEN_ID, text=text), now_ns)
            return None
        self._remember(station, request_id, _Known(payload, first))
        key = station << 32 | request_id
        try:
            asked = commands.decode(payload)
        except WireError as error:
            self.report(key, State.FAILED, now_ns, str(error), code=Code.UNKNOWN_COMMAND)
            return None
        return self._checked(key, asked, now_ns, mode)

    def _checked(self, key: int, asked: commands.Telecommand, now_ns: int, mode: Mode) -> Order | None:
        if asked.name in commands.HALTING and asked.start_ns <= now_ns:
            self.halts.note(key >> 32, asked, now_ns)
        if asked.expiry_ns and now_ns > asked.expiry_ns:
            late_s = (now_ns - asked.expiry_ns) / 1e9
            self.report(key, State.EXPIRED, now_ns, f"{asked.name} arrived {late_s:.1f} s after its expiry")
            return None
        if older := self.halts.older(key >> 32, asked):
            self.report(key, State.CANCELLED, now_ns, older, code=Code.OVERTAKEN)
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
            self.report(key, State.FAILED, now_ns, str(error), code=code)
            return None
        self.report(key, State.ACCEPTED, now_ns)
        return Order(key, asked.name, arguments, key >> 32)

    def _hold(self, key: int, asked: commands.Telecommand, now_ns: int) -> None:
        if asked.expiry_ns and asked.expiry_ns < asked.start_ns:
            raise ValueError(f"{asked.name}: its expiry, {asked.expiry_ns / 1e9:.1f} s, is before its start")
        if len(self._waiting) == _MOST_WAITING:
            text = f"{_MOST_WAITING} requests wait for their time already; stop ends them"
            self.report(key, State.FAILED, now_ns, text, code=Code.TOO_MANY)
            return
        self._waiting[key] = asked
        self._waiting = dict(sorted(self._waiting.items(), key=lambda row: row[1].start_ns))
        self.report(key, State.ACCEPTED, now_ns, f"waits until {asked.start_ns / 1e9:.1f} s, now {now_ns / 1e9:.1f} s")

    @property
    def held(self) -> int:
        """How many requests wait for their start time."""
        return len(self._waiting)

    @property
    def waits(self) -> list[str]:
        """Each of them in words, the earliest first: command, start, station and request id."""
        return [f"{asked.name} at {asked.start_ns / 1e9:.1f} s ({key >> 32}#{key & 0xFFFFFFFF})"
                for key, asked in self._waiting.items()]

    def due(self, now_ns: int, mode: Mode) -> list[Order]:
        """Those whose start time has come and which may be done now, the earliest first."""
        orders = []
        for key in [key for key, asked in self._waiting.items() if asked.start_ns <= now_ns]:
            order = self._checked(key, self._waiting.pop(key), now_ns, mode)
            orders += [order] if order is not None else []
        return orders

    def cancel_waiting(self, now_ns: int, reason: str) -> None:
        """Nothing that waits for its start time is started any more."""
        for key in self._waiting:
            self.report(key, State.CANCELLED, now_ns, reason)
        self._waiting.clear()

    def _again(self, seen: _Known, payload: bytes, now_ns: int) -> None:
        if seen.payload != payload:
            text = "the request id was used before for another request; a station whose numbers are lost needs new keys"
            self._say(seen.report._replace(state=State.FAILED, code=Code.REUSED_ID, text=text), now_ns)
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
        self, request_id: int, state: State, now_ns: int, text: str = "", data: Sequence[float] = (), *, code: int = 0
    ) -> None:
        """What becomes of an Order; two copies are sent. An unknown request id is ignored."""
        known = self._known.get(request_id >> 32, {}).get(request_id & 0xFFFFFFFF)
        if known is None or known.report.state.final:
            return
        made = known.report._replace(
            serial=known.report.serial + 1, state=state, code=int(code), text=text, data=tuple(map(float, data))
        )
        known.report = made
        self._queue.drop(request_id)  # the newest says it all
        self._say(made, now_ns)

    def _say(self, report: Report, now_ns: int) -> None:
        known = self._known.get(report.station, {}).get(report.request_id)
        self._queue.add(report, known is not None and commands.halts(known.payload), now_ns)

    def waiting(self, now_ns: int) -> bool:
        """Whether a report is due that was not sent."""
        return self._queue.waiting(now_ns)

    def send(self, now_ns: int, budget_bytes: float = float("inf")) -> list[bytes]:
        """Payloads of Kind.REPORT that are due, as rule 7 says, while their bytes on the line fit the budget."""
        return self._queue.send(now_ns, budget_bytes)
