"""`onboard replay`: the same core on a record's inputs; every output byte and state digest is compared."""

from __future__ import annotations

import json
import struct
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from zlib import crc32

from mcap.exceptions import McapError
from mcap.reader import McapReader, make_reader
from mcap.records import Channel, Chunk, McapRecord, Message
from mcap.stream_reader import CRCValidationError, StreamReader, get_chunk_data_stream
from zstandard import ZstdError

from onboard.config import Config, load
from onboard.core.tick import Rover, tick
from onboard.drivers.workers import Inline
from onboard.maps.gdem_file import from_npz
from onboard.perception.stop_map import StopMap, recall
from onboard.perception.tiles import Tile, decode
from onboard.record.schema import INPUTS, OUTPUTS, decode_inputs, encode_outputs, input_checks
from onboard.record.writer import KEPT, MAP_END, MAP_START
from onboard.records import Gdem
from protocol.conventions import TICK_NS

EX_OK, EX_DIFFERENT, EX_DATAERR, EX_NOINPUT = 0, 1, 65, 66
# what the reader of the file raises on bytes that were never written so
UNREADABLE = (McapError, ZstdError, EOFError, ValueError, KeyError, OverflowError, MemoryError, struct.error)


class DamagedRecordError(ValueError):
    """The record is not what was written; the text names the tick and channel where that shows."""


@dataclass(slots=True)
class Verdict:
    """What a replay found. `first_difference` empty: identical."""

    ticks: int = 0
    bytes_compared: dict[str, int] = field(default_factory=dict)
    first_difference: str = ""

    @property
    def identical(self) -> bool:
        """Every compared byte is the same, and there were some."""
        return not self.first_difference and self.ticks > 0 and sum(self.bytes_compared.values()) > 0


def verify(path: Path) -> None:
    """Reads the whole file once and checks its sums. Raises DamagedRecordError, FileNotFoundError."""
    tick = 0
    with path.open("rb") as file:
        reader = StreamReader(file, emit_chunks=True, validate_crcs=True, record_size_limit=path.stat().st_size)
        try:
            for record in reader.records:
                if isinstance(record, Chunk):
                    get_chunk_data_stream(record, validate_crc=True)
                    tick = record.message_end_time // TICK_NS
        except UNREADABLE as error:
            what = "a checksum does not fit" if isinstance(error, CRCValidationError) else repr(error)
            raise DamagedRecordError(f"it reads as far as tick {tick}; then: {what}") from error


def ticks_of(records: Iterable[McapRecord]) -> Iterator[tuple[int, dict[str, bytes]]]:
    """(tick, topic -> message), in the order of the file."""
    topics: dict[int, str] = {}
    number = -1
    messages: dict[str, bytes] = {}
    for record in records:
        if isinstance(record, Channel):
            topics[record.id] = record.topic
        elif isinstance(record, Message):
            if record.sequence != number:
                if messages:
                    yield number, messages
                number, messages = record.sequence, {}
            messages[topics[record.channel_id]] = record.data
    if messages:
        yield number, messages


def replay(path: Path) -> Verdict:
    """Run the core of this version on the record's inputs. Raises DamagedRecordError, FileNotFoundError."""
    verify(path)
    verdict = Verdict(bytes_compared=dict.fromkeys(OUTPUTS, 0))
    with path.open("rb") as file:
        try:
            start = start_state(make_reader(file))
        except ValueError as error:
            raise DamagedRecordError(f"at its start: {error}") from error
        rover, jobs = Rover(*start), Inline()
        file.seek(0)
        for number, recorded in ticks_of(StreamReader(file).records):
            check_inputs(number, recorded)
            inputs, job_ids = decode_inputs(recorded)
            outputs = tick(rover, replace(inputs, jobs=jobs.take(job_ids)))
            jobs.start(outputs.jobs, outputs.cancelled)
            made = encode_outputs(outputs, recorded)
            verdict.ticks += 1
            for topic in OUTPUTS:
                old, new = recorded.get(topic, b""), made.get(topic, b"")
                verdict.bytes_compared[topic] += len(old)
                if new != old:
                    verdict.first_difference = difference(number, topic, old, new)
                    return verdict
    return verdict


