"""What really happened: hashed, counted, and in a file of the bench's own (`truth.mcap`) that onboard never opens."""

from __future__ import annotations

import hashlib
import json
import struct
from pathlib import Path
from zlib import crc32

from mcap.writer import CompressionType, Writer

from hil.records import PlantState

_PERIOD_NS = 100_000_000
_SCHEMA = json.dumps({"type": "object", "properties": {
    "position_m": {"type": "array"}, "quaternion_xyzw": {"type": "array"}, "wheel_rate_radps": {"type": "array"},
    "steer_rad": {"type": "array"}, "contact": {"type": "string"}}}).encode()


class TruthFile:
    """The plant's state ten times a second."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("wb")
        self._writer = Writer(self._file, compression=CompressionType.ZSTD)
        self._writer.start(profile="", library="el-dorado")
        schema = self._writer.register_schema("eldorado.truth", "jsonschema", _SCHEMA)
        self._channel = self._writer.register_channel("/truth", "json", schema)

    def add(self, state: PlantState) -> None:
        """One state a tick."""
        if state.now_ns % _PERIOD_NS == 0:
            self._writer.add_message(self._channel, log_time=state.now_ns, publish_time=state.now_ns, data=_row(state))

    def close(self) -> None:
        """Finish the file."""
        self._writer.finish()
        self._file.close()


class Truth:
    """Hashes the plant's state at every tick and counts contacts; with a path it keeps the states in a file, too."""

    def __init__(self, path: Path | None = None) -> None:
        self._file = TruthFile(path) if path else None
        self._sum = hashlib.sha256()
        self.states = self.crc = 0
        self.contacts: list[tuple[float, str]] = []
        self._touching = ""

    def add(self, state: PlantState) -> None:
        """One state a tick."""
        self.states += 1
        wheels = [number for wheel in state.wheels for number in wheel]
        data = state.position_m.tobytes() + state.quaternion_xyzw.tobytes() + struct.pack(f"<{len(wheels)}d", *wheels)
        self.crc = crc32(data, self.crc)
        self._sum.update(data)
        if state.contact and state.contact != self._touching:
            self.contacts.append((state.now_ns / 1e9, state.contact))
        self._touching = state.contact
        if self._file:
            self._file.add(state)

    def sha256(self) -> str:
        """Over the states of all ticks."""
        return self._sum.hexdigest()

    def close(self) -> None:
        """Finish the file."""
        if self._file:
            self._file.close()


def _row(state: PlantState) -> bytes:
    return json.dumps({
        "position_m": state.position_m.tolist(), "quaternion_xyzw": state.quaternion_xyzw.tolist(),
        "wheel_rate_radps": [w.rate_radps for w in state.wheels], "steer_rad": [w.steer_rad for w in state.wheels],
        "contact": state.contact,
    }).encode()
