"""Reader of records: one file or several parts, closed or cut off, checked before anything is used.

A closed file ends with MCAP's magic; any error in it is damage. A file without that end was cut off by a power loss or
`kill -9`: it is valid up to its last complete chunk, and the rest is ignored. The same is true of a file that is being
written while it is read.
"""

from __future__ import annotations

import hashlib
import os
import struct
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO
from zlib import crc32

from mcap.data_stream import RecordBuilder
from mcap.exceptions import EndOfFile, McapError
from mcap.records import Attachment, Channel, Chunk, Header, McapRecord, Message, Metadata
from mcap.stream_reader import CRCValidationError, StreamReader, get_chunk_data_stream
from zstandard import ZstdError

from onboard.record.parts import part_of, part_path
from onboard.record.schema import INPUTS, TICK, decode_inputs, input_checks
from onboard.record.writer import PART
from onboard.records import Inputs
from protocol.conventions import TICK_NS
from protocol.visible import visible

MAGIC = b"\x89MCAP0\r\n"
_MOST_WORDS = 200  # of a library's error message
# errors of the file reader on bytes that no writer produced
UNREADABLE = (McapError, ZstdError, EOFError, ValueError, KeyError, OverflowError, MemoryError, struct.error)


class DamagedRecordError(ValueError):
    """The record differs from what was written; the text names the tick and channel of the error."""


@contextmanager
def reading(number: int, what: str) -> Iterator[None]:
    """Context that converts decoding errors into DamagedRecordError with tick and channel.

    A checksum proves that a file is undamaged, not who wrote it.
    """
    try:
        yield
    except DamagedRecordError:
        raise
    except (*UNREADABLE, IndexError, TypeError, RecursionError) as error:
        raise DamagedRecordError(f"tick {number}, {what}: it cannot be read ({_one_line(error)})") from error


@dataclass(slots=True)
class File:
    """Result of one pass over a file.

    path, size: the file and its bytes.
    closed: True if its writer closed it.
    whole_bytes: bytes up to the last complete MCAP record.
    last_tick: last tick in a complete chunk.
    library: library that wrote it.
    attachments: by name.
    part: metadata of the part.
    """

    path: Path
    size: int
    closed: bool
    whole_bytes: int = 0
    last_tick: int = 0
    library: str = ""
    attachments: dict[str, bytes] = field(default_factory=dict)
    part: dict[str, str] = field(default_factory=dict)

    def records(self) -> Iterator[McapRecord]:
        """Yield the complete MCAP records of the file, chunks unpacked."""
        with self.path.open("rb") as file:
            head = _Head(file, self.whole_bytes)
            try:
                yield from StreamReader(head).records  # type: ignore[arg-type]
            except EndOfFile as error:
                if self.closed:
                    raise DamagedRecordError(f"{self.path} has become shorter since it was checked") from error


@dataclass(frozen=True, slots=True)
class Record:
    """The files of a record, first part first."""

    files: tuple[File, ...]

    @property
    def attachments(self) -> Mapping[str, bytes]:
        """Attachments of all parts; those that each part repeats are equal."""
        return {name: data for file in self.files for name, data in file.attachments.items()}

    @property
    def first_tick(self) -> int:
        """First tick; 1 if the record begins with its run, the only place from which it can be replayed."""
        return int(self.files[0].part.get("first_tick", "1"))

    @property
    def cut_off(self) -> str:
        """Description of the end if the last file was not closed; else empty."""
        last = self.files[-1]
        if last.closed:
            return ""
        return f"cut off after tick {last.last_tick}, {last.size - last.whole_bytes} bytes behind it are no whole chunk"

    def ticks(self) -> Iterator[tuple[int, dict[str, bytes]]]:
        """Yield the ticks of all files; see `ticks_of`."""
        for file in self.files:
            yield from ticks_of(file.records())


class _Head:
    """The first `size` bytes of a file, as a stream."""

    def __init__(self, file: BinaryIO, size: int) -> None:
        self._file, self.left = file, size

    def read(self, size: int) -> bytes:
        """Read as from a file that ends after these bytes."""
        data = self._file.read(min(size, self.left))
        self.left -= len(data)
        return data


def open_record(path: Path) -> Record:
    """Open a record: the file and the further parts of its run in the same folder, each read once and checked.

    Raises DamagedRecordError, FileNotFoundError.
    """
    files = [survey(path)]
    while (beside := part_path(_first(path), int(files[-1].part.get("number", "1")) + 1)).is_file():
        following = survey(beside)
        if not _follows(files[-1], following):
            break
        files.append(following)
    return Record(tuple(files))