def start_state(reader: McapReader) -> tuple[Config, Gdem | None, StopMap | None, dict[str, bytes]]:
    """Configuration, orbiter's map, own map and what else was kept as a run began.

    Raises DamagedRecordError, ValueError.
    """
    attachments = {a.name: a.data for a in reader.iter_attachments()}
    if "config.toml" not in attachments:
        raise DamagedRecordError("it holds no config.toml: not a record of this program, or cut off at its start")
    with TemporaryDirectory() as folder:
        toml = Path(folder) / "config.toml"
        toml.write_bytes(attachments["config.toml"])
        config = load(toml)
    gdem = from_npz(attachments["gdem.npz"]) if "gdem.npz" in attachments else None
    tiles = [decode(data) for name, data in attachments.items() if name.startswith(MAP_START)]
    kept = {name.removeprefix(KEPT): data for name, data in attachments.items() if name.startswith(KEPT)}
    return config, gdem, recall(tiles), kept


def last_map(path: Path) -> tuple[Tile, ...]:
    """Tiles of the map that the run of a record left, or where it left none, began with.

    Raises DamagedRecordError, FileNotFoundError.
    """
    verify(path)
    with path.open("rb") as file:
        attachments = {a.name: a.data for a in make_reader(file).iter_attachments()}
    for prefix in (MAP_END, MAP_START):
        if found := tuple(decode(data) for name, data in attachments.items() if name.startswith(prefix)):
            return found
    return ()


def check_inputs(number: int, recorded: dict[str, bytes]) -> None:
    """Raises DamagedRecordError where a tick's inputs are not those that its outputs were computed from."""
    if "/in/tick" not in recorded or "/out/tick" not in recorded:
        raise DamagedRecordError(f"tick {number}: its message is missing")
    for topic, expected in input_checks(recorded["/out/tick"]).items():
        if crc32(recorded.get(topic, b"")) != expected:
            raise DamagedRecordError(f"tick {number}, channel {topic}: the bytes are not those that were recorded")
    assert set(INPUTS) >= {topic for topic in recorded if topic.startswith("/in/")}


def difference(number: int, topic: str, recorded: bytes, made: bytes) -> str:
    """Where two messages part, in words."""
    at = next((k for k, (a, b) in enumerate(zip(recorded, made)) if a != b), min(len(recorded), len(made)))
    return (
        f"tick {number}, channel {topic}, byte {at}: recorded {recorded[at : at + 8].hex() or 'nothing'}, "
        f"now {made[at : at + 8].hex() or 'nothing'} (lengths {len(recorded)}, {len(made)})"
    )


def replay_command(path: Path, as_json: bool, again: Callable[[Path], Verdict] = replay) -> int:
    """Print the verdict of `again`; returns the exit code."""
    if not path.is_file():
        print(f"onboard: no record {path}", file=sys.stderr)
        return EX_NOINPUT
    try:
        verdict = again(path)
    except DamagedRecordError as error:
        print(f"onboard: {path} is damaged: {error}", file=sys.stderr)
        return EX_DATAERR
    word = "identical" if verdict.identical else "different"
    if as_json:
        print(json.dumps({"verdict": word, "ticks": verdict.ticks, "bytes": verdict.bytes_compared,
                          "first_difference": verdict.first_difference}))
    else:
        counts = ", ".join(f"{topic} {count}" for topic, count in verdict.bytes_compared.items())
        print(f"{word}: {verdict.ticks} ticks; bytes compared: {counts}")
        if verdict.first_difference:
            print(verdict.first_difference)
    return EX_OK if verdict.identical else EX_DIFFERENT
