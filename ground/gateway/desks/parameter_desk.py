"""Answers to PARAM_REQUEST_LIST, PARAM_REQUEST_READ and PARAM_SET, from the mirror and from the rover.

The mirror is filled at a client's first request, and again after a reboot of the rover or a change by another station.
PARAM_SET is answered with PARAM_VALUE after the rover's report: the new value, or the unchanged one.
"""

from __future__ import annotations

from collections import deque
from typing import Any, NamedTuple

from ground.gateway.desks.missions import Asker, ClientKey, To
from ground.gateway.desks.parameters import Mirror, Parameter, same, word
from ground.gateway.frames import mavlink as m
from ground.gateway.frames import text_of
from ground.link.news import EventHeard
from ground.link.session import Session
from protocol.link.transactions import RequestState

_PER_TURN = 16  # values sent in one turn: all at once would overrun a client's socket
_ALL = -2
_MOST_WAITING = 256


class _ParameterRequest(NamedTuple):
    """Waiting request of a client.

    client, target: its key, and its system and component.
    id: of the parameter.
    number: index of the parameter; _ALL: all; -1: `id` names it.
    value: to set; None: a read.
    """

    client: ClientKey
    target: tuple[int, int]
    id: str
    number: int
    value: float | None = None

    @property
    def asked_by(self) -> str:
        """The client as the archive names it."""
        return Asker(self.client, self.target).words


class _Setting(NamedTuple):
    """One set requested from the rover."""

    wanted: _ParameterRequest
    parameter: Parameter
    word: str
    request_id: int


class ParameterDesk:
    """Parameters of one session for all clients. texts: lines for all clients, (severity, text)."""

    def __init__(self, session: Session) -> None:
        self._session, self._mirror = session, Mirror()
        self._stale = True
        self._boot_id = 0
        self._listing: int | None = None  # the request that fills the mirror
        self._wanted: list[_ParameterRequest] = []  # requests that wait for the mirror
        self._sets: deque[_ParameterRequest] = deque()  # sets that wait for the set before them
        self._setting: _Setting | None = None
        self._values: deque[To] = deque()
        self.texts: list[tuple[str, str]] = []

    def receive(self, client: ClientKey, target: tuple[int, int], message: Any, now_ns: int) -> None:
        """Process one of the three messages."""
        kind = message.get_type()
        if kind == "PARAM_REQUEST_LIST":
            wanted = _ParameterRequest(client, target, "", _ALL)
        elif kind == "PARAM_REQUEST_READ":
            wanted = _ParameterRequest(client, target, text_of(message, "param_id"), max(-1, message.param_index))
        else:
            wanted = _ParameterRequest(client, target, text_of(message, "param_id"), -1, float(message.param_value))
        if wanted in self._wanted or len(self._wanted) >= _MOST_WAITING:
            return
        self._wanted.append(wanted)
        self._serve(now_ns)

    def hear(self, event: EventHeard) -> None:
        """Mark the mirror as stale after a change by another station."""
        if event.name == "PARAMETER" and not event.text.endswith(f"by station {self._session.station}"):
            self._stale = True

    def poll(self, now_ns: int) -> list[To]:
        """Return the answers that the rover's reports and products allow."""
        if self._session.boot_id != self._boot_id:
            self._boot_id, self._stale = self._session.boot_id, True
        self._fill()
        self._finish_set(now_ns)
        self._serve(now_ns)
        return [self._values.popleft() for _ in range(min(_PER_TURN, len(self._values)))]

    @property
    def busy(self) -> bool:
        """True if values wait for the next turn."""
        return bool(self._values)

    def _fill(self) -> None:
        if self._listing is None:
            return
        request = self._session.requester.requests[self._listing]
        product = self._session.product_of(self._listing) if request.state is RequestState.COMPLETED else None
        if product is not None:
            self._mirror.fill(product.data.decode(errors="replace"))
            self._listing, self._stale = None, False
        elif request.state.final and request.state is not RequestState.COMPLETED:
            text = request.report.text if request.report is not None else request.state.name.lower()
            self.texts.append(("warning", f"the parameters cannot be listed: {text}"))
            self._listing = None
            self._wanted.clear()

    def _serve(self, now_ns: int) -> None:
        if self._wanted and self._listing is None and self._must_list:
            self._listing = self._session.request("param_list", {}, now_ns, asked_by=self._wanted[0].asked_by)
        if self._listing is not None:
            return
        wanted, self._wanted = self._wanted, []
        for one in wanted:
            if one.number == _ALL:
                self._values.extend(To(one.client, message) for message in self._mirror.messages())
            elif one.value is not None:
                if one not in self._sets and (self._setting is None or self._setting.wanted != one):
                    self._sets.append(one)
            else:
                self._answer(one)
        self._next_set(now_ns)

    @property
    def _must_list(self) -> bool:
        return not len(self._mirror) or (self._stale and any(one.number == _ALL for one in self._wanted))

    def _answer(self, one: _ParameterRequest) -> None:
        parameter = self._mirror.find(one.id, one.number)
        if parameter is None:
            self._refuse(one, m.MAV_PARAM_ERROR_DOES_NOT_EXIST)
        else:
            self._values.append(To(one.client, self._mirror.message(parameter)))

    def _next_set(self, now_ns: int) -> None:
        while self._sets and self._setting is None:
            one = self._sets.popleft()
            parameter = self._mirror.find(one.id)
            if parameter is None or one.value is None:
                self._refuse(one, m.MAV_PARAM_ERROR_DOES_NOT_EXIST)
                continue
            try:
                asked = word(parameter, one.value)
                arguments = {"parameter": parameter.name, "value": asked}
                request_id = self._session.request("param_set", arguments, now_ns, asked_by=one.asked_by)
                self._setting = _Setting(one, parameter, asked, request_id)
            except ValueError as error:
                self.texts.append(("warning", str(error)))
                self._refuse(one, m.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE)
                self._answer(one._replace(value=None))

    def _finish_set(self, now_ns: int) -> None:
        setting = self._setting
        if setting is None:
            return
        request = self._session.requester.requests[setting.request_id]
        if not request.state.final:
            return
        self._setting = None
        if request.state is RequestState.COMPLETED:
            value = float(setting.parameter.kind(_numbers(setting.word)))
            kept = self._mirror.keep(self._mirror.find(setting.parameter.id) or setting.parameter, value)
            assert setting.wanted.value is not None and same(kept, setting.wanted.value)
            self._values.append(To(None, self._mirror.message(kept)))
            return
        text = request.report.text if request.report is not None else request.state.name.lower()
        self.texts.append(("warning", f"{setting.parameter.name} not set: {text}"))
        self._refuse(
            setting.wanted, m.MAV_PARAM_ERROR_READ_ONLY if "file" in text else m.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE
        )
        self._answer(setting.wanted._replace(value=None))

    def _refuse(self, one: _ParameterRequest, error: int) -> None:
        message = m.MAVLink_param_error_message(*one.target, one.id.encode(), one.number, error)
        self._values.append(To(one.client, message))


def _numbers(text: str) -> float:
    return float(text == "true") if text in ("true", "false") else float(text)
