"""Execution of one verb as one operation: its words become a plan, its outcome an exit code and a last line."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any, NoReturn

import typer

from ground.cli.operations.open_requests import left
from ground.cli.operations.operate import FAILED, TEMPORARY, Plan, Teller, operate
from ground.cli.operations.script import ScriptStep
from ground.cli.operations.way_out import refusal_words, shorter
from ground.cli.verbs.screen import line_beside, line_out, text_out
from ground.link.schedule import utc_ns
from ground.link.session import Session
from ground.station.settings import load_settings
from protocol.link.transactions import Code, Request, RequestState
from protocol.tables import commands


def ask(station: Path | None, plan: Plan, as_json: bool) -> tuple[int, Session]:
    """Run a plan with a station's file and print its news. Returns the exit code and the session."""
    settings = load_settings(station)
    return operate(settings, plan, _teller(as_json, plan.report_s or settings.report_s))


def _teller(as_json: bool, report_s: float) -> Teller:
    """Return bars in a terminal, lines elsewhere."""
    if as_json or not sys.stdout.isatty():
        return Teller(line_out, as_json, report_s)
    from ground.cli.operations.bars import Bars

    return Bars(line_out, report_s)


def leave(code: int, session: Session) -> NoReturn:
    """Exit with the code; if the command did not succeed, the last line states why."""
    if code == TEMPORARY:
        last_words(_unfinished(session))
    elif code == FAILED:
        last_words(_failure(session))
    raise typer.Exit(code)


def _unfinished(session: Session) -> str:
    """Return what goes on after the station's time limit."""
    still = [r for r in session.requester.requests.values() if r.own and not r.state.final]
    if len(still) != 1 or still[0].telecommand.name != "lease_ask" or still[0].state != RequestState.STARTED:
        return "; ".join(["not finished in time", *(left(session) or ["nothing was sent"])])
    holder = session.items.get("lease_station")
    whom = f"station {holder.value:g}" if holder is not None and holder.value else "another station"
    return f"still waiting behind {whom}; it keeps its place"


def _failure(session: Session) -> str:
    """Return the rover's report of a failed request; "cancelled" if nothing worse happened."""
    lost = [r for r in session.requester.requests.values() if r.own and r.state != RequestState.COMPLETED]
    own = [r.report.text for r in lost if r.report is not None and r.report.code == Code.VERSION]
    if own:
        return own[0]
    if not lost or any(request.state != RequestState.CANCELLED for request in lost):
        return _why(lost)
    report = lost[0].report
    return "the command was cancelled" + (f": {report.text}" if report is not None and report.text else "")


def _why(lost: list[Request]) -> str:
    """Return why one request failed, with what to do next; of several requests each had its own line."""
    report = lost[0].report if len(lost) == 1 else None
    if report is None or not report.text:
        return "the rover reported a failure"
    name = lost[0].telecommand.name
    if report.code in (Code.MODE, Code.RANGE, Code.LEASE):
        return refusal_words(name, report.text)
    return f"{commands.command(name).typed} {report.state.name.lower()}: {report.text}"


def last_words(text: str) -> None:
    """Print the last line, with the cause."""
    line_beside(f"ground: {text}")


def _start(word: str) -> tuple[float, int]:
    """Return onboard time in s, or UTC in ns; the other one is 0."""
    try:
        if "T" in word:
            return 0.0, utc_ns(word)
        if (start_s := float(word)) >= 0.0:  # excludes NaN
            return start_s, 0
    except ValueError:
        pass
    raise typer.BadParameter(
        f"{word!r} should be seconds of onboard time or UTC like 2026-11-22T12:00:00Z", param_hint="--start"
    )


def _as_typed(text: str) -> str:
    """Return an error text with the arguments' names as the help shows them: degrees where the table has radians."""
    return re.sub(r"`(\w+)_rad(ps)?`", lambda found: f"`{found[1]}_deg{found[2] or ''}`", text)


def plan_of(words: list[str], contact_s: float, timeout_s: float, lifetime_s: float = 60.0, start: str = "0") -> Plan:
    """Return the plan of a single command."""
    try:
        name, arguments = commands.parse(words)
    except ValueError as error:
        raise typer.BadParameter(shorter(_as_typed(str(error)))) from None
    start_s, start_utc_ns = _start(start)
    step = ScriptStep(1, " ".join(words), "command", name, arguments, None, 0.0, start_s, start_utc_ns)
    return Plan((step,), contact_s=contact_s, limit_s=timeout_s, lifetime_s=lifetime_s, typed=True)


def carry_out(words: list[str], options: dict[str, Any]) -> None:
    """Run a verb that was made from the table."""
    plan = plan_of(words, options["contact"], options["timeout"], start=options["start"])
    code, session = ask(options["station"], plan, options["as_json"])
    sent = commands.command(plan.steps[0].name).sends
    for product in reversed(session.products.values()):
        if product.name == sent and code == 0:
            text_out(product.data.decode(errors="replace").rstrip())
            break
    leave(code, session)
