"""True state of a run: hashed, counted, and recorded in a file of the bench (`truth.mcap`) that onboard never opens.

Channels of the file. /truth and /turn have ten messages per second of bench time:

    /truth   JSON: position_m, quaternion_xyzw, wheel_rate_radps, wheel_rad, steer_rad, rockers_rad, contact
    /turn    a turn of the scanner: sweep u32 (0 outside one), then (1 + n, 3) float32, m, map frame: origin of its
             middle ray, and the hit points of every fourth ray
    /fault   JSON: t_s, fault, target, what ("begin", "heal")
    /contact JSON, when a contact begins and again when it ends: number from 0, t_s, what, begin_s, end_s, wheel (0:
             the body), rock_height_m (0: the ground), x_m, y_m; the last message of a number is valid
    /ground  changed ground: row, column u32 of the field's grid, rows, columns u32, then the new heights there,
             float32, m

The file can be read while it is written: data reach the disk within a second or two of bench time.
"""

from __future__ import annotations

import hashlib
import json
import struct
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple
from zlib import crc32

import numpy as np
from mcap.writer import CompressionType, Writer

from hil.records import PlantState, TrueTurn
from hil.terrain.field import Field, truth_height
from hil.world.contacts import Contact, Contacts
from onboard.records import F32

_PERIOD_NS = 100_000_000
_CHUNK_BYTES = 1 << 13  # small: a viewer of a running run sees only complete chunks
_EVERY = 4  # one ray of this many is recorded
_SWEEP, _PATCH = struct.Struct("<I"), struct.Struct("<4I")
_SCHEMA = json.dumps(
    {
        "type": "object",
        "properties": {
            "position_m": {"type": "array"},
            "quaternion_xyzw": {"type": "array"},
            "wheel_rate_radps": {"type": "array"},
            "wheel_rad": {"type": "array"},
            "steer_rad": {"type": "array"},
            "rockers_rad": {"type": "array"},
            "contact": {"type": "string"},
        },
    }
).encode()