def survey(path: Path) -> File:
    """Read and check one file in one pass. Raises DamagedRecordError, FileNotFoundError."""
    size = path.stat().st_size
    with path.open("rb") as file:
        file.seek(max(0, size - len(MAGIC)))
        found = File(path, size, closed=size > 2 * len(MAGIC) and file.read() == MAGIC)
        file.seek(0)
        broken, head = "", _Head(file, size)
        reader = StreamReader(head, emit_chunks=True, validate_crcs=True, record_size_limit=size)  # type: ignore[arg-type]
        try:
            for record in reader.records:
                if isinstance(record, Attachment) and not _sum_fits(file, record):
                    broken = broken or f"the checksum of its attachment {record.name!r} does not fit"
                broken = _note(found, record, broken)
                if not broken:
                    found.whole_bytes = file.tell()
            found.whole_bytes = file.tell()
        except DamagedRecordError:
            raise
        except UNREADABLE as error:
            broken = broken or _words(error)
    if broken and (found.closed or not found.whole_bytes):
        raise DamagedRecordError(f"it reads as far as tick {found.last_tick}; then: {broken}")
    return found


def _sum_fits(file: BinaryIO, attachment: Attachment) -> bool:
    """True if the attachment that ends here has its checksum, which the library does not check. 0: no checksum."""
    file.seek(-4, os.SEEK_CUR)
    told = file.read(4)
    built = RecordBuilder()
    attachment.write(built)
    whole: bytes = built.end()  # type: ignore[no-untyped-call]
    return told in (bytes(4), whole[-4:])


def _note(found: File, record: McapRecord, broken: str) -> str:
    """Process one MCAP record of the file; return the description of the first error so far, or ""."""
    if isinstance(record, Chunk):
        try:
            get_chunk_data_stream(record, validate_crc=True)
        except UNREADABLE as error:
            return broken or _words(error)
        if broken:  # nothing complete follows an unfinished end
            raise DamagedRecordError(f"it reads as far as tick {found.last_tick}; then: {broken}")
        found.last_tick = record.message_end_time // TICK_NS
    elif isinstance(record, Attachment):
        found.attachments[record.name] = record.data
    elif isinstance(record, Metadata) and record.name == PART:
        found.part = record.metadata
    elif isinstance(record, Header):
        found.library = record.library
    return broken


def _words(error: Exception) -> str:
    return "a checksum does not fit" if isinstance(error, CRCValidationError) else _one_line(error)


def _one_line(error: Exception) -> str:
    return visible(repr(error))[:_MOST_WORDS]


def _first(path: Path) -> Path:
    return path.with_name(f"{part_of(path).stem}{path.suffix}") if part_of(path).number > 1 else path


def _follows(before: File, after: File) -> bool:
    """True if the second file names the first as its previous part, by the digest of its bytes."""
    size = int(after.part.get("before_bytes", "0"))
    if not 0 < size <= before.whole_bytes:
        return False
    left, digest = size, hashlib.sha256()
    with before.path.open("rb") as file:
        while left and (data := file.read(min(left, 1 << 20))):
            digest.update(data)
            left -= len(data)
    return digest.hexdigest() == after.part.get("before_sha256")


def ticks_of(records: Iterable[McapRecord]) -> Iterator[tuple[int, dict[str, bytes]]]:
    """Yield (tick, topic -> message) in the order of the file."""
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


def time_ns_of(number: int, messages: Mapping[str, bytes]) -> int:
    """Onboard time of a tick. Raises DamagedRecordError."""
    with reading(number, "channel /in/tick"):
        now_ns: int = TICK.unpack_from(messages["/in/tick"])[1]
    if now_ns < 0:
        raise DamagedRecordError(f"tick {number}, channel /in/tick: its time is before the start: {now_ns} ns")
    return now_ns


def inputs_of(number: int, messages: dict[str, bytes]) -> tuple[Inputs, tuple[int, ...]]:
    """Call `decode_inputs`. Raises DamagedRecordError."""
    with reading(number, "its inputs"):
        return decode_inputs(messages)


def check_inputs(number: int, recorded: dict[str, bytes]) -> None:
    """Raise DamagedRecordError if a tick's inputs are not those from which its outputs were computed."""
    if "/in/tick" not in recorded or "/out/tick" not in recorded:
        raise DamagedRecordError(f"tick {number}: its message is missing")
    try:
        checks = input_checks(recorded["/out/tick"])
    except struct.error as error:
        raise DamagedRecordError(f"tick {number}, channel /out/tick: too short") from error
    tick = TICK.unpack_from(recorded["/in/tick"])[0] if len(recorded["/in/tick"]) >= TICK.size else -1
    for topic, expected in checks.items():
        if crc32(recorded.get(topic, b"")) != expected:
            raise DamagedRecordError(f"tick {number}, channel {topic}: the bytes are not those that were recorded")
    if tick != number:
        raise DamagedRecordError(f"tick {number}, channel /in/tick: it is of tick {tick}")
    if strange := {topic for topic in recorded if topic.startswith("/in/")} - set(INPUTS):
        raise DamagedRecordError(f"tick {number}: no such channel: {', '.join(sorted(strange))}")
