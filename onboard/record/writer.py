"""One MCAP file for each run: every input and output of the core, tick by tick, with what is needed to run it again.

Attachments: config.toml, gdem.npz, versions.json, kept parameters and fences, the tiles of the map at the start; at the
end of the run, its tiles and rhythm.json. Chunks of 256 KiB, zstd. Decisions with their maps ride on /plan as .npz, for
the report; a replay makes them anew.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import MappingProxyType, TracebackType
from typing import TYPE_CHECKING, Any

from onboard.config import Config
from onboard.config_text import to_toml
from onboard.maps.gdem_file import to_npz
from onboard.perception.tiles import Tile, cut, encode
from onboard.planning import archive
from onboard.planning.plan_records import PlanResult
from onboard.record.schema import INPUTS, OUTPUTS, encode_inputs, encode_outputs
from onboard.records import Gdem, Inputs, Outputs

if TYPE_CHECKING:
    from onboard.perception.stop_map import StopMap

MAP_START, MAP_END = "map-start/", "map-end/"  # names of the attachments that are tiles begin so
KEPT = "kept/"  # and of what else outlives a run so
_SCHEMA_TEXT = b"layout: see onboard/record/schema.py of the version in versions.json"
_PACKAGES = ("numpy", "scipy", "filterpy", "small-gicp", "python-can", "pymavlink", "eclipse-zenoh", "mcap")


class Recorder:
    """Writes the record of config.record.path; with an empty path it does nothing. Used as a context manager."""

    def __init__(self, config: Config, gdem: Gdem | None, tiles: Iterable[Tile] = (),
                 kept: Mapping[str, bytes] = MappingProxyType({})) -> None:
        self._file = None
        if not config.record.path:
            return
        from mcap.writer import CompressionType, Writer  # not for a run without a record

        path = Path(config.record.path)
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = path.open("wb")
        self._writer = Writer(
            self._file, chunk_size=1 << 18, compression=CompressionType.ZSTD, enable_data_crcs=True
        )
        self._writer.start(profile="", library="el-dorado")
        self._attach("config.toml", to_toml(config).encode(), "application/toml")
        self._attach("versions.json", _versions(), "application/json")
        if gdem is not None:
            self._attach("gdem.npz", to_npz(gdem), "application/octet-stream")
        self._attach_tiles(MAP_START, tiles)
        for name, data in kept.items():
            self._attach(KEPT + name, data, "application/json")
        self._channels = {topic: self._channel(topic) for topic in (*INPUTS, *OUTPUTS, "/plan")}

    def _attach(self, name: str, data: bytes, media_type: str) -> None:
        self._writer.add_attachment(0, 0, name, media_type, data)

    def _attach_tiles(self, prefix: str, tiles: Iterable[Tile]) -> None:
        for tile in tiles:
            self._attach(f"{prefix}{tile.i}_{tile.j}", encode(tile), "application/octet-stream")

    def _channel(self, topic: str) -> int:
        encoding = "json" if topic == "/out/event" else "application/octet-stream"
        schema = self._writer.register_schema(f"eldorado{topic.replace('/', '.')}", "text", _SCHEMA_TEXT)
        return self._writer.register_channel(topic, encoding, schema)

    def write(self, inputs: Inputs, outputs: Outputs) -> None:
        """One tick."""
        if self._file is None:
            return
        read = encode_inputs(inputs)
        made = encode_outputs(outputs, read)
        for messages in (read, made):
            for topic, data in messages.items():
                self._writer.add_message(
                    self._channels[topic], log_time=inputs.now_ns, publish_time=inputs.now_ns, sequence=inputs.tick,
                    data=data,
                )
        for job in inputs.jobs:
            if isinstance(job.value, PlanResult):
                self._writer.add_message(
                    self._channels["/plan"], log_time=inputs.now_ns, publish_time=inputs.now_ns, sequence=inputs.tick,
                    data=archive.to_npz(job.value),
                )

    def end(self, memory: StopMap | None, rhythm: Mapping[str, Any] | None = None) -> None:
        """The map as the run leaves it, and how it kept its rhythm (onboard.status.report); after the last tick."""
        if self._file is None:
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
        if self._file is not None:
            self._writer.finish()  # type: ignore[no-untyped-call]
            self._file.close()


def _versions() -> bytes:
    import platform
    from importlib.metadata import version

    rows = {name: version(name) for name in _PACKAGES}
    return json.dumps({"python": platform.python_version(), "machine": platform.machine(), **rows}).encode()
