"""Generator of protocol/generated/can_codec.py from protocol/rover.dbc: `make codec`. A test compares the two.

The generated code uses one integer per frame, shifts and masks; physical values scale as in cantools (divide, round
half to even), so both agree bit for bit.
"""

from __future__ import annotations

import hashlib
import re
import sys
from pathlib import Path
from typing import Any

import cantools

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from protocol.can.crc import seed  # noqa: E402

PROTECTION = ("counter", "crc")
HEAD = '''"""CAN codec, generated from rover.dbc by tools/make_can_codec.py. Change the DBC and run `make codec`.

encode_NAME(values..., counter) -> 8 bytes with alive counter and checksum; ValueError names a value out of its range.
decode_NAME(data) -> a tuple of physical values; WireError("out_of_range") or ("length"). The checksum: can.guard.
Values of unit scale are integers. TABLE: can id -> Row.
"""

from enum import IntEnum
from typing import Any, Callable, NamedTuple

from protocol import WireError
from protocol.can.crc import crc8 as _crc

_new = tuple.__new__
_from_bytes = int.from_bytes
_BYTE = tuple(bytes((value,)) for value in range(256))


class Row(NamedTuple):
    """One frame of the DBC. `cycle_ns`: longest regular interval, 0 without one. `event`: sent on events only."""

    name: str
    can_id: int
    sender: str
    cycle_ns: int
    event: bool
    seed: int
    fields: tuple[str, ...]
    encode: Callable[..., bytes]
    decode: Callable[[bytes], Any]


def _refuse(frame: str, **values: tuple[float, float, float]) -> None:
    for name, (value, low, high) in values.items():
        if not low <= value <= high:
            raise ValueError(f"{frame}.{name} = {value!r} is out of range {low!r} to {high!r}")


def _length(frame: str, data: bytes) -> WireError:
    return WireError("length", f"{frame} of {len(data)} bytes")
'''


def main() -> None:
    """Read the DBC, write the module."""
    (ROOT / "protocol" / "generated" / "can_codec.py").write_text(generate(ROOT / "protocol" / "rover.dbc"))


def generate(dbc_path: Path) -> str:
    """Return the text of the module for a DBC file."""
    database: Any = cantools.database.load_file(dbc_path)
    whole = hashlib.sha256(dbc_path.read_bytes()).hexdigest()
    parts = [HEAD, f'DBC_VERSION = {int(database.version)}\nDBC_SHA256 = "{whole}"\n']
    parts += _turns(database)
    parts += [_enum(name, table) for name, table in database.dbc.value_tables.items()]
    families: dict[str, str] = {}
    rows = []
    for message in sorted(database.messages, key=lambda m: m.frame_id):
        family = family_name(message.name)
        if family not in families:
            families[family] = message.name
            parts += [_record(family, message), _decoder(family, message)]
        else:
            parts.append(f"decode_{message.name} = decode_{families[family]}\n")
        parts += [_encoder(message)]
        rows.append(_row(message))
    parts.append("TABLE: dict[int, Row] = {\n" + "".join(rows) + "}\n")
    return "\n\n\n".join(part.strip("\n") for part in parts) + "\n"


def family_name(name: str) -> str:
    """Family of a frame: WHEEL_1_COMMAND to WHEEL_4_COMMAND share one record and one decoder."""
    return re.sub(r"^(EMERGENCY_STOP|NODE_HEARTBEAT)_.*", r"\1", re.sub(r"_\d", "", name))


def _signals(message: Any) -> list[Any]:
    return sorted((s for s in message.signals if s.name not in PROTECTION), key=lambda s: s.start)


def _class_name(family: str) -> str:
    return "".join(word.capitalize() for word in family.split("_"))


