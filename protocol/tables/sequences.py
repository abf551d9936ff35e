"""Grammar of one step of a sequence: a text line that people write and both ends of the link parse.

    [after S] [until ITEM OP VALUE within S] [or stop|continue|safe] [COMMAND ARGUMENTS...]

    goto 3 1                                    after 5 or continue scan
    until voltage_v > 24 within 600 goto 3 1    after 10

after: delay in seconds from the completion of the step before.
until: comparison of a telemetry item of `protocol.tables.telemetry` with a value; if it is not met in time, the step
fails.
or: reaction to a failure (stop: the sequence ends). Angles are in degrees.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple

from protocol.tables import commands
from protocol.tables.modes import Mode
from protocol.tables.telemetry import BY_NAME

OPERATORS: Mapping[str, Callable[[float, float], bool]] = MappingProxyType(
    {
        "<": operator.lt,
        "<=": operator.le,
        "=": operator.eq,
        ">=": operator.ge,
        ">": operator.gt,
    }
)
POLICIES = ("stop", "continue", "safe")
NEVER = ("stop", "safe", "emergency_stop", "reboot")  # they end a sequence
_OPERATORS_OWN = ("sequence", "lease", "key")
MOST_STEPS, LONGEST_S = 32, 86_400.0


class Condition(NamedTuple):
    """Condition of a step.

    item: name of a telemetry item.
    compare: a key of OPERATORS.
    value: value to compare with.
    within_s: maximum waiting time, s.
    """

    item: str
    compare: str
    value: float
    within_s: float

    def holds(self, now: float) -> bool:
        """True if the condition is met; an unknown item (NaN) meets no condition."""
        return OPERATORS[self.compare](now, self.value)


class SequenceStep(NamedTuple):
    """One step of a sequence.

    line: the text.
    after_s: delay, s.
    condition: condition to wait for, or None.
    policy: reaction to a failure, one of POLICIES.
    name: name of the command; '' for a step that only waits.
    arguments: arguments of the command.
    """

    line: str
    after_s: float
    condition: Condition | None
    policy: str
    name: str
    arguments: dict[str, commands.Value]


def parse(line: str) -> SequenceStep:
    """Parse a step. Raises ValueError with what was found and what is allowed."""
    words = line.split()
    after_s, condition, policy = 0.0, None, "stop"
    if words[:1] == ["after"]:
        after_s, words = _seconds("after", words[1:2]), words[2:]
    if words[:1] == ["until"]:
        condition, words = _condition(words[1:6]), words[6:]
    if words[:1] == ["or"]:
        policy = commands.named(" ".join(words[1:2]), POLICIES, "policy")
        words = words[2:]
    if not words:
        if not after_s and condition is None:
            raise ValueError("an empty step: write a command, `after SECONDS` or `until ITEM > VALUE within SECONDS`")
        return SequenceStep(line, after_s, condition, policy, "", {})
    name, arguments = commands.parse(words)
    if name in NEVER or name.startswith(_OPERATORS_OWN):
        raise ValueError(f"{commands.command(name).typed} is not for a sequence")
    commands.check_mode(name, Mode.STANDBY)
    return SequenceStep(line, after_s, condition, policy, name, arguments)


def _condition(words: list[str]) -> Condition:
    if len(words) != 5 or words[3] != "within" or words[1] not in OPERATORS:
        known = " or ".join(OPERATORS)
        raise ValueError(f"`until {' '.join(words)}` should be `until ITEM {known} VALUE within SECONDS`")
    try:
        value = float(words[2])
    except ValueError:
        raise ValueError(f"until: `{words[2]}` should be a number") from None
    return Condition(commands.named(words[0], BY_NAME, "item"), words[1], value, _seconds("within", words[4:]))


def _seconds(what: str, words: list[str]) -> float:
    try:
        seconds = float(words[0])
    except (IndexError, ValueError):
        seconds = -1.0
    if not 0.0 <= seconds <= LONGEST_S:
        raise ValueError(f"`{what} {' '.join(words)}` should be 0 to {LONGEST_S:g} seconds")
    return seconds
