"""TABLE of commands: what the ground may ask, with units, ranges and the modes that allow it; and their wire form.

A telecommand's payload: request id u32, issued i64 ns, expiry i64 ns (both onboard time; expiry 0: none), command id
u8, then one f64 for each argument of the row in its order: a number, the index of a choice, or NaN for what was left
out.
"""

from __future__ import annotations

import difflib
import math
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from protocol import WireError
from protocol.modes import Mode

Arguments = Mapping[str, float | str]
_HEAD = struct.Struct("<IqqB")


class Argument(NamedTuple):
    """One argument: a number from low to high in `unit`, or one of `choices`."""

    name: str
    unit: str
    low: float
    high: float
    meaning: str
    required: bool = True
    choices: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Command:
    """One row. `modes`: where it is allowed. The id is on the wire and never reused."""

    id: int
    name: str
    arguments: tuple[Argument, ...]
    modes: tuple[Mode, ...]
    meaning: str


_ALL = tuple(Mode)
TABLE = (
    Command(1, "goto", (
        Argument("x_m", "m", -10_000.0, 10_000.0, "east in the map frame"),
        Argument("y_m", "m", -10_000.0, 10_000.0, "north in the map frame"),
        Argument("heading_rad", "rad", -math.pi, math.pi, "final yaw; left out: any", required=False),
    ), (Mode.STANDBY, Mode.AUTONOMOUS), "drive to a place by itself"),
    Command(2, "stop", (), _ALL, "end all motion; AUTONOMOUS becomes STANDBY"),
    Command(3, "safe", (), _ALL, "go to SAFE"),
    Command(4, "resume", (), (Mode.SAFE,), "leave SAFE for STANDBY"),
    Command(5, "status", (), _ALL, "report mode, phase and pose"),
    Command(6, "get", (
        Argument("product", "", 0, 0, "what to send down", choices=("ldem",)),
    ), _ALL, "send a product down"),
    Command(7, "emergency_stop", (), _ALL, "wheels off at once, latched"),
    Command(8, "reset", (), (Mode.ESTOP,), "release the latch of the emergency stop"),
)
_BY_NAME = {row.name: row for row in TABLE}
_BY_ID = {row.id: row for row in TABLE}


def command(name: str) -> Command:
    """The row of a name. Raises ValueError with what exists and what was probably meant."""
    if name in _BY_NAME:
        return _BY_NAME[name]
    near = difflib.get_close_matches(name, _BY_NAME, n=1)
    hint = f"did you mean `{near[0]}`?" if near else f"known: {', '.join(_BY_NAME)}"
    raise ValueError(f"unknown command `{name}`; {hint}")


def check(name: str, arguments: Arguments) -> dict[str, float | str]:
    """The arguments in the row's order, numbers as float, what was left out left out.

    Raises ValueError that names the argument, what was given and what is allowed.
    """
    row = command(name)
    unknown = [key for key in arguments if key not in {a.name for a in row.arguments}]
    if unknown:
        names = ", ".join(a.name for a in row.arguments) or "none"
        raise ValueError(f"{name}: unknown argument `{unknown[0]}`; takes {names}")
    checked: dict[str, float | str] = {}
    for argument in row.arguments:
        given = arguments.get(argument.name)
        if given is None:
            if argument.required:
                raise ValueError(f"{name}: `{argument.name}` is missing ({_allowed(argument)})")
            continue
        checked[argument.name] = _checked(name, argument, given)
    return checked


def parse(words: Sequence[str]) -> tuple[str, dict[str, float | str]]:
    """`goto 12 3 90` by the command's row: numbers in their order, angles in degrees. Raises ValueError."""
    name, given = words[0], words[1:]
    row = command(name)
    if len(given) > len(row.arguments):
        takes = " ".join(argument.name for argument in row.arguments) or "nothing"
        raise ValueError(f"{name} takes {takes}, found {' '.join(given)}")
    arguments: dict[str, float | str] = {}
    for argument, text in zip(row.arguments, given):
        if argument.choices:
            arguments[argument.name] = text
            continue
        try:
            number = float(text)
        except ValueError:
            raise ValueError(f"{name}: `{argument.name}` should be a number, found `{text}`") from None
        arguments[argument.name] = math.radians(number) if argument.unit == "rad" else number
    return name, check(name, arguments)


def _allowed(argument: Argument) -> str:
    if argument.choices:
        return "one of " + ", ".join(argument.choices)
    return f"{argument.low:g} to {argument.high:g} {argument.unit}".rstrip()


def _checked(name: str, argument: Argument, given: object) -> float | str:
    problem = f"{name}: `{argument.name}` = {given!r} should be {_allowed(argument)}"
    if argument.choices:
        if given not in argument.choices:
            raise ValueError(problem)
        return str(given)
    if isinstance(given, bool) or not isinstance(given, (int, float)):
        raise ValueError(problem)
    if not argument.low <= given <= argument.high:
        raise ValueError(problem)
    return float(given)


def allowed_in(mode: Mode) -> tuple[str, ...]:
    """Names of the commands that a mode allows."""
    return tuple(row.name for row in TABLE if mode in row.modes)


def check_mode(name: str, mode: Mode) -> None:
    """Raises ValueError with what would be allowed where `mode` does not allow the command."""
    if mode not in command(name).modes:
        raise ValueError(f"{name} is refused in {mode.name}; allowed: {', '.join(allowed_in(mode))}")


class Telecommand(NamedTuple):
    """One request as it crosses the link. Times are onboard time; expiry_ns 0: never."""

    request_id: int
    issued_ns: int
    expiry_ns: int
    name: str
    arguments: dict[str, float | str]


def encode(telecommand: Telecommand) -> bytes:
    """The payload. Raises ValueError where `check` would."""
    row, values = command(telecommand.name), []
    arguments = check(telecommand.name, telecommand.arguments)
    for argument in row.arguments:
        given = arguments.get(argument.name, math.nan)
        values.append(float(argument.choices.index(given)) if isinstance(given, str) else given)
    head = _HEAD.pack(telecommand.request_id, telecommand.issued_ns, telecommand.expiry_ns, row.id)
    return head + struct.pack(f"<{len(values)}d", *values)


def request_id_of(payload: bytes) -> int | None:
    """The request id, readable even where the rest is not; None where the payload is too short."""
    return int.from_bytes(payload[:4], "little") if len(payload) >= 4 else None


def decode(payload: bytes) -> Telecommand:
    """The request; ranges are not checked here. Raises WireError("telecommand") on an unknown id or a wrong length."""
    if len(payload) < _HEAD.size:
        raise WireError("telecommand", f"{len(payload)} B")
    request_id, issued_ns, expiry_ns, command_id = _HEAD.unpack_from(payload)
    row = _BY_ID.get(command_id)
    if row is None:
        raise WireError("telecommand", f"unknown command id {command_id}")
    if len(payload) != _HEAD.size + 8 * len(row.arguments):
        raise WireError("telecommand", f"{row.name} with {len(payload)} B")
    values = struct.unpack_from(f"<{len(row.arguments)}d", payload, _HEAD.size)
    arguments: dict[str, float | str] = {}
    for argument, value in zip(row.arguments, values):
        if argument.choices:
            if value not in range(len(argument.choices)):
                raise WireError("telecommand", f"{row.name}: `{argument.name}` has no choice {value:g}")
            arguments[argument.name] = argument.choices[int(value)]
        elif not math.isnan(value):
            arguments[argument.name] = value
    return Telecommand(request_id, issued_ns, expiry_ns, row.name, arguments)
