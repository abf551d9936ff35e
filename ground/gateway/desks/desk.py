"""Queue of MAVLink commands that await the rover's report: one at a time of each command of each client.

    COMMAND_LONG ---> IN_PROGRESS at once, and each second     request id n ---> the rover
         <----------- the final COMMAND_ACK                    <--- report of n

Rule 1: COMMAND_ACK names a command and nothing else, so a client's second request of a command waits, unsent, until the
        first has its final acknowledgement. Only the report with the request's own id confirms it.
Rule 2: The same command with the same parameters, received while one waits, is a retransmission of that one. After its
        end it is a retransmission only if `confirmation` is set: the acknowledgement is repeated, nothing is executed.
Rule 3: A command that stops the rover waits for nothing. Earlier requests that have not begun are cancelled and sent no
        more. Requests that wait while the rover restarts are cancelled too; the rover must then be armed again.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ground.gateway.desks.missions import Asker, ClientKey, To
from ground.gateway.desks.orders import CANCELLED, GIVES_WAY, GatewayAnswer, MavCommand, Request, RoverState, order
from ground.gateway.frames import mavlink as m
from ground.link.session import Session
from protocol.link.transactions import Code, Report, RequestState
from protocol.tables import commands

LIFETIME_S = 60.0
_TELL_NS, _REPEAT_NS = 1_000_000_000, 60_000_000_000
_MOST_WAITING = 8
_CODES: dict[int, int] = {
    Code.MODE: m.MAV_RESULT_TEMPORARILY_REJECTED,
    Code.RANGE: m.MAV_RESULT_DENIED,
    Code.UNKNOWN_COMMAND: m.MAV_RESULT_UNSUPPORTED,
    Code.TOO_MANY: m.MAV_RESULT_TEMPORARILY_REJECTED,
}
Ack = Callable[[int], Any]  # a MAV_RESULT to the message that carries it; None: no message


@dataclass(slots=True)
class _Job:
    """One request of a client, waiting or sent.

    client: of the request.
    made: what the order table returned.
    ack: makes the acknowledgement.
    same: text that identifies a retransmission.
    asked_by: origin, for the archive.
    request_id: of the rover's request; None: not sent yet.
    told_ns: time of the newest IN_PROGRESS.
    """

    client: ClientKey
    made: Request | GatewayAnswer
    ack: Ack
    same: str
    asked_by: str = ""
    request_id: int | None = None
    told_ns: int = 0


@dataclass(frozen=True, slots=True)
class Outcome:
    """Outcome of a request that had begun."""

    name: str
    state: RequestState
    text: str


def acknowledgement(command: int, target: tuple[int, int]) -> Ack:
    """Return a function that makes the COMMAND_ACKs of one command for one client."""
    return lambda result: m.MAVLink_command_ack_message(
        command, result, 255 if result == m.MAV_RESULT_IN_PROGRESS else 0, 0, *target
    )


class CommandQueue:
    """Queue of all clients' commands on one session.

    enabled: True after `arm`.
    texts: lines for all clients, (severity, text).
    wanted: messages that clients have requested, by name.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._lines: dict[tuple[ClientKey, int], deque[_Job]] = {}
        self._ended: dict[tuple[ClientKey, int], tuple[str, int, int]] = {}  # same, result, time
        self._begun: dict[int, str] = {}
        self.enabled = False
        self.texts: list[tuple[str, str]] = []
        self.wanted: list[tuple[ClientKey, str]] = []

    def command(self, client: Asker, message: Any, known: RoverState, now_ns: int) -> list[To]:
        """Process COMMAND_LONG or COMMAND_INT."""
        asked = MavCommand.of(message)
        key, same = (client.key, asked.command), repr(asked)
        ack = acknowledgement(asked.command, client.target)
        if getattr(message, "confirmation", 0) and key not in self._lines:
            was, result, _ = self._ended.get(key, ("", 0, 0))
            if was == same:
                return [To(client.key, ack(result))]
        return self.ask(client, asked, ack, known, now_ns)

    def ask(self, client: Asker, asked: MavCommand, ack: Ack, known: RoverState, now_ns: int) -> list[To]:
        """Process a command from any message; `ack` makes its acknowledgement."""
        key, same = (client.key, asked.command), repr(asked)
        line = self._lines.get(key, deque())
        if any(job.same == same for job in line):
            return _said(client.key, ack(m.MAV_RESULT_IN_PROGRESS))
        if len(line) >= _MOST_WAITING:
            return _said(client.key, ack(m.MAV_RESULT_TEMPORARILY_REJECTED))
        made, out = order(asked, known), list[To]()
        if isinstance(made, Request) and made.urgent:
            out += self._make_way(key, now_ns)
            self.enabled = self.enabled and made.enables is not False
        job = _Job(client.key, made, ack, same, client.words)
        self._lines.setdefault(key, deque()).append(job)
        if isinstance(made, Request):
            job.told_ns = now_ns
            out += _said(client.key, ack(m.MAV_RESULT_IN_PROGRESS))
        return out + self._advance(key, now_ns)

    def poll(self, now_ns: int) -> tuple[list[To], list[Outcome]]:
        """Return the messages that are due (acknowledgements, IN_PROGRESS) and the outcomes of begun requests."""
        out = [to for key in list(self._lines) for to in self._advance(key, now_ns)]
        ended = []
        self._ended = {key: row for key, row in self._ended.items() if now_ns - row[2] < _REPEAT_NS}
        for request_id, name in list(self._begun.items()):
            request = self._session.requester.requests[request_id]
            if request.state.final:
                del self._begun[request_id]
                text = request.report.text if request.report is not None else ""
                ended.append(Outcome(name, request.state, text))
        return out, ended

    def rover_booted(self, now_ns: int) -> list[To]:
        """Withdraw the enabling after a reboot; requests that could move the rover do not go to the new boot."""
        self.enabled = False
        return self._make_way(None, now_ns)

    @property
    def stopping(self) -> bool:
        """True while a command that stops the rover awaits its report."""
        return any(isinstance(job.made, Request) and job.made.urgent for line in self._lines.values() for job in line)

    def next_due_ns(self) -> int | None:
        """Return the time at which the next IN_PROGRESS is due."""
        return min((line[0].told_ns + _TELL_NS for line in self._lines.values() if line), default=None)

    # -- a line of one client's requests of one command -----------------------------------------------------

    def _advance(self, key: tuple[ClientKey, int], now_ns: int) -> list[To]:
        out: list[To] = []
        line = self._lines[key]
        while line:
            job = line[0]
            result = self._result(job, now_ns)
            if result is None:
                if now_ns - job.told_ns >= _TELL_NS:
                    job.told_ns = now_ns
                    out += _said(job.client, job.ack(m.MAV_RESULT_IN_PROGRESS))
                break
            line.popleft()
            out += self._end(key, job, result, now_ns)
        if not line:
            del self._lines[key]
        return out

    def _result(self, job: _Job, now_ns: int) -> int | None:
        if isinstance(job.made, GatewayAnswer):
            return job.made.result
        if job.request_id is None:
            lifetime_s = LIFETIME_S if commands.command(job.made.name).moves else 0.0
            try:
                job.request_id = self._session.request(
                    job.made.name, job.made.arguments, now_ns, lifetime_s, asked_by=job.asked_by
                )
            except ValueError as error:
                self.texts.append(("warning", str(error)))
                return m.MAV_RESULT_DENIED
        request = self._session.requester.requests[job.request_id]
        if request.state.final:
            return self._final(job.made.name, request.state, request.report)
        if job.made.begun and request.state in (RequestState.STARTED, RequestState.PROGRESS):
            self._begun[job.request_id] = job.made.name
            return m.MAV_RESULT_ACCEPTED
        return None

    def _final(self, name: str, state: RequestState, report: Report | None) -> int:
        if state is RequestState.COMPLETED:
            return m.MAV_RESULT_ACCEPTED
        text = report.text if report is not None else ""
        self.texts.append(("warning", f"{name} {state.name.lower()}" + (f": {text}" if text else "")))
        if state is RequestState.CANCELLED:
            return CANCELLED
        code = report.code if report is not None and state is RequestState.FAILED else 0
        return _CODES.get(code, m.MAV_RESULT_FAILED)

    def _end(self, key: tuple[ClientKey, int], job: _Job, result: int, now_ns: int) -> list[To]:
        if job.made.enables is not None and result == m.MAV_RESULT_ACCEPTED:
            self.enabled = job.made.enables
        if isinstance(job.made, GatewayAnswer):
            self.texts += [("warning", job.made.text)] if job.made.text else []
            self.wanted += [(job.client, name) for name in job.made.messages]
        self._ended[key] = (job.same, result, now_ns)
        return _said(job.client, job.ack(result))

    def _make_way(self, urgent: tuple[ClientKey, int] | None, now_ns: int) -> list[To]:
        """Cancel all clients' requests that let the rover move and have not begun, and the rest of the urgent line.

        A request that has ended is acknowledged with its own result.
        """
        requests = self._session.requester.requests
        out: list[To] = []
        for key, line in list(self._lines.items()):
            for job in list(line):
                moves = isinstance(job.made, Request) and job.made.name in GIVES_WAY
                over = job.request_id is not None and requests[job.request_id].state.final
                if not (over or moves or key == urgent):
                    continue
                line.remove(job)
                if job.request_id is not None and moves:
                    self._session.requester.abandon(job.request_id)
                result = self._result(job, now_ns) if over else None
                out += self._end(key, job, CANCELLED if result is None else result, now_ns)
            if not line:
                del self._lines[key]
        return out


def _said(client: ClientKey, message: Any) -> list[To]:
    return [] if message is None else [To(client, message)]
