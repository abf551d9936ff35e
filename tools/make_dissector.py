"""Generator of protocol/generated/eldorado.lua, the Wireshark dissector of MAVLink messages and link datagrams.

python -m tools.make_dissector [OUTPUT]. pymavlink's generator writes the first part: the rover's messages and those of
the gateway. The second part comes from the tables and structs of `protocol`; a struct whose fields are not all named
here is an error.
"""

from __future__ import annotations

import re
import struct
import sys
from collections.abc import Iterable, Mapping, Sequence
from enum import IntEnum
from pathlib import Path

from ground.gateway.desks.orders import ROWS
from ground.gateway.frames import mavlink
from protocol.link import bulk_wire, events, reports
from protocol.link import datagrams as link
from protocol.tables import commands
from protocol.tables.arguments import Argument, ArgumentKind
from tools.make_dialect import KEPT, made

ROOT = Path(__file__).resolve().parents[1]
TARGET = ROOT / "protocol" / "generated" / "eldorado.lua"
GATEWAY = {
    "COMMAND_LONG", "COMMAND_INT", "COMMAND_ACK", "SET_MODE", "GLOBAL_POSITION_INT", "VFR_HUD", "HOME_POSITION",
    "GPS_GLOBAL_ORIGIN", "AUTOPILOT_VERSION", "PARAM_REQUEST_LIST", "PARAM_REQUEST_READ", "PARAM_SET", "PARAM_VALUE",
    "PARAM_ERROR", "MISSION_COUNT", "MISSION_ITEM", "MISSION_ITEM_INT", "MISSION_REQUEST", "MISSION_REQUEST_INT",
    "MISSION_REQUEST_LIST", "MISSION_ACK", "MISSION_CURRENT", "MISSION_CLEAR_ALL", "MISSION_SET_CURRENT",
    "MISSION_ITEM_REACHED",
}  # fmt: skip
_BINDINGS = "-- bind protocol dissector to USER0 linktype"
SIZES = {"B": 1, "H": 2, "I": 4, "Q": 8, "q": 8, "d": 8, "i": 4}
TYPES = {"B": "uint8", "H": "uint16", "I": "uint32", "Q": "uint64", "q": "int64", "d": "double", "i": "int32"}
STRUCTS: Mapping[str, tuple[struct.Struct, tuple[str, ...]]] = {
    "header": (link._HEAD, ("kind", "key_id", "epoch", "flags", "counter", "boot_id")),
    "telecommand": (commands._HEAD, ("request_id", "issued_ns", "expiry_ns", "start_ns", "command")),
    "report": (reports._REPORT, ("request_id", "station", "serial", "state", "code", "values")),
    "chunk": (bulk_wire.CHUNK, ("object_id", "serial", "index")),
    "announcement": (bulk_wire.ANNOUNCE, ("length", "chunk_size", "sha256", "name_length", "codec_length")),
    "bitmap": (bulk_wire.BITMAP, ("object_id", "echo", "flags", "base")),
    "acknowledgement": (events._BASE, ("base",)),
}
_NAMES: Mapping[str, str] = {
    "header.kind": "KINDS", "telecommand.command": "COMMANDS", "report.state": "STATES", "report.code": "CODES",
}  # fmt: skip
_TAIL = Path(__file__).with_name("dissector.lua")


def generate() -> str:
    """Return the text of the dissector. Raises RuntimeError if a struct has other fields than are named here."""
    kept = {mavlink.enums["MAV_CMD"][number].name for number in ROWS}
    messages = made("WLua", KEPT | GATEWAY, kept).partition(_BINDINGS)[0]
    head = "-- Made from protocol/ by tools/make_dissector.py: run `make codec`. Use: docs/dissector.md\n\n"
    return head + re.sub(r"[ \t]+$", "", messages, flags=re.MULTILINE).rstrip() + "\n\n" + _link()


def _link() -> str:
    fields = ["local F = {}", *(line for name in STRUCTS for line in _declared(name))]
    read = ["local READ = {", *(f"    {name} = {_layout(name)}," for name in STRUCTS), "}"]
    arguments = ["local ARGUMENTS = {", *(_arguments(row) for row in commands.TABLE if row.arguments), "}"]
    tables = [
        _names("KINDS", {kind.value: kind.name for kind in link.DatagramKind}),
        _names("COMMANDS", {row.id: row.name for row in commands.TABLE}),
        _names("STATES", _enum(reports.RequestState)),
        _names("CODES", _enum(reports.Code)),
        f"local TAG_BYTES, ANNOUNCEMENT = {link.TAG_BYTES}, {bulk_wire.ANNOUNCEMENT}",
        f"local DOWNLINK_KEY_ID = {link.DOWNLINK_KEY_ID}",
    ]
    return "\n".join(["-- The link's datagrams.", *tables, *fields, *read, *arguments, "", _TAIL.read_text()])


def parts(name: str, layout: struct.Struct, names: Sequence[str]) -> list[tuple[str, str, int]]:
    """Field, format and bytes of a struct's fields. Raises RuntimeError if the struct has other fields than named."""
    found = re.findall(r"(\d*)([a-zA-Z])", layout.format.removeprefix("<"))
    formats = [n + c if c == "s" else c for n, c in found for _ in range(1 if c == "s" else int(n or 1))]
    if len(formats) != len(names):
        raise RuntimeError(f"{name}: {layout.format} has {len(formats)} fields, {len(names)} are named")
    return [(field, c, int(c[:-1]) if c.endswith("s") else SIZES[c]) for field, c in zip(names, formats)]


def _parts(name: str) -> list[tuple[str, str, int]]:
    return parts(name, *STRUCTS[name])


def _declared(name: str) -> Iterable[str]:
    for field, form, _ in _parts(name):
        key = f"{name}.{field}"
        kind = "bytes" if form.endswith("s") else TYPES[form]
        rest = f", base.DEC, {_NAMES[key]}" if key in _NAMES else ""
        if kind == "bytes":
            rest = ", base.NONE"
        yield f'F["{key}"] = ProtoField.{kind}("eldorado.{key}", "{field.replace("_", " ")}"{rest})'


def _layout(name: str) -> str:
    rows = ", ".join(f'{{F["{name}.{field}"], {size}}}' for field, _, size in _parts(name))
    return "{" + rows + "}"


def _arguments(row: commands.Command) -> str:
    told = ", ".join(f'{{"{a.name}", "{_KINDS[a.kind]}", "{a.unit}", {_choices(a)}}}' for a in row.arguments)
    return f"    [{row.id}] = {{{told}}},"


_KINDS = {
    ArgumentKind.NUMBER: "number",
    ArgumentKind.CHOICE: "choice",
    ArgumentKind.TEXT: "text",
    ArgumentKind.POINTS: "points",
}


def _choices(argument: Argument) -> str:
    return "{" + ", ".join(f'"{choice}"' for choice in argument.choices) + "}"


def _enum(kind: type[IntEnum]) -> dict[int, str]:
    return {one.value: one.name for one in kind}


def _names(name: str, rows: Mapping[int, str]) -> str:
    return f"local {name} = {{" + ", ".join(f'[{number}] = "{text}"' for number, text in rows.items()) + "}"


def main(argv: Sequence[str]) -> None:
    """Write the dissector."""
    (Path(argv[0]) if argv else TARGET).write_text(generate(), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
