"""Writer of a run's record: every input and output of the core, tick by tick, with what a replay needs.

MCAP, zstd. A chunk ends twice a second and is synced to the disk, outside the tick. Attachments: config.toml,
versions.json with commit and digest of the program; at the start rover.dbc and eldorado.xml, gdem.npz, saved parameters
and fences, the tiles of the map; at the end its tiles and rhythm.json. Decisions with their maps are on /plan as .npz,
for the report; a replay computes them again.

While the disk refuses, data waits in memory. The amount of waiting data determines how much of a tick is recorded:

    nothing waits    all                       half of waiting_bytes    of outputs only LEAN; a replay computes all
    something waits  all but /plan             waiting_bytes            nothing
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import MappingProxyType, TracebackType
from typing import TYPE_CHECKING, Any

from onboard.config import Config
from onboard.config_text import to_toml
from onboard.drivers.storage.record_file import NO_ROOM, DiskFile, Opener, OpenFile, RecordFile
from onboard.maps.gdem_file import to_npz
from onboard.perception.map.tiles import Tile, cut, encode
from onboard.planning import archive
from onboard.planning.plan_records import PlanResult
from onboard.record import made_by, state_checks
from onboard.record.parts import family, first_path, make_room, part_path
from onboard.record.schema import LAYOUTS, LEAN, encode_inputs, encode_outputs
from onboard.records import Gdem, Inputs, Outputs, RecordedParts, RecordStatus, RecordTrouble

if TYPE_CHECKING:
    from mcap.writer import Writer

    from onboard.perception.map.stop_map import StopMap

MAP_START, MAP_END = "map-start/", "map-end/"  # prefixes of the names of attachments that are tiles
KEPT = "kept/"  # prefix of other state that outlives a run
PART = "part"  # metadata: position of a file in the run
FLUSH_TICKS = 50
_CHUNK_BYTES = 1 << 18


class Recorder:
    """Writer of the record of config.record; with an empty path it does nothing. Use it as a context manager.

    opener: opens the files; a simulated disk on the bench.
    """

    def __init__(
        self,
        config: Config,
        gdem: Gdem | None,
        tiles: Iterable[Tile] = (),
        kept: Mapping[str, bytes] = MappingProxyType({}),
        opener: Opener = DiskFile,
    ) -> None:
        self._config, self._opener = config, opener
        self._files: list[RecordFile] = []  # the last one is written to; earlier ones still have waiting data
        self._number = self._lost_ticks = self._chunk_bytes = 0
        if not config.record.path:
            return
        self._first = first_path(config.record.path)
        self._made_by = made_by.versions_file()  # once, because a further part begins within a tick
        self._begin({"first_tick": "1"})
        for name, data in made_by.wires():
            self._attach(name, data, "application/octet-stream")
        if gdem is not None:
            self._attach("gdem.npz", to_npz(gdem), "application/octet-stream")
        self._attach_tiles(MAP_START, tiles)
        for name, data in kept.items():
            self._attach(KEPT + name, data, "application/json")
        self._flush()
        self._files[-1].settle()

    @property
    def path(self) -> Path | None:
        """File that is being written; None without a record."""
        return self._files[-1].path if self._files else None

    def paths(self) -> list[Path]:
        """Files of this run's record on the disk, oldest first."""
        return family(self._first, False)

    @property
    def waiting_bytes(self) -> int:
        """Bytes in memory that are not on the disk yet."""
        return sum(file.waiting_bytes for file in self._files)

    @property
    def status(self) -> RecordStatus:
        """Status for the inputs of the next tick."""
        waiting, limit = self.waiting_bytes, self._config.record.waiting_bytes
        keeps = (
            RecordedParts.NOTHING
            if waiting > limit
            else RecordedParts.LEAN
            if waiting > limit // 2
            else RecordedParts.ALL
        )
        error = next((file.error for file in self._files if file.error), None)
        if error is None:
            return RecordStatus(keeps, lost_ticks=self._lost_ticks)
        trouble = RecordTrouble.FULL if error.errno in NO_ROOM else RecordTrouble.FAILED
        return RecordStatus(keeps, trouble, error.strerror or str(error), self._lost_ticks)

    def write(self, inputs: Inputs, outputs: Outputs) -> None:
        """Record one tick; its inputs state how much of it is recorded."""
        if not self._files:
            return
        if inputs.record.keeps is RecordedParts.NOTHING:
            self._lost_ticks += 1
        else:
            self._add(inputs, outputs)
        if inputs.tick % FLUSH_TICKS == 0 or self._chunk_bytes > _CHUNK_BYTES:
            self._flush()
            self._retry_others()
            if self._files[-1].tell() > self._config.record.part_bytes and inputs.record.trouble is RecordTrouble.NONE:
                self._next_part(inputs.tick + 1)

    def end(self, memory: StopMap | None, rhythm: Mapping[str, Any] | None = None) -> None:
        """Attach the final map and the timing summary (onboard.status.report); call after the last tick."""
        if not self._files:
            return
        if rhythm is not None:
            self._attach("rhythm.json", json.dumps(rhythm).encode(), "application/json")
        if memory is not None:
            self._attach_tiles(MAP_END, cut(memory.cells, memory.target_points))

    def __enter__(self) -> Recorder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Finish the file; returns when all that the disk accepts is stored."""
        if self._files:
            self._files[-1].end(self._writer.finish)
        for file in self._files:
            file.close()

    # -- one tick --------------------------------------------------------------------------------------------------

    def _add(self, inputs: Inputs, outputs: Outputs) -> None:
        read = encode_inputs(inputs)
        made = encode_outputs(outputs, read)
        if inputs.record.keeps is RecordedParts.LEAN:
            made = {topic: data for topic, data in made.items() if topic in LEAN}
        for messages in (read, made):
            for topic, data in messages.items():
                self._message(topic, inputs, data)
        if inputs.record.keeps is RecordedParts.ALL and outputs.state:
            self._message("/state", inputs, state_checks.encode(outputs.state))
        if inputs.record.trouble is RecordTrouble.NONE:
            for job in inputs.jobs:
                if isinstance(job.value, PlanResult):
                    self._message("/plan", inputs, archive.to_npz(job.value))

    def _message(self, topic: str, inputs: Inputs, data: bytes) -> None:
        self._writer.add_message(
            self._channels[topic], log_time=inputs.now_ns, publish_time=inputs.now_ns, sequence=inputs.tick, data=data
        )
        self._chunk_bytes += len(data)

    def _flush(self) -> None:
        """End the chunk; call between ticks, so that a chunk contains complete ticks."""
        self._writer.flush()  # type: ignore[no-untyped-call]
        self._chunk_bytes = 0

    # -- files -----------------------------------------------------------------------------------------------------

    def _begin(self, part: Mapping[str, str]) -> None:
        """Begin the next file; each one contains the configuration and program that made it."""
        from mcap.writer import CompressionType, Writer  # not loaded for a run without a record

        self._number += 1
        path, config = part_path(self._first, self._number), self._config
        file = RecordFile(path, config.record.spare_bytes, config.clock.mode == "lockstep", self._open)
        self._files.append(file)
        self._writer: Writer = Writer(
            file,  # type: ignore[arg-type]
            chunk_size=1 << 31,
            compression=CompressionType.ZSTD,
            enable_data_crcs=True,
        )
        self._writer.start(profile="", library="el-dorado")
        self._writer.add_metadata(PART, {"number": str(self._number), **part})
        self._attach("config.toml", to_toml(config).encode(), "application/toml")
        self._attach(*self._made_by)
        self._channels = register(self._writer)

    def _next_part(self, first_tick: int) -> None:
        """Begin the next part. Its metadata identifies the previous part by size and digest."""
        before = self._files[-1]
        origin = {"before_bytes": str(before.tell()), "before_sha256": before.sha256.hexdigest()}
        before.end(self._writer.finish)
        self._begin({"first_tick": str(first_tick), **origin})

    def _retry_others(self) -> None:
        for file in [file for file in self._files[:-1] if file.ended]:
            if file.waiting_bytes:
                file.flush()
            else:
                file.close()
                self._files.remove(file)

    def _open(self, path: Path) -> OpenFile:
        """Open a file, in its thread. The oldest records are deleted first, so that the limit includes the new one."""
        whole_folder = self._config.record.path.endswith("/")
        relatives = [other for other in family(self._first, whole_folder) if other != path]
        if path == self._first and not whole_folder:
            make_room(relatives, 0)  # further parts of an earlier run
        elif self._config.record.keep_bytes:
            make_room(relatives, max(0, self._config.record.keep_bytes - self._config.record.part_bytes))
        return self._opener(path)

    def _attach(self, name: str, data: bytes, media_type: str) -> None:
        self._writer.add_attachment(0, 0, name, media_type, data)

    def _attach_tiles(self, prefix: str, tiles: Iterable[Tile]) -> None:
        for tile in tiles:
            self._attach(f"{prefix}{tile.i}_{tile.j}", encode(tile), "application/octet-stream")


def register(writer: Writer) -> dict[str, int]:
    """Topic -> id of its channel, for every channel of a record."""
    ids = {}
    for topic, layout in LAYOUTS.items():
        encoding = "json" if topic == "/out/event" else "application/octet-stream"
        schema = writer.register_schema(f"eldorado{topic.replace('/', '.')}", "text", layout.encode())
        ids[topic] = writer.register_channel(topic, encoding, schema)
    return ids
