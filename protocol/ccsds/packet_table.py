"""TABLE of the packets for CCSDS systems, generated from the telemetry and command dictionaries.

    telemetry    secondary header, then the fields of a row, big-endian, without gaps
    telecommand  command id u8, start_s f64 (onboard time; 0: at once), then the command's arguments

All fields have a fixed size. A text ends with a zero byte and is padded with zeros; points are typed as a text of
numbers; a number that is left out is NaN, a choice 255. `protocol.ccsds.xtce` describes these packets in
machine-readable form.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from typing import NamedTuple

from protocol import WireError
from protocol.link.transactions import Code, RequestState
from protocol.tables.arguments import Argument, ArgumentKind, Value
from protocol.tables.commands import TABLE as COMMANDS
from protocol.tables.commands import Command
from protocol.tables.modes import SEVERITIES, Mode, Phase
from protocol.tables.telemetry import BY_NAME, FRAMES, Item

EVENT_APID, REPORT_APID, COMMAND_APID = 180, 181, 200
NOT_SENT = 255  # state of a report on a packet that was not a command, or a command that cannot be issued
NO_PACKET = 0xFFFF  # sequence count in a report on a request that did not arrive as a packet
LEFT_OUT = 255
NUMBERS = 8  # of a report
_FIRST_APID, _ITEMS_APID = 100, 140
_EVENT_BYTES, _NAME_BYTES, _REPORT_BYTES = 112, 24, 110
_POINT_CHARACTERS = 20
_FORMATS = {"u8": "B", "u16": "H", "u32": "I", "u64": "Q", "f64": "d"}
Values = Mapping[str, float | str]


class Field(NamedTuple):
    """One value in a packet.

    name: name of the field.
    form: a key of `_FORMATS`, or "text".
    meaning: text for people.
    unit: SI unit.
    size: bytes of a text, including its zero byte.
    names: name of each number, for an enumerated field.
    limits: (low, high); a value outside is marked.
    required: False for an argument that may be left out.
    """

    name: str
    form: str
    meaning: str
    unit: str = ""
    size: int = 0
    names: Mapping[int, str] | None = None
    limits: tuple[float, float] | None = None
    required: bool = True

    @property
    def layout(self) -> str:
        """Format of the field for `struct`."""
        return f"{self.size}s" if self.form == "text" else _FORMATS[self.form]

    @property
    def bits(self) -> int:
        """Size of the field in bits."""
        return 8 * struct.calcsize(">" + self.layout)


class TelemetryPacket(NamedTuple):
    """One telemetry packet, by APID."""

    apid: int
    name: str
    meaning: str
    fields: tuple[Field, ...]


_NAMED = {"mode": {int(m): m.name for m in Mode}, "phase": {int(p): p.name for p in Phase}}


def _of_item(item: Item) -> Field:
    if item.name in _NAMED:
        return Field(item.name, "u8", item.meaning, names=_NAMED[item.name])
    form = "u64" if item.name == "faults" else "f64"
    return Field(item.name, form, item.meaning, item.unit, limits=item.limits)


def _telemetry() -> tuple[TelemetryPacket, ...]:
    own = [(name, items) for name, items in FRAMES if name]
    others = [(f"ITEMS_{n}", items) for n, (_, items) in enumerate((f for f in FRAMES if not f[0]), start=1)]
    return tuple(
        TelemetryPacket(first + n, name, f"telemetry items of {name}", tuple(_of_item(item) for item in items))
        for first, rows in ((_FIRST_APID, own), (_ITEMS_APID, others))
        for n, (name, items) in enumerate(rows)
    )


_EVENT = TelemetryPacket(EVENT_APID, "EVENT", "something worth telling a person, once", (
    Field("event_serial", "u32", "rises by one from event to event, from 1 at each boot"),
    Field("event_severity", "u8", "how bad it is", names=dict(enumerate(SEVERITIES))),
    Field("event_name", "text", "row of protocol.tables.modes.EVENTS", size=_NAME_BYTES + 1),
    Field("event_text", "text", "in words", size=_EVENT_BYTES + 1),
))  # fmt: skip
_REPORT = TelemetryPacket(REPORT_APID, "REPORT", "what became of a command", (
    Field("report_request", "u32", "request id; 0: nothing was asked of the rover"),
    Field("report_packet", "u16", "sequence count of the telecommand packet; 65535: it did not come as one"),
    Field("report_command", "u8", "which command", names={0: "none"} | {row.id: row.name for row in COMMANDS}),
    Field("report_state", "u8", "where it is", names={int(s): s.name for s in RequestState} | {NOT_SENT: "NOT_SENT"}),
    Field("report_code", "u8", "why it failed without having been tried", names={int(c): c.name for c in Code}),
    Field("report_serial", "u8", "rises with each report of a request"),
    Field("report_text", "text", "in words", size=_REPORT_BYTES + 1),
    Field("report_numbers", "u8", "how many of the numbers mean something"),
    *(Field(f"report_number_{n}", "f64", "what the command's meaning says") for n in range(NUMBERS)),
))  # fmt: skip
TABLE = (*_telemetry(), _EVENT, _REPORT)
BY_APID = {row.apid: row for row in TABLE}
OF_ITEM = {field.name: row for row in TABLE for field in row.fields if field.name in BY_NAME}


def encode(row: TelemetryPacket, values: Values) -> bytes:
    """Encode the fields. Raises KeyError if a value is missing; a text is cut at a whole character."""
    return struct.pack(">" + "".join(f.layout for f in row.fields), *(_packed(f, values[f.name]) for f in row.fields))


def _packed(field: Field, value: float | str) -> float | int | bytes:
    if field.form == "text":
        raw = str(value).replace("\0", " ").encode()[: field.size - 1]
        return raw.decode(errors="ignore").encode()
    if field.form == "f64":
        return float(value)
    whole = int(value) if math.isfinite(float(value)) else 0
    return min(max(whole, 0), (1 << field.bits) - 1)


# -- telecommands ----------------------------------------------------------------------------------------------

COMMAND_HEAD = (
    Field("command", "u8", "id of the command"),
    Field("start_s", "f64", "onboard time before which it is not begun; 0: at once", "s"),
)


def field_of(argument: Argument) -> Field:
    """Return the packet field of an argument."""
    name, meaning = argument.name, argument.meaning
    match argument.kind:
        case ArgumentKind.NUMBER:
            return Field(
                name, "f64", meaning, argument.unit, limits=(argument.low, argument.high), required=argument.required
            )
        case ArgumentKind.CHOICE:
            return Field(
                name,
                "u8",
                meaning,
                names=dict(enumerate(argument.choices)) | ({} if argument.required else {LEFT_OUT: "left_out"}),
            )
        case ArgumentKind.TEXT:
            return Field(name, "text", meaning, size=argument.most + 1)
    told = f"{meaning}: numbers x y x y ... in {argument.unit}, {argument.least} to {argument.most} points"
    return Field(name, "text", told, size=_POINT_CHARACTERS * argument.most + 1)


def left_out(argument: Argument) -> str:
    """Text of an argument that is left out."""
    return {ArgumentKind.NUMBER: "NaN", ArgumentKind.CHOICE: "left_out"}.get(argument.kind, "")


def fields_of(row: Command) -> tuple[Field, ...]:
    """Fields that follow the primary header of a telecommand packet."""
    return (*COMMAND_HEAD, *(field_of(argument) for argument in row.arguments))


class CommandPacket(NamedTuple):
    """Content of a telecommand packet; ranges are not checked here.

    name: name of the command.
    arguments: values by name, without those left out.
    start_s: onboard start time, s; 0: at once.
    """

    name: str
    arguments: dict[str, Value]
    start_s: float


_BY_ID = {row.id: row for row in COMMANDS}


def decode_command(data: bytes) -> CommandPacket:
    """Decode a telecommand packet. Raises WireError("packet") on an unknown id, a wrong length or an invalid value."""
    row = _BY_ID.get(data[0]) if data else None
    if row is None:
        raise WireError("packet", f"no command has the id {data[0]}" if data else "no command in it")
    layout = struct.Struct(">" + "".join(field.layout for field in fields_of(row)))
    if len(data) != layout.size:
        raise WireError("packet", f"{row.name} takes {layout.size} B of data, found {len(data)}")
    _, start_s, *raw = layout.unpack(data)
    if not 0 <= start_s < math.inf:
        raise WireError("packet", f"{row.name}: start_s = {start_s:g} should be a time of 0 s or later")
    try:
        read = {a.name: _value(a, value) for a, value in zip(row.arguments, raw)}
    except ValueError as error:
        raise WireError("packet", f"{row.name}: {error}") from error
    return CommandPacket(row.name, {name: value for name, value in read.items() if value is not None}, start_s)


def _value(argument: Argument, raw: float | int | bytes) -> Value | None:
    if isinstance(raw, bytes):
        text = raw.partition(b"\0")[0].decode()
        if argument.kind is ArgumentKind.TEXT:
            return text or None
        return tuple(float(word) for word in text.replace(",", " ").split()) or None
    if argument.kind is ArgumentKind.NUMBER:
        return None if math.isnan(raw) else float(raw)
    if raw == LEFT_OUT:
        return None
    if int(raw) >= len(argument.choices):
        raise ValueError(f"`{argument.name}` has no choice {int(raw)}")
    return argument.choices[int(raw)]
