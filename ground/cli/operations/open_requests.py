"""Summary of open requests when a station ends: requests never sent, not confirmed, or still executed by the rover."""

from __future__ import annotations

from collections.abc import Sequence

from ground.cli.operations.script import ScriptStep
from ground.link.product_receiver import product_name
from ground.link.session import NOT_SENT, Session
from protocol.link.transactions import Request, RequestState
from protocol.tables import commands

_ENDS = "`ground stop` ends it"


def left(session: Session, steps: Sequence[ScriptStep] = ()) -> list[str]:
    """Return one text for each kind of open request; none if nothing is open.

    steps: of a plan; they count as not sent while nothing was requested.
    """
    own = [request for request in session.requester.requests.values() if request.own]
    unsent = [step.name for step in steps if not own and step.verb in ("command", "contacts")]
    unsent += [_name(request) for request in own if _never_sent(request)]
    still = [request for request in own if request.sent and not request.state.final]
    halts = [_name(request) for request in still if commands.halts(request.payload)]
    others = [request for request in still if not commands.halts(request.payload)]
    unheard = [request for request in others if request.state is RequestState.REQUESTED]
    told = [request for request in others if request.state is not RequestState.REQUESTED]
    coming = [
        product_name(request.telecommand)
        for request_id, request in session.requester.requests.items()
        if request.own and session.awaits_product(request_id) and session.product_of(request_id) is None
    ]
    return [
        *([f"NOT sent: {', '.join(unsent)}"] if unsent else []),
        *([f"sent and not confirmed yet: {', '.join(halts)}"] if halts else []),
        *(
            [
                f"sent and nothing heard of it: {', '.join(map(_name, unheard))}"
                + (f"; the rover may do it, {_ENDS}" if _moves(unheard) else "")
            ]
            if unheard
            else []
        ),
        *(
            [
                f"the rover carries on with what it was told ({', '.join(map(_name, told))})"
                + (f", {_ENDS}" if _moves(told) else "")
            ]
            if told
            else []
        ),
        *([f"not all of it has come: {', '.join(coming)}"] if coming else []),
    ]


def _name(request: Request) -> str:
    return commands.command(request.telecommand.name).typed


def _moves(requests: Sequence[Request]) -> bool:
    return any(commands.command(request.telecommand.name).frees for request in requests)


def _never_sent(request: Request) -> bool:
    """Return whether a request was never sent, also if it was closed as such when the station ended."""
    closed = request.report is not None and request.report.text == NOT_SENT
    return not request.sent and (closed or not request.state.final)
