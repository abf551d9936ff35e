"""Versions that both ends must share: command dictionary, CAN database, MAVLink dialect.

Each version is the first four bytes of a SHA-256 over its contract: names, numbers, units, ranges and layouts, without
texts for people, so that a better sentence is no new version. Computed at import from the one source of each.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection
from typing import Any, NamedTuple

from protocol.generated import eldorado_dialect
from protocol.generated.can_codec import DBC_SHA256
from protocol.link import events, transactions
from protocol.tables import commands, faults, modes, telemetry


class Versions(NamedTuple):
    """Versions of one side. The names are those of the telemetry rows without `_version`."""

    dictionary: int
    dbc: int
    dialect: int

    def differences(self, rover: Versions) -> str:
        """Text `dictionary 1a2b3c4d here, 5e6f7a8b on the rover` for each that differs; '' if none does."""
        rows = zip(self._fields, self, rover)
        return "; ".join(
            f"{name} {here:08x} here, {there:08x} on the rover" for name, here, there in rows if here != there
        )


def digest(contract: Any) -> int:
    """32-bit digest of plain data: numbers, texts, None and tuples of them, whose `repr` is the same everywhere."""
    return int.from_bytes(hashlib.sha256(repr(contract).encode()).digest()[:4], "big")


def dictionary() -> tuple[Any, ...]:
    """Contract of commands, their reports, telemetry, modes, events and faults."""
    rows = [
        (row.id, row.name, tuple(_argument(a) for a in row.arguments), tuple(map(int, row.modes)), row.sends, row.free)
        for row in commands.TABLE
    ]
    items = [(r.id, r.name, r.unit, r.message, r.field, r.scale) for r in telemetry.TABLE]
    enums = [
        (name, tuple((e.name, int(e)) for e in kind))  # the name belongs to the contract: a renamed class keeps it
        for name, kind in (
            ("Mode", modes.Mode),
            ("Phase", modes.Phase),
            ("State", transactions.RequestState),
            ("Code", transactions.Code),
        )
    ]
    return (
        *rows,
        *items,
        *enums,
        tuple(row.name for row in modes.EVENTS),
        events.CAPACITY,
        tuple((fault.number, fault.name) for fault in faults.FAULTS),
    )


def _argument(a: commands.Argument) -> tuple[Any, ...]:
    known: Collection[str] = a.known
    return (a.name, a.unit, a.low, a.high, a.required, a.choices, a.text, a.most, a.least, tuple(known))


def dialect() -> tuple[Any, ...]:
    """Contract of the MAVLink messages: the meaning of their bytes. The values of enums are named in the common set."""
    kinds = eldorado_dialect.mavlink_map
    return tuple(
        (number, kind.msgname, kind.crc_extra, tuple(kind.ordered_fieldnames), tuple(kind.lengths))
        for number, kind in sorted(kinds.items())
    )


OURS = Versions(digest(dictionary()), int(DBC_SHA256[:8], 16), digest(dialect()))
