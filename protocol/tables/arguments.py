"""Command arguments: kinds, range check, parsing of typed words, and wire encoding.

    number   f64, NaN where it was left out             choice   f64, the index in `choices`
    text     length u8 and UTF-8, 0 B where left out    points   count u8, then x and y of each in whole mm, i32

Texts and points have a maximum length (`most`), so that the longest telecommand fits a datagram of the slowest link.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Collection, Sequence
from enum import Enum
from typing import NamedTuple

from protocol import WireError

Value = float | str | tuple[float, ...]
_MM = 1000.0


class ArgumentKind(Enum):
    """Encoding of an argument on the wire."""

    NUMBER = "number"
    CHOICE = "choice"
    TEXT = "text"
    POINTS = "points"


class Argument(NamedTuple):
    """Specification of one argument.

    name: name of the argument.
    unit: SI unit of a number or of a point's coordinates.
    low, high: allowed range of a number, or of each coordinate of a point.
    meaning: text for help and docs.
    required: False if the argument may be left out.
    choices: allowed words of a choice.
    text: True for a text.
    most: maximum number of bytes of a text, or of points.
    least: minimum number of points.
    known: allowed texts; empty: any text.

    Points are one flat tuple x, y, x, y ... in `unit`, rounded to 1 mm.
    """

    name: str
    unit: str
    low: float
    high: float
    meaning: str
    required: bool = True
    choices: tuple[str, ...] = ()
    text: bool = False
    most: int = 0
    least: int = 1
    known: Collection[str] = ()

    @property
    def kind(self) -> ArgumentKind:
        """Encoding, derived from `choices`, `text` and `most`."""
        if self.choices:
            return ArgumentKind.CHOICE
        return ArgumentKind.TEXT if self.text else ArgumentKind.POINTS if self.most else ArgumentKind.NUMBER

    @property
    def is_angle(self) -> bool:
        """True if people type and read the value in degrees."""
        return self.unit.startswith("rad")

    @property
    def takes_rest(self) -> bool:
        """True if the argument takes all remaining words of the line."""
        return self.kind in (ArgumentKind.TEXT, ArgumentKind.POINTS)

    @property
    def allowed(self) -> str:
        """Allowed values as text for people; angles in degrees."""
        low, high, unit = self.low, self.high, self.unit
        if self.is_angle:
            low, high, unit = math.degrees(low), math.degrees(high), unit.replace("rad", "degrees")
        span = f"{low:g} to {high:g} {unit}".rstrip()
        return {
            ArgumentKind.NUMBER: span,
            ArgumentKind.CHOICE: "one of " + ", ".join(self.choices),
            ArgumentKind.TEXT: f"a text of at most {self.most} bytes",
            ArgumentKind.POINTS: f"{self.least} to {self.most} pairs, {span}",
        }[self.kind]


def check(argument: Argument, given: object) -> Value:
    """Return the checked value to encode. Raises ValueError with the given value and the allowed values."""
    value = _CHECKS[argument.kind](argument, given)
    if value is None:
        raise ValueError(f"`{argument.name}` = {_told(argument, given)} should be {argument.allowed}")
    return value


def _told(argument: Argument, given: object) -> str:
    """Return the given value as text for the error message; angles in degrees."""
    if argument.is_angle and isinstance(given, (int, float)):
        return f"{math.degrees(given):g} degrees"
    if argument.kind is ArgumentKind.POINTS and isinstance(given, (tuple, list)) and len(given) % 2:
        return f"{' '.join(f'{v:g}' for v in given)}, of which {given[-1]:g} is alone,"
    return repr(given)


def from_words(argument: Argument, words: Sequence[str]) -> Value:
    """Parse typed words: numbers in the argument's unit, angles in degrees. Raises ValueError."""
    if argument.kind in (ArgumentKind.CHOICE, ArgumentKind.TEXT):
        return " ".join(words)
    try:
        numbers = tuple(math.radians(float(w)) if argument.is_angle else float(w) for w in words)
    except ValueError:
        raise ValueError(f"`{argument.name}` should be a number, found `{' '.join(words)}`") from None
    return numbers if argument.kind is ArgumentKind.POINTS else numbers[0]


def pack(argument: Argument, value: Value | None) -> bytes:
    """Encode a checked value; None encodes an argument that was left out."""
    if argument.kind is ArgumentKind.TEXT:
        data = str(value or "").encode()
        return bytes([len(data)]) + data
    if argument.kind is ArgumentKind.POINTS:
        flat = value if isinstance(value, tuple) else ()
        return struct.pack(f"<B{len(flat)}i", len(flat) // 2, *(round(v * _MM) for v in flat))
    if argument.kind is ArgumentKind.CHOICE:
        return struct.pack("<d", math.nan if value is None else argument.choices.index(str(value)))
    return struct.pack("<d", math.nan if value is None else value)


def unpack(argument: Argument, raw: bytes, at: int) -> tuple[Value | None, int]:
    """Decode one argument at offset `at`: its value (None if left out) and the offset of the next argument.

    Ranges are not checked here. Raises WireError("telecommand") on bytes that `pack` cannot have written.
    """
    try:
        if argument.kind is ArgumentKind.TEXT:
            return _text(raw, at)
        if argument.kind is ArgumentKind.POINTS:
            count, start = raw[at], at + 1
            flat = struct.unpack_from(f"<{2 * count}i", raw, start)
            return tuple(v / _MM for v in flat) or None, start + 8 * count
        (number,) = struct.unpack_from("<d", raw, at)
    except (struct.error, IndexError, UnicodeDecodeError) as error:
        raise WireError("telecommand", f"`{argument.name}`: {error}") from error
    if math.isnan(number):
        return None, at + 8
    if argument.kind is ArgumentKind.NUMBER:
        return float(number), at + 8
    if number not in range(len(argument.choices)):
        raise WireError("telecommand", f"`{argument.name}` has no choice {number:g}")
    return argument.choices[int(number)], at + 8


def _text(raw: bytes, at: int) -> tuple[str | None, int]:
    end = at + 1 + raw[at]
    if end > len(raw):
        raise WireError("telecommand", f"a text of {raw[at]} B is cut off")
    return raw[at + 1 : end].decode() or None, end


def _number(argument: Argument, given: object) -> Value | None:
    if isinstance(given, bool) or not isinstance(given, (int, float)) or not argument.low <= given <= argument.high:
        return None
    return float(given)


def _choice(argument: Argument, given: object) -> Value | None:
    return str(given) if given in argument.choices else None


def _words(argument: Argument, given: object) -> Value | None:
    fits = isinstance(given, str) and 0 < len(given.encode(errors="replace")) <= argument.most
    return given if fits and isinstance(given, str) and given.isprintable() else None


def _points(argument: Argument, given: object) -> Value | None:
    if not isinstance(given, (tuple, list)) or len(given) % 2 or not argument.least <= len(given) // 2 <= argument.most:
        return None
    inside = [v for v in given if _number(argument, v) is not None]
    return tuple(round(float(v) * _MM) / _MM for v in inside) if len(inside) == len(given) else None


_CHECKS: dict[ArgumentKind, Callable[[Argument, object], Value | None]] = {
    ArgumentKind.NUMBER: _number, ArgumentKind.CHOICE: _choice, ArgumentKind.TEXT: _words, ArgumentKind.POINTS: _points,
}  # fmt: skip