def _turns(database: Any) -> list[str]:
    """Constants for signals that define the counts of one turn; one value for all signals of a name."""
    found: dict[str, int] = {}
    for message in database.messages:
        for signal in message.signals:
            counts = signal.dbc.attributes.get("CountsPerTurn") if signal.dbc else None
            if counts and found.setdefault(signal.name, counts.value) != counts.value:
                raise ValueError(f"{message.name}.{signal.name} has another CountsPerTurn than its likes")
    return [f"{name.upper()}S_PER_TURN = {counts}\n" for name, counts in sorted(found.items())]


def _enum(name: str, table: dict[int, str]) -> str:
    rows = "".join(f"    {text} = {number}\n" for number, text in sorted(table.items()))
    return f'class {_class_name(name)}(IntEnum):\n    """Value table {name}."""\n\n{rows}'


def _record(family: str, message: Any) -> str:
    rows = "".join(f"    {s.name}: {'int' if s.conversion.scale == 1 else 'float'}\n" for s in _signals(message))
    return f'class {_class_name(family)}Frame(NamedTuple):\n    """{message.comment}"""\n\n{rows}'


def _encoder(message: Any) -> str:
    signals = _signals(message)
    names = ", ".join(s.name for s in signals)
    limits = " and ".join(f"{s.minimum!r} <= {s.name} <= {s.maximum!r}" for s in signals)
    refused = ", ".join(f"{s.name}=({s.name}, {s.minimum!r}, {s.maximum!r})" for s in signals)
    terms = []
    for s in signals:
        raw = s.name if s.conversion.scale == 1 else f"round({s.name} / {s.conversion.scale!r})"
        if s.is_signed:
            raw = f"({raw} & {(1 << s.length) - 1:#x})"
        terms.append(f"{raw} << {s.start}" if s.start else raw)
    return f'''def encode_{message.name}({names}, counter):
    if not ({limits} and 0 <= counter <= 15):
        _refuse("{message.name}", {refused}, counter=(counter, 0, 15))
    x = {" | ".join(terms)} | counter << 52
    body = x.to_bytes(7, "little")
    return body + _BYTE[_crc(body, {seed(message.frame_id):#x})]
'''


def _decoder(family: str, message: Any) -> str:
    lines, fields = [], []
    for s in _signals(message):
        mask, sign, scale = (1 << s.length) - 1, 1 << (s.length - 1), s.conversion.scale
        raw = f"x >> {s.start} & {mask:#x}" if s.start else f"x & {mask:#x}"
        if s.is_signed:
            raw = f"(({raw}) ^ {sign:#x}) - {sign:#x}"
        allowed = (round(s.minimum / scale), round(s.maximum / scale))
        value = f"({raw})" if scale == 1 else f"({raw}) * {scale!r}"
        if allowed != ((-sign, sign - 1) if s.is_signed else (0, mask)):
            lines.append(
                f"    {s.name} = {raw}\n    if not {allowed[0]} <= {s.name} <= {allowed[1]}:\n"
                f'        raise WireError("out_of_range", f"{family}.{s.name} raw {{{s.name}}}")\n'
            )
            value = s.name if scale == 1 else f"{s.name} * {scale!r}"
        fields.append(value)
    return f'''def decode_{message.name}(data):
    if len(data) != 8:
        raise _length("{family}", data)
    x = _from_bytes(data, "little")
{"".join(lines)}    return _new({_class_name(family)}Frame, ({", ".join(fields)},))
'''


def _row(message: Any) -> str:
    send_type = message.dbc.attributes.get("GenMsgSendType")
    event = send_type is not None and send_type.value == 1
    fields = tuple(s.name for s in _signals(message))
    name = message.name
    return (
        f'    {message.frame_id:#05x}: Row("{name}", {message.frame_id:#05x}, "{message.senders[0]}", '
        f"{(message.cycle_time or 0) * 1_000_000}, {event}, {seed(message.frame_id):#04x}, "
        f"{fields}, encode_{name}, decode_{name}),\n"
    )


if __name__ == "__main__":
    main()
