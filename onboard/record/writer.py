"""One MCAP file for each run: every input and output of the core, tick by tick, with what is needed to run it again.

Attachments: config.toml, gdem.npz, versions.json. Chunks of 256 KiB, zstd. Decisions with their maps ride on /plan as
.npz, for the report; a replay makes them anew.
"""

from __future__ import annotations

import json
import platform
from importlib.metadata import version
from pathlib import Path
from types import TracebackType

from mcap.writer import CompressionType, Writer

from onboard.config import Config, to_toml
from onboard.gdem import to_npz
from onboard.planning import archive
from onboard.planning.plan_records import PlanResult
from onboard.record.schema import INPUTS, OUTPUTS, encode_inputs, encode_outputs
from onboard.records import Gdem, Inputs, Outputs

_SCHEMA_TEXT = b"layout: see onboard/record/schema.py of the version in versions.json"
_PACKAGES = ("numpy", "scipy", "filterpy", "small-gicp", "python-can", "pymavlink", "eclipse-zenoh", "mcap")


class Recorder:
    """Writes the record of config.record.path; with an empty path it does nothing. Used as a context manager."""

    def __init__(self, config: Config, gdem: Gdem | None) -> None:
        self._file = None
        if not config.record.path:
            return
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
        self._channels = {topic: self._channel(topic) for topic in (*INPUTS, *OUTPUTS, "/plan")}

    def _attach(self, name: str, data: bytes, media_type: str) -> None:
        self._writer.add_attachment(0, 0, name, media_type, data)

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

    def __enter__(self) -> Recorder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._file is not None:
            self._writer.finish()  # type: ignore[no-untyped-call]
            self._file.close()


def _versions() -> bytes:
    rows = {name: version(name) for name in _PACKAGES}
    return json.dumps({"python": platform.python_version(), "machine": platform.machine(), **rows}).encode()
