"""Page of the link's wire format, from the structs and tables that the code packs and unpacks with."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Iterable, Mapping, Sequence
from enum import IntEnum

from protocol.link import bulk_wire, direct, reports
from protocol.link import datagrams as link
from tools.make_dissector import STRUCTS, TYPES, parts

Table = Callable[[Sequence[str], Iterable[Sequence[str]]], str]
_WORD: Mapping[str, tuple[struct.Struct, tuple[str, ...]]] = {
    "word": (direct._FRAME, ("word", "key_id", "nonce", "cookie")),
}
# Payloads: heading, layout, meaning of the numbers and the data that follows them.
_PAYLOADS = (
    (
        "Telecommand, up",
        "telecommand",
        "Times are onboard time in ns; an expiry of 0 is none, a start of 0 is at once. The command's arguments follow "
        "in the order of [commands.md](commands.md), SI units and radians: a number is a float64, NaN where it is left "
        "out; a choice a float64, its place in the list; a list of points a uint8, how many, and two int32 in mm for "
        "each; a text a uint8, how many bytes, and these in UTF-8.",
    ),
    ("Report, down", "report", "Then `values` float64, and to the end a text in UTF-8."),
    (
        "Acknowledgement of events, up",
        "acknowledgement",
        "To the end bits, the lowest first: bit n stands for the event of serial `base` + 1 + n. All up to `base` are "
        "there.",
    ),
    (
        "Chunk, down",
        "chunk",
        f"The chunk's bytes follow. Index {bulk_wire.ANNOUNCEMENT:#x} is an announcement, "
        f"{bulk_wire.REPAIR:#x} a repair symbol: base uint16, span uint8 and the XOR (`protocol/link/repair.py`).",
    ),
    ("Announcement of an object, in a chunk", "announcement", "Name and codec follow, in UTF-8."),
    (
        "Bitmap, up",
        "bitmap",
        f"Flags: {bulk_wire.KNOWN} the announcement is there, {bulk_wire.COMPLETE} the object is complete. To the end "
        "bits, the lowest first: bit n stands for chunk `base` + n. All below `base` are there.",
    ),
)


def sections(table: Table) -> list[str]:
    """Sections of the page."""
    return [
        f"Between rover and ground go datagrams of at most {link.MAX_DATAGRAM} B. On a udp/ endpoint each is one UDP "
        f"datagram; on the bus of a tcp/ endpoint each is one "
        f"zenoh sample, down on the key `{link.KEY_DOWN}`, up on `{link.KEY_UP}`. Numbers are little-endian.",
        "## Datagram",
        f"Head, payload, tag of {link.TAG_BYTES} B.",
        _layout("header", STRUCTS, table),
        _picture(link.__doc__, "Rule"),
        _numbers("kind", link.DatagramKind, table),
        "The key of an epoch is HKDF-SHA-256 (RFC 5869, no salt, 32 B) of the 32 B secret with the info "
        "`el dorado link ` + direction + ` ` + key id + epoch, the last two as one byte each. Direction is "
        f"`{link.KEY_UP}` or `{link.KEY_DOWN}`. Kind 1 carries MAVLink 2 messages ([messages.md](messages.md)), one "
        "after the other.",
        *(
            part
            for heading, name, text in _PAYLOADS
            for part in (f"## {heading}", _layout(name, STRUCTS, table), text, *_named(name, table))
        ),
        "## Words of a udp/ endpoint",
        f"Who wants the rover's datagrams asks for them. A word has {direct.WORD_BYTES} B: these fields and a tag of "
        f"{direct.TAG_BYTES} B. The hello key is HKDF-SHA-256 of the secret with the info `el dorado link ` + "
        "direction + ` hello ` + key id: of a station's command key, or for a viewer, with id 0, of the rover's "
        "downlink key.",
        _layout("word", _WORD, table),
        _picture(direct.__doc__, "Rule"),
        _numbers("word", direct.Word, table),
        "Each HELLO and BYE has a higher nonce than the one before it, also than those of an earlier program of the "
        f"station: begin with the time. A HELLO is answered {direct.ANSWERS} times at most, and the senders of one key "
        f"id get {direct.CHALLENGES_PER_S} CHALLENGEs a second. "
        "A cookie is good for its address in its two minutes and the next two. A place ends "
        f"{direct.LEASE_NS // 10**9} s after the last hello, or {direct.QUIET_NS // 10**9} s after it where another "
        f"address of its key id is heard. A station has {direct.STATION_PLACES} places, all viewers "
        f"{direct.VIEWER_PLACES}.",
    ]


def _named(name: str, table: Table) -> list[str]:
    kinds = {"report": (("state", reports.RequestState), ("code", reports.Code))}.get(name, ())
    return [_numbers(what, numbers, table) for what, numbers in kinds]


def _layout(name: str, layouts: Mapping[str, tuple[struct.Struct, tuple[str, ...]]], table: Table) -> str:
    rows, at = [], 0
    for field, form, size in parts(name, *layouts[name]):
        rows.append((str(at), f"`{field}`", f"{size} bytes" if form.endswith("s") else TYPES[form]))
        at += size
    return table(("at", "field", "type"), rows)


def _picture(text: str | None, end: str) -> str:
    """Drawings of a docstring: its indented lines before the rules."""
    before = (text or "").split(f"\n{end} ")[0].splitlines()
    drawn = [line for line in before if not line.strip() or line.startswith("    ")]
    return "```\n" + re.sub(r"\n{3,}", "\n\n", "\n".join(line[4:] for line in drawn).strip("\n")) + "\n```"


def _numbers(what: str, kinds: type[IntEnum], table: Table) -> str:
    return table(
        (what, "number"), [(f"`{kind.name}`", f"{kind.value:#x}" if kind > 0x7F else str(kind.value)) for kind in kinds]
    )
