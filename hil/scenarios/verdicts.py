"""Promises of a scenario and the judgement of a run: Expect + Facts -> verdicts.

ends      goal: the rover stands at the goal and reported its arrival; stopped: it stands; anyhow
touched   body or wheels were in contact with an obstacle
raises    rows of the fault table that must be reported, and no others but `may_raise`
detects   rows of the fault table whose time and steps are judged: this run tests them
seen      each injection changed a byte on a wire, or the plant, soon after its time: against a run without it
died      a process ended that no fault of the scenario kills
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from hil.world.contacts import Contact, line
from onboard.config import ConfigError, from_tree, value
from onboard.records import Event
from onboard.toml_text import shown
from protocol.tables.faults import BY_NAME, ResponseStep
from protocol.tables.modes import Mode

ENDS = ("goal", "stopped", "anyhow")
STANDS_MPS = 0.01
_MODES = ("", *Mode.__members__)
_LISTS = ("raises", "may_raise", "detects")


@dataclass(frozen=True, slots=True)
class Expect:
    """Promises of a scenario.

    raises: rows of the fault table that must be reported
    may_raise: rows that may be reported too
    detects: rows whose time and steps are judged
    """

    ends: str = value("goal", "how the rover ends", one_of=ENDS)
    mode: str = value("", "the mode in which it ends; empty: any", one_of=_MODES)
    within_m: float = value(0.3, "of the goal, for ends = goal", low=0.01, high=10)
    says: str = value("", "words in the event that ends the mission")
    contacts: int = value(0, "most contacts with what must not be touched", low=0, high=1000)
    seen_within_s: float = value(1.0, "from an injection to its first trace", low=0.01, high=1000)
    raises: tuple[str, ...] = ()
    may_raise: tuple[str, ...] = ()
    detects: tuple[str, ...] = ()


class FirstDifference(NamedTuple):
    """First difference that an injection made against the run without it.

    fault: name of the injection
    begun_s: start of the injection, -1 if it did not start
    t_s: time of the first difference, -1 if there is none
    channel: channel of the first difference, '' if there is none
    """

    fault: str
    begun_s: float
    t_s: float
    channel: str


class FaultResponse(NamedTuple):
    """Response to one row; bench times, -1 if there is none.

    row: row of the fault table
    since_s: first bad sample
    raised_s: row became active
    answered_s: all immediate steps were taken
    missing: steps that were not taken
    """

    row: str
    since_s: float
    raised_s: float
    answered_s: float
    missing: tuple[ResponseStep, ...]

    @property
    def in_time(self) -> bool:
        """True if every step was taken and the immediate ones within the row's time."""
        took_s = self.answered_s - self.since_s
        return not self.missing and self.since_s >= 0.0 and 0.0 <= round(took_s, 6) <= BY_NAME[self.row].detect_s


@dataclass(frozen=True, slots=True)
class Facts:
    """Facts of a run, in one process or over sockets.

    to_goal_m: distance to the goal at the end
    speed_mps: speed at the end
    events: all events
    contacts: all contacts
    error: '' or why the run failed
    seen: one for each injection; None if no run without the faults was made
    answers: one for each row that the scenario `detects`; None as for `seen`
    """

    to_goal_m: float
    speed_mps: float
    events: Sequence[Event]
    contacts: Sequence[Contact]
    error: str = ""
    seen: Sequence[FirstDifference] | None = None
    answers: Sequence[FaultResponse] | None = None

    @property
    def mode(self) -> str:
        """Mode at the end, from the rover's own events."""
        told = [event.text for event in self.events if event.name == "MODE"]
        return told[-1].partition(" -> ")[2].partition(":")[0] if told else "STANDBY"

    @property
    def raised(self) -> tuple[str, ...]:
        """Rows of the fault table that were reported, each once, in order."""
        return tuple(dict.fromkeys(row_of(event) for event in self.events if event.name == "FAULT"))

    @property
    def end(self) -> Event | None:
        """Event that ended the last mission; None if there is none."""
        return next((event for event in reversed(self.events) if event.name in ("ARRIVED", "FAILED", "MODE")), None)


class Verdict(NamedTuple):
    """Judgement of one promise.

    promise: text
    holds: True if it was kept
    found: the observed fact, for people
    """

    promise: str
    holds: bool
    found: str


