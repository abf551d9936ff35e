"""Job of `get record`, outside the tick: copy a part of the record that is being written into a record of its own.

Only chunks that overlap the requested time are read; the others are skipped by their headers. An unfinished end of a
file is ignored. The same messages give the same bytes, in flight and in a replay of the whole record.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, Chunk, Message
from mcap.stream_reader import breakup_chunk
from mcap.writer import CompressionType, IndexType, Writer

from onboard.record.reader import MAGIC, UNREADABLE
from onboard.record.writer import PART, register
from protocol.conventions import TICK_NS

SLIM_LEAVES_OUT = ("/in/lidar", "/in/can", "/out/can", "/out/link", "/state", "/plan")
_ATTACHED = ("config.toml", "versions.json")
_HEAD, _TIMES = struct.Struct("<BQ"), struct.Struct("<QQ")
_CHUNK_TICKS = 50
_END_BYTES = 10_000  # of schemas, channels and indices after the last chunk, about
RAW_RATIO = 8  # best compression of a record by zstandard
Rows = list[tuple[str, Message]]
Wanted = tuple[int, int, bool]


def record_slice(
    files: Callable[[], Sequence[Path]], since_ns: int, until_ns: int, slim: bool, limit_bytes: int
) -> tuple[bytes, str]:
    """Return (an MCAP file, description of its content); no bytes and the reason if there is nothing.

    files: of the record, oldest first.
    since_ns, until_ns: onboard time.
    slim: True to leave out SLIM_LEAVES_OUT.
    limit_bytes: the slice ends earlier if it would exceed this size.
    """
    try:
        rows, attached = _read(files(), (since_ns, until_ns, slim), RAW_RATIO * limit_bytes)
    except (OSError, *UNREADABLE) as error:
        return b"", f"the record cannot be read: {error}"
    if not rows:
        return b"", f"the record holds nothing from {since_ns / 1e9:.2f} s to {until_ns / 1e9:.2f} s"
    data, kept = b"", len(rows)
    while kept and not data:  # again, ending before what did not fit
        data, kept = _write(rows[:kept], attached, limit_bytes)
    if not data:
        return b"", f"half a second of it does not fit {limit_bytes} bytes; slim takes less"
    last_ns = rows[kept - 1][1].log_time
    short = "" if last_ns >= until_ns - TICK_NS else f"; what follows does not fit {limit_bytes} bytes"
    return data, f"{rows[0][1].log_time / 1e9:.2f} s to {last_ns / 1e9:.2f} s{short}"


def _read(files: Sequence[Path], wanted: Wanted, most_bytes: int) -> tuple[Rows, dict[str, bytes]]:
    """Messages in their order, and attachments; reads complete chunks until there are `most_bytes` of messages."""
    rows: Rows = []
    attached: dict[str, bytes] = {}
    topics, size = _topics(), 0
    for path in files:
        with path.open("rb") as file:
            for kind, record in _records(file, *wanted[:2]):
                if kind == Opcode.ATTACHMENT:
                    found = Attachment.read(record)
                    if found.name in _ATTACHED:
                        attached.setdefault(found.name, found.data)
                else:
                    rows += (found_rows := _messages(Chunk.read(record), topics, wanted))
                    size += sum(len(message.data) for _, message in found_rows)
                if size > most_bytes:
                    return rows, attached
    return rows, attached


def _records(file: BinaryIO, since_ns: int, until_ns: int) -> Iterator[tuple[int, ReadDataStream]]:
    """Yield complete attachments, and complete chunks that overlap the time."""
    if file.read(len(MAGIC)) != MAGIC:
        return
    size = file.seek(0, io.SEEK_END)
    at = len(MAGIC)
    while at + _HEAD.size <= size:
        file.seek(at)
        kind, length = _HEAD.unpack(file.read(_HEAD.size))
        at += _HEAD.size + length
        if at > size or kind == Opcode.DATA_END:
            return
        if kind == Opcode.CHUNK:
            begin_ns, end_ns = _TIMES.unpack(file.read(_TIMES.size))
            if end_ns < since_ns or begin_ns > until_ns:
                continue
            file.seek(at - length)
        if kind in (Opcode.CHUNK, Opcode.ATTACHMENT):
            yield kind, ReadDataStream(io.BytesIO(file.read(length)))


def _messages(chunk: Chunk, topics: dict[int, str], wanted: Wanted) -> Rows:
    since_ns, until_ns, slim = wanted
    left_out = SLIM_LEAVES_OUT if slim else ()
    return [
        (topics[r.channel_id], r)
        for r in breakup_chunk(chunk, validate_crc=True)
        if isinstance(r, Message) and since_ns <= r.log_time <= until_ns and topics[r.channel_id] not in left_out
    ]


def _write(rows: Rows, attached: dict[str, bytes], limit_bytes: int) -> tuple[bytes, int]:
    """Write the file in complete half seconds, up to the size limit; return it with the number of its rows."""
    file = io.BytesIO()
    writer = Writer(file, 1 << 31, CompressionType.ZSTD, IndexType.CHUNK, enable_data_crcs=True)
    writer.start(profile="", library="el-dorado")
    first, last = rows[0][1].log_time // TICK_NS, rows[-1][1].log_time // TICK_NS
    writer.add_metadata(
        PART,
        {
            "number": "1",
            "first_tick": str(rows[0][1].sequence),
            "cut_from": "the record of the run",
            "cut_ticks": f"{first} to {last}",
        },
    )
    for name, data in attached.items():
        writer.add_attachment(0, 0, name, "application/octet-stream", data)
    channels = register(writer)
    kept, part = 0, first // _CHUNK_TICKS
    for number, (topic, m) in enumerate(rows):
        if m.log_time // TICK_NS // _CHUNK_TICKS != part:
            part = m.log_time // TICK_NS // _CHUNK_TICKS
            writer.flush()  # type: ignore[no-untyped-call]
            if file.tell() > limit_bytes - _END_BYTES:
                return b"", kept
            kept = number
        writer.add_message(channels[topic], m.log_time, m.data, m.publish_time, m.sequence)
    writer.finish()  # type: ignore[no-untyped-call]
    return (b"", kept) if file.tell() > limit_bytes else (file.getvalue(), len(rows))


def _topics() -> dict[int, str]:
    """Topic by channel id. Only the first chunk of a file names them, and all files of a run use the same ids."""
    writer = Writer(io.BytesIO())
    writer.start()
    return {number: topic for topic, number in register(writer).items()}