class TruthFile:
    """Writer of truth.mcap: plant state and a turn of the scanner ten times a second, faults, contacts, ground."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("wb")
        self._writer = Writer(self._file, compression=CompressionType.ZSTD, chunk_size=_CHUNK_BYTES)
        self._writer.start(profile="", library="el-dorado")
        schema = self._writer.register_schema("eldorado.truth", "jsonschema", _SCHEMA)
        self._truth = self._writer.register_channel("/truth", "json", schema)
        self._turn = self._writer.register_channel("/turn", "", 0)
        self._fault = self._writer.register_channel("/fault", "json", 0)
        self._contact = self._writer.register_channel("/contact", "json", 0)
        self._ground = self._writer.register_channel("/ground", "", 0)
        self._turned_ns = -_PERIOD_NS

    def add(self, state: PlantState) -> None:
        """Write a state if it is due; call each tick."""
        if state.now_ns % _PERIOD_NS == 0:
            self._add(self._truth, state.now_ns, _row(state))
            self._file.flush()

    def add_turn(self, turn: TrueTurn) -> None:
        """Write a turn of the scanner if one is due."""
        if turn.now_ns - self._turned_ns >= _PERIOD_NS:
            self._turned_ns = turn.now_ns
            self._add(self._turn, turn.now_ns, _SWEEP.pack(turn.sweep) + _met(turn).astype("<f4").tobytes())

    def add_fault(self, now_ns: int, row: Mapping[str, object]) -> None:
        """Write the begin or heal of a fault."""
        self._add(self._fault, now_ns, json.dumps(row).encode())

    def add_contact(self, now_ns: int, number: int, contact: Contact) -> None:
        """Write the begin or end of a contact."""
        self._add(self._contact, now_ns, json.dumps({"number": number, **contact.row()}).encode())

    def add_ground(self, now_ns: int, patch: Patch) -> None:
        """Write a change of the ground."""
        place = _PATCH.pack(patch.row, patch.column, *patch.heights_m.shape)
        self._add(self._ground, now_ns, place + patch.heights_m.astype("<f4").tobytes())

    def _add(self, channel: int, now_ns: int, data: bytes) -> None:
        self._writer.add_message(channel, log_time=now_ns, publish_time=now_ns, data=data)

    def close(self) -> None:
        """Finish the file."""
        self._writer.finish()
        self._file.close()


class Truth:
    """Monitor of the true state: hashes it at every tick and counts contacts.

    path: file for truth.mcap; None for no file
    """

    def __init__(self, path: Path | None = None) -> None:
        self._file = TruthFile(path) if path else None
        self._sum = hashlib.sha256()
        self.states = self.crc = 0
        self._contacts, self._now_ns = Contacts(), 0

    def add(self, state: PlantState) -> None:
        """Add the state of one tick."""
        self.states += 1
        wheels = [number for wheel in state.wheels for number in wheel]
        data = state.position_m.tobytes() + state.quaternion_xyzw.tobytes() + struct.pack(f"<{len(wheels)}d", *wheels)
        self.crc = crc32(data, self.crc)
        self._sum.update(data)
        self._now_ns = state.now_ns
        told = self._contacts.add(state.now_ns, state.touches)
        if self._file:
            self._file.add(state)
            self._tell(told)

    @property
    def contacts(self) -> Sequence[Contact]:
        """All contacts since the start. Always the same list: it grows, and entries of open contacts are replaced."""
        return self._contacts.found

    def _tell(self, numbers: Iterable[int]) -> None:
        if self._file:
            for number in numbers:
                self._file.add_contact(self._now_ns, number, self.contacts[number])

    def add_turn(self, turn: TrueTurn) -> None:
        """Record one turn of the scanner, if there is a file."""
        if self._file:
            self._file.add_turn(turn)

    def add_fault(self, now_ns: int, row: Mapping[str, object]) -> None:
        """Record the begin or heal of a fault, if there is a file."""
        if self._file:
            self._file.add_fault(now_ns, row)

    def add_ground(self, now_ns: int, before: Field, after: Field) -> None:
        """Record a change of the ground, if there is a file."""
        patch = difference(truth_height(before), truth_height(after)) if self._file else None
        if self._file and patch:
            self._file.add_ground(now_ns, patch)

    def sha256(self) -> str:
        """SHA-256 over the states of all ticks."""
        return self._sum.hexdigest()

    def close(self) -> None:
        """Finish the file; open contacts are written with the current time as their end."""
        if self._file:
            self._tell(self._contacts.going_on)
            self._file.close()
            self._file = None


class Met(NamedTuple):
    """Decoded message of /turn.

    sweep: number of the sweep, 0 outside one
    origin_m: (3,), origin of the middle ray
    points_m: (n, 3) float32, hit points
    """

    sweep: int
    origin_m: F32
    points_m: F32


def read_turn(data: bytes) -> Met:
    """Decode a message of /turn. Raises ValueError, struct.error for other data."""
    rows = np.frombuffer(data, "<f4", offset=_SWEEP.size).reshape(-1, 3)
    return Met(_SWEEP.unpack_from(data)[0], rows[0], rows[1:])


class Patch(NamedTuple):
    """Decoded message of /ground: new heights of a rectangle of the field.

    row, column: first cell
    heights_m: (rows, columns) float32
    """

    row: int
    column: int
    heights_m: F32


def difference(before_m: F32, after_m: F32) -> Patch | None:
    """Smallest rectangle that contains all changes; None if nothing changed."""
    rows, columns = np.nonzero(before_m != after_m)
    if len(rows) == 0:
        return None
    row, column = int(rows.min()), int(columns.min())
    return Patch(row, column, after_m[row : rows.max() + 1, column : columns.max() + 1])


def read_patch(data: bytes) -> Patch:
    """Decode a message of /ground. Raises ValueError, struct.error for other data."""
    row, column, rows, columns = _PATCH.unpack_from(data)
    return Patch(row, column, np.frombuffer(data, "<f4", offset=_PATCH.size).reshape(rows, columns))


def _met(turn: TrueTurn) -> F32:
    kept = np.flatnonzero(np.isfinite(turn.ranges_m[::_EVERY])) * _EVERY
    points_m = turn.origins_m[kept] + turn.ranges_m[kept, None] * turn.directions[kept]
    return np.vstack((turn.origins_m[len(turn.origins_m) // 2], points_m)).astype(np.float32)


def _row(state: PlantState) -> bytes:
    return json.dumps(
        {
            "position_m": state.position_m.tolist(),
            "quaternion_xyzw": state.quaternion_xyzw.tolist(),
            "wheel_rate_radps": [w.rate_radps for w in state.wheels],
            "wheel_rad": [w.position_rad for w in state.wheels],
            "steer_rad": [w.steer_rad for w in state.wheels],
            "rockers_rad": list(state.rockers_rad),
            "contact": state.contact,
        }
    ).encode()
