"""What a scenario promises, and whether a run kept it: Expect + Facts -> verdicts.

    ends      goal: it stands there and said so; stopped: it stands; anyhow
    touched   body or wheels met what they must not
    raises    the rows of the fault table that must be told, and no others but `may_raise`
    detects   the rows of the fault table whose time and whose steps are judged: the run is theirs
    seen      each injection changed a byte on a wire, or the plant, soon after its time: against a run without it
    died      a process that no fault of the scenario kills
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from hil.bench.contacts import Contact, line
from onboard.config import ConfigError, from_tree, value
from onboard.records import Event
from onboard.toml_text import shown
from protocol.faults import BY_NAME, Step
from protocol.modes import Mode

ENDS = ("goal", "stopped", "anyhow")
STANDS_MPS = 0.01
_MODES = ("", *Mode.__members__)
_LISTS = ("raises", "may_raise", "detects")


@dataclass(frozen=True, slots=True)
class Expect:
    """The promise of a scenario. says: words that the end of the mission must be told in."""

    ends: str = value("goal", "how the rover ends", one_of=ENDS)
    mode: str = value("", "the mode in which it ends; empty: any", one_of=_MODES)
    within_m: float = value(0.3, "of the goal, for ends = goal", low=0.01, high=10)
    says: str = value("", "words in the event that ends the mission")
    contacts: int = value(0, "most contacts with what must not be touched", low=0, high=1000)
    seen_within_s: float = value(1.0, "from an injection to its first trace", low=0.01, high=1000)
    raises: tuple[str, ...] = ()
    may_raise: tuple[str, ...] = ()
    detects: tuple[str, ...] = ()


class Seen(NamedTuple):
    """When and where an injection first showed against the run without it; channel '' and t_s -1: never."""

    fault: str
    begun_s: float
    t_s: float
    channel: str


class Answer(NamedTuple):
    """What came of one row; times of the bench, -1 where there is none. missing: steps that were not taken."""

    row: str
    since_s: float
    raised_s: float
    answered_s: float
    missing: tuple[Step, ...]

    @property
    def in_time(self) -> bool:
        """Whether every step was taken, and those that are due at once within the row's time."""
        took_s = self.answered_s - self.since_s
        return not self.missing and self.since_s >= 0.0 and 0.0 <= round(took_s, 6) <= BY_NAME[self.row].detect_s


@dataclass(frozen=True, slots=True)
class Facts:
    """What a run shows, however it was flown. seen, answers: None where no run without the faults was flown beside it.

    answers: one for each row that the scenario `detects`.
    """

    to_goal_m: float
    speed_mps: float
    events: Sequence[Event]
    contacts: Sequence[Contact]
    error: str = ""
    seen: Sequence[Seen] | None = None
    answers: Sequence[Answer] | None = None

    @property
    def mode(self) -> str:
        """In which it ended, by its own word."""
        told = [event.text for event in self.events if event.name == "MODE"]
        return told[-1].partition(" -> ")[2].partition(":")[0] if told else "STANDBY"

    @property
    def raised(self) -> tuple[str, ...]:
        """The rows of the fault table that were told, each once, in order."""
        return tuple(dict.fromkeys(row_of(event) for event in self.events if event.name == "FAULT"))

    @property
    def end(self) -> Event | None:
        """What ended the last mission."""
        return next((event for event in reversed(self.events) if event.name in ("ARRIVED", "FAILED", "MODE")), None)


class Verdict(NamedTuple):
    """One promise, whether it was kept, and what was found."""

    promise: str
    holds: bool
    found: str


def row_of(event: Event) -> str:
    """The row that a FAULT event tells of."""
    return event.text.partition(":")[0].partition(" ")[0]


def expect_of(tree: Any, where: str) -> Expect:
    """The table `[expect]`. Raises ConfigError: file, key, value, suggestion."""
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
    """Each promise in turn."""
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


def _answered(answer: Answer) -> Verdict:
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
