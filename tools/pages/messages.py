"""Pages about MAVLink: every message of the dialect, and the gateway's mapping of commands and parameters."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from pymavlink import dialects

from ground.gateway.desks.orders import NEEDS_ENABLING, ROWS
from ground.gateway.desks.parameters import ids_of, read_listing
from ground.gateway.frames import mavlink
from ground.gateway.health import DEVICES
from ground.gateway.vehicle import MESSAGES as SHOWN
from onboard.config import Config
from onboard.parameters import ParameterSet, listing
from protocol.tables.telemetry import ITEMS_SLOTS, TABLE, rate_hz
from tools.make_dialect import FILES, KEPT, SOURCE

Table = Callable[[Sequence[str], Iterable[Sequence[str]]], str]
_COMMON = Path(dialects.__path__[0]) / "v20"


def messages(table: Table) -> list[str]:
    """Sections of the page of messages."""
    own = list(ET.parse(SOURCE).iter("message"))
    kept = [found for name in FILES for found in ET.parse(_COMMON / name).iter("message") if found.get("name") in KEPT]
    kept.sort(key=lambda message: int(message.get("id", "0")))
    loose = [row for row in TABLE if not row.message]
    return [
        "What the rover sends, as MAVLink 2 in datagrams of kind 1. The dialect is small on purpose: the rover knows "
        "no other message ([learned.md](learned.md) has the price of the whole common set). Ground programs see the "
        "gateway's messages instead ([gateway.md](gateway.md)).",
        "The frames are MAVLink's (north, east, down; forward, right, down); `protocol/mavlink_frames.py` turns ours "
        "into them. An item is a row of `protocol/tables/telemetry.py`, as `ground status` shows it.",
        *(part for message in own for part in _message(message, table)),
        "## Of the common set",
        *(part for message in kept for part in _message(message, table)),
        "## Items without a field of their own",
        f"They ride in `ITEMS`, {ITEMS_SLOTS} to a message, by their number.",
        table(
            ("no.", "item", "unit", "rate", "meaning"),
            [(str(row.id), f"`{row.name}`", row.unit, f"{row.rate_hz:g} Hz", row.meaning) for row in loose],
        ),
    ]


def _message(message: ET.Element, table: Table) -> list[str]:
    name = message.get("name", "")
    items = {row.field: row for row in TABLE if row.message == name}
    sent = {"HEARTBEAT": _often(1.0), "ITEMS": _often(rate_hz(""))}.get(name, _often(rate_hz(name)) if items else "")
    if name == "STATUSTEXT":
        sent = "Not sent by the rover, which tells events; the gateway makes it of them. "
    rows = [
        (f"`{f.get('name')}`", str(f.get("type")), f.get("units") or "", _item(f, items), _text(f))
        for f in message.iter("field")
    ]
    return [
        f"### {name} ({message.get('id')})",
        sent + _text(message.find("description")),
        table(("field", "type", "unit", "item", "meaning"), rows),
    ]


def _often(times_a_second: float) -> str:
    return f"Sent {'once' if times_a_second == 1 else f'{times_a_second:g} times'} a second. "


def _item(field: ET.Element, items: dict[str, object]) -> str:
    name = field.get("name", "")
    known = [row for key, row in items.items() if key.partition("[")[0] == name]
    return ", ".join(f"`{row.name}`" for row in known)  # type: ignore[attr-defined]


def _text(element: ET.Element | None) -> str:
    return " ".join("".join(element.itertext()).split()) if element is not None else ""


def gateway(table: Table) -> list[str]:
    """Sections of the page of the gateway's mapping."""
    numbers = read_listing(listing(ParameterSet(Config())))
    commands = [(str(number), f"`{mavlink.enums['MAV_CMD'][number].name}`", row.means) for number, row in ROWS.items()]
    shown = [
        (
            f"`{name}`",
            "each second"
            if name == "HEARTBEAT"
            else f"with each news of `{row.items[0]}`"
            if row.items
            else "on request",
        )
        for name, row in SHOWN.items()
    ]
    return [
        "What [the gateway](gateway.md) makes of MAVLink's words, from the tables that it works by.",
        "## Commands",
        "In COMMAND_LONG or COMMAND_INT. "
        + ", ".join(f"`{name}`" for name in NEEDS_ENABLING)
        + " need the rover armed. Any other command is answered UNSUPPORTED.",
        table(("no.", "MAVLink command", "what it does"), commands),
        "## Messages",
        "Beside these: STATUSTEXT, COMMAND_ACK, PARAM_VALUE, PARAM_ERROR, and those of the mission protocol.",
        table(("message", "sent"), shown),
        "## Sensors in SYS_STATUS",
        "Present: as the table says, and the rover has told its faults. Enabled: so too, the motors not where a mode "
        "has the wheels off. Healthy: none of the faults is active; one that is masked on board is not told.",
        table(
            ("MAV_SYS_STATUS_SENSOR", "there when", "faults"),
            [
                (
                    f"`{mavlink.enums['MAV_SYS_STATUS_SENSOR'][row.bit].name}`",
                    row.means,
                    ", ".join(f"`{name}`" for name in row.faults),
                )
                for row in DEVICES
            ],
        ),
        "## Parameters",
        "MAVLink's names have 16 characters at most. All values are sent as REAL32; truth values are 0 and 1. Texts "
        "are not mirrored.",
        table(("MAVLink", "parameter"), [(f"`{short}`", f"`{name}`") for short, name in ids_of(numbers).items()]),
    ]
