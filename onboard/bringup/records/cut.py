"""`onboard record cut`: copy some ticks of a record into a record of their own, which names its source.

A slice that begins with its run can be replayed directly. A slice that begins later cannot, because no record contains
the state of the core; with `replayable` it also contains what a replay needs of the earlier ticks: their inputs and
digests. Without an end, a record that was cut off becomes a closed one, and parts become one file.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

from mcap.writer import CompressionType, Writer

from onboard.record.reader import Record, open_record, time_ns_of
from onboard.record.schema import LEAN
from onboard.record.writer import MAP_END, PART, register
from protocol.conventions import TICK_NS

_CHUNK_BYTES = 1 << 18
_OF_THE_END = (MAP_END, "rhythm.json")


@dataclass(frozen=True, slots=True)
class Slice:
    """Range of ticks.

    first, last: first and last tick, both included; last 0: to the end.
    replayable: True to include what a replay needs of the earlier ticks.
    """

    first: int = 1
    last: int = 0
    replayable: bool = False

    def keeps(self, number: int, topic: str) -> bool:
        """True if a message of a tick is in the slice, or is needed for its replay."""
        if self.last and number > self.last:
            return False
        return number >= self.first or (self.replayable and (topic.startswith("/in/") or topic in LEAN))


def seconds(first_s: float, last_s: float, replayable: bool = False) -> Slice:
    """Slice by the time since the start of the run; last_s 0: to the end."""
    return Slice(max(1, round(first_s * 1e9 / TICK_NS)), round(last_s * 1e9 / TICK_NS), replayable)


def cut(path: Path, out: Path, part: Slice) -> int:
    """Write the slice to `out`, replacing it; return the number of its ticks.

    If the record has none of the ticks, nothing is written. Raises DamagedRecordError, FileNotFoundError, OSError.
    """
    record = open_record(path)
    temporary = out.with_name(out.name + ".part")
    with temporary.open("wb") as file:
        ticks = _write(Writer(file, 1 << 31, CompressionType.ZSTD, enable_data_crcs=True), record, part)
    if ticks:
        temporary.replace(out)
    else:
        temporary.unlink()
    return ticks


def _write(writer: Writer, record: Record, part: Slice) -> int:
    writer.start(profile="", library="el-dorado")
    writer.add_metadata(PART, _origin(record, part))
    for name, data in record.attachments.items():
        if not part.last or not name.startswith(_OF_THE_END):
            writer.add_attachment(0, 0, name, "application/octet-stream", data)
    channels = register(writer)
    ticks = size = number = 0
    for number, messages in record.ticks():
        now_ns = time_ns_of(number, messages)
        for topic, data in messages.items():
            if part.keeps(number, topic):
                writer.add_message(channels[topic], now_ns, data, now_ns, number)
                size += len(data)
        ticks += part.keeps(number, "/in/tick")
        if size > _CHUNK_BYTES:
            writer.flush()  # type: ignore[no-untyped-call]
            size = 0
    writer.finish()  # type: ignore[no-untyped-call]
    return ticks if number >= part.first else 0  # otherwise there is only what a replay needs of earlier ticks


def _origin(record: Record, part: Slice) -> dict[str, str]:
    source = record.files[0]
    first = record.first_tick if part.replayable else max(part.first, record.first_tick)
    origin = {
        "number": "1",
        "first_tick": str(first),
        "cut_from": source.path.name,
        "cut_from_sha256": hashlib.sha256(source.path.read_bytes()).hexdigest(),
        "cut_ticks": f"{part.first} to {part.last or 'the end'}",
    }
    compared_from = max(part.first, int(source.part.get("compared_from", "1")))
    return {**origin, "compared_from": str(compared_from)} if first < compared_from else origin