def row_of(event: Event) -> str:
    """Row of the fault table that a FAULT event names."""
    return event.text.partition(":")[0].partition(" ")[0]


def expect_of(tree: Any, where: str) -> Expect:
    """Read the table `[expect]`. Raises ConfigError: file, key, value, suggestion."""
    if not isinstance(tree, Mapping):
        raise ConfigError(f"{where}: `expect` should be a table, found {shown(tree)}")
    lists = {key: _rows(tree.get(key, []), f"{where}: `expect.{key}`") for key in _LISTS}
    plain = from_tree(Expect, {key: item for key, item in tree.items() if key not in _LISTS}, where, "expect.")
    return replace(plain, **lists)


def _rows(names: Any, what: str) -> tuple[str, ...]:
    if not isinstance(names, list):
        raise ConfigError(f"{what} should be a list of rows of the fault table, found {shown(names)}")
    for name in names:
        if name not in BY_NAME:
            near = difflib.get_close_matches(str(name), BY_NAME, n=1)
            hint = f"; did you mean {near[0]}?" if near else f"; known: {', '.join(BY_NAME)}"
            raise ConfigError(f"{what}: {shown(name)} is no row of the fault table{hint}")
    return tuple(names)


def judge(expect: Expect, facts: Facts) -> tuple[Verdict, ...]:
    """Judge each promise in turn."""
    verdicts = [Verdict("no process dies unasked", not facts.error, facts.error or "none did"), _ends(expect, facts)]
    touched = f"{len(facts.contacts)} times" + (f", first {line(facts.contacts[0])}" if facts.contacts else "")
    gentle = len(facts.contacts) <= expect.contacts
    verdicts.append(Verdict(f"touches {expect.contacts} times at most", gentle, touched))
    verdicts += [Verdict(f"raises {name}", name in facts.raised, _list(facts.raised)) for name in expect.raises]
    more = [name for name in facts.raised if name not in (*expect.raises, *expect.may_raise)]
    verdicts.append(Verdict("raises nothing else", not more, _list(more)))
    if expect.says:
        said = facts.end.text if facts.end else ""
        verdicts.append(Verdict(f"says {expect.says!r}", expect.says in said, said or "nothing"))
    if expect.mode:
        verdicts.append(Verdict(f"ends in mode {expect.mode}", facts.mode == expect.mode, facts.mode))
    verdicts += [_answered(answer) for answer in facts.answers or ()]
    for seen in facts.seen or ():
        late_s = seen.t_s - seen.begun_s
        found = f"{late_s:.2f} s after it, {seen.channel}" if seen.channel else "never"
        holds = bool(seen.channel) and 0.0 <= late_s <= expect.seen_within_s
        verdicts.append(Verdict(f"{seen.fault} shows within {expect.seen_within_s:g} s", holds, found))
    return tuple(verdicts)


def _ends(expect: Expect, facts: Facts) -> Verdict:
    stands, told = facts.speed_mps < STANDS_MPS, facts.end.name if facts.end else "no end"
    found = f"{facts.to_goal_m:.2f} m from it, {facts.speed_mps:.3f} m/s, {told}"
    if expect.ends == "goal":
        arrived = any(event.name == "ARRIVED" for event in facts.events)
        return Verdict("ends at the goal", stands and arrived and facts.to_goal_m <= expect.within_m, found)
    return Verdict(f"ends {expect.ends}", stands or expect.ends == "anyhow", found)


def _answered(answer: FaultResponse) -> Verdict:
    row = BY_NAME[answer.row]
    steps = ", ".join(step.name for step in row.response)
    if answer.since_s < 0.0:
        found = "there was nothing to find"
    elif answer.raised_s < 0.0:
        found = f"not found in what began at {answer.since_s:.2f} s"
    else:
        found = f"{answer.answered_s - answer.since_s:.2f} s after the first bad sample at {answer.since_s:.2f} s"
        found += f"; not taken: {', '.join(step.name for step in answer.missing)}" if answer.missing else ""
    return Verdict(f"answers {answer.row} within {row.detect_s:g} s by {steps}", answer.in_time, found)


def _list(names: Sequence[str]) -> str:
    return ", ".join(names) or "nothing"
