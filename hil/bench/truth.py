"""What really happened: hashed, counted, and in a file of the bench's own (`truth.mcap`) that onboard never opens.

The file's channels, ten times a second of bench time but for faults and contacts:

    /truth   JSON: position_m, quaternion_xyzw, wheel_rate_radps, wheel_rad, steer_rad, rockers_rad, contact
    /turn    a turn of the scanner: sweep u32 (0 outside one), then (1 + n, 3) float32, m, map frame: where its middle
             ray began, and what every fourth ray met
    /fault   JSON: t_s, fault, target, what ("begin", "heal")
    /contact JSON, when a contact begins and again when it is over: number from 0, t_s, what, begin_s, end_s, wheel (0:
             the body), rock_height_m (0: the ground), x_m, y_m; the last message of a number counts
    /ground  other ground from now on: row, column u32 of the field's grid, rows, columns u32, then the new heights
             there, float32, m

It can be read while it is written: it reaches the disk within a second or two of bench time.
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

from hil.bench.contacts import Contact, Contacts
from hil.records import PlantState, Turn
from hil.terrain.field import Field, truth_height
from onboard.records import F32

_PERIOD_NS = 100_000_000
_CHUNK_BYTES = 1 << 13  # small: who watches a run sees no more than what is whole
_EVERY = 4  # of a turn's rays
_SWEEP, _PATCH = struct.Struct("<I"), struct.Struct("<4I")
_SCHEMA = json.dumps({"type": "object", "properties": {
    "position_m": {"type": "array"}, "quaternion_xyzw": {"type": "array"}, "wheel_rate_radps": {"type": "array"},
    "wheel_rad": {"type": "array"}, "steer_rad": {"type": "array"}, "rockers_rad": {"type": "array"},
    "contact": {"type": "string"}}}).encode()


class TruthFile:
    """The plant's state and a turn of the scanner ten times a second, and the faults."""

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
        """One state a tick."""
        if state.now_ns % _PERIOD_NS == 0:
            self._add(self._truth, state.now_ns, _row(state))
            self._file.flush()

    def add_turn(self, turn: Turn) -> None:
        """One turn of the scanner."""
        if turn.now_ns - self._turned_ns >= _PERIOD_NS:
            self._turned_ns = turn.now_ns
            self._add(self._turn, turn.now_ns, _SWEEP.pack(turn.sweep) + _met(turn).astype("<f4").tobytes())

    def add_fault(self, now_ns: int, row: Mapping[str, object]) -> None:
        """A fault begins or is healed."""
        self._add(self._fault, now_ns, json.dumps(row).encode())

    def add_contact(self, now_ns: int, number: int, contact: Contact) -> None:
        """A contact begins or is over."""
        self._add(self._contact, now_ns, json.dumps({"number": number, **contact.row()}).encode())

    def add_ground(self, now_ns: int, patch: Patch) -> None:
        """The ground is another now."""
        place = _PATCH.pack(patch.row, patch.column, *patch.heights_m.shape)
        self._add(self._ground, now_ns, place + patch.heights_m.astype("<f4").tobytes())

    def _add(self, channel: int, now_ns: int, data: bytes) -> None:
        self._writer.add_message(channel, log_time=now_ns, publish_time=now_ns, data=data)

    def close(self) -> None:
        """Finish the file."""
        self._writer.finish()
        self._file.close()


class Truth:
    """Hashes the plant's state at every tick and counts contacts; with a path it keeps what it sees in a file, too."""

    def __init__(self, path: Path | None = None) -> None:
        self._file = TruthFile(path) if path else None
        self._sum = hashlib.sha256()
        self.states = self.crc = 0
        self._contacts, self._now_ns = Contacts(), 0

    def add(self, state: PlantState) -> None:
        """One state a tick."""
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
        """All since the begin; the same list each time, it grows and its entries that go on are replaced."""
        return self._contacts.found

    def _tell(self, numbers: Iterable[int]) -> None:
        if self._file:
            for number in numbers:
                self._file.add_contact(self._now_ns, number, self.contacts[number])

    def add_turn(self, turn: Turn) -> None:
        """One turn of the scanner; for the file alone."""
        if self._file:
            self._file.add_turn(turn)

    def add_fault(self, now_ns: int, row: Mapping[str, object]) -> None:
        """A fault begins or is healed; for the file alone."""
        if self._file:
            self._file.add_fault(now_ns, row)

    def add_ground(self, now_ns: int, before: Field, after: Field) -> None:
        """The ground has changed; for the file alone."""
        patch = difference(truth_height(before), truth_height(after)) if self._file else None
        if self._file and patch:
            self._file.add_ground(now_ns, patch)

    def sha256(self) -> str:
        """Over the states of all ticks."""
        return self._sum.hexdigest()

    def close(self) -> None:
        """Finish the file; what still touches is told up to now."""
        if self._file:
            self._tell(self._contacts.going_on)
            self._file.close()
            self._file = None


class Met(NamedTuple):
    """A message of /turn. origin_m: (3,); points_m: (n, 3) float32."""

    sweep: int
    origin_m: F32
    points_m: F32


def read_turn(data: bytes) -> Met:
    """A message of /turn. Raises ValueError, struct.error where it is none."""
    rows = np.frombuffer(data, "<f4", offset=_SWEEP.size).reshape(-1, 3)
    return Met(_SWEEP.unpack_from(data)[0], rows[0], rows[1:])


class Patch(NamedTuple):
    """A message of /ground: the ground's heights from this cell of the field on. heights_m: (rows, columns) float32."""

    row: int
    column: int
    heights_m: F32


def difference(before_m: F32, after_m: F32) -> Patch | None:
    """The smallest rectangle outside which nothing has changed; None where nothing has."""
    rows, columns = np.nonzero(before_m != after_m)
    if len(rows) == 0:
        return None
    row, column = int(rows.min()), int(columns.min())
    return Patch(row, column, after_m[row : rows.max() + 1, column : columns.max() + 1])


def read_patch(data: bytes) -> Patch:
    """A message of /ground. Raises ValueError, struct.error where it is none."""
    row, column, rows, columns = _PATCH.unpack_from(data)
    return Patch(row, column, np.frombuffer(data, "<f4", offset=_PATCH.size).reshape(rows, columns))


def _met(turn: Turn) -> F32:
    kept = np.flatnonzero(np.isfinite(turn.ranges_m[::_EVERY])) * _EVERY
    points_m = turn.origins_m[kept] + turn.ranges_m[kept, None] * turn.directions[kept]
    return np.vstack((turn.origins_m[len(turn.origins_m) // 2], points_m)).astype(np.float32)


def _row(state: PlantState) -> bytes:
    return json.dumps({
        "position_m": state.position_m.tolist(), "quaternion_xyzw": state.quaternion_xyzw.tolist(),
        "wheel_rate_radps": [w.rate_radps for w in state.wheels], "wheel_rad": [w.position_rad for w in state.wheels],
        "steer_rad": [w.steer_rad for w in state.wheels], "rockers_rad": list(state.rockers_rad),
        "contact": state.contact,
    }).encode()
