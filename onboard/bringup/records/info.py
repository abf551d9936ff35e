"""`onboard record info`: counts, digests and completeness of a record."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from onboard.record import made_by
from onboard.record.reader import Record, inputs_of, open_record
from onboard.record.schema import INPUTS, OUTPUTS
from onboard.records import RecordedParts


@dataclass(slots=True)
class Channel:
    """Counts of one topic.

    messages, bytes: number of messages and their bytes.
    first_tick, last_tick: ticks of the first and the last message.
    """

    messages: int = 0
    bytes: int = 0
    first_tick: int = 0
    last_tick: int = 0


@dataclass(slots=True)
class Info:
    """Summary of a whole record.

    files: one row for each file.
    closed: True if its writer closed the last file.
    cut_off: text where the last file was not closed.
    ticks, first_tick, last_tick: number of ticks, first and last.
    seconds: duration, s.
    missing: ticks between first and last that are not in the record.
    lean: ticks recorded without their outputs.
    replayable: True if the record can be replayed.
    channels, attachments: by name.
    versions: of the program that made it.
    inputs_sha256, outputs_sha256: over all messages in their order; equal for two runs of the same scenario.
    """

    files: list[dict[str, Any]]
    closed: bool
    cut_off: str
    ticks: int = 0
    first_tick: int = 0
    last_tick: int = 0
    seconds: float = 0.0
    missing: int = 0
    lean: int = 0
    replayable: bool = False
    channels: dict[str, Channel] = field(default_factory=dict)
    attachments: dict[str, dict[str, Any]] = field(default_factory=dict)
    versions: dict[str, str] = field(default_factory=dict)
    inputs_sha256: str = ""
    outputs_sha256: str = ""

    def as_json(self) -> dict[str, Any]:
        """Return the summary as plain values."""
        return asdict(self)


def info_of(path: Path) -> Info:
    """Summarise a record in one pass over all messages. Raises DamagedRecordError, FileNotFoundError."""
    record = open_record(path)
    made = Info([_file(record, k) for k in range(len(record.files))], record.files[-1].closed, record.cut_off)
    for name, data in record.attachments.items():
        made.attachments[name] = {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
    made.versions = made_by.versions(record.attachments)
    _count(made, record)
    made.replayable = record.first_tick == 1 and not made.missing and "config.toml" in record.attachments
    return made


def _count(made: Info, record: Record) -> None:
    sums = {topic: digest for topics in (INPUTS, OUTPUTS) for digest in [hashlib.sha256()] for topic in topics}
    slipped = first_ns = now_ns = 0
    for number, messages in record.ticks():
        for topic, data in messages.items():
            channel = made.channels.setdefault(topic, Channel(first_tick=number))
            channel.messages, channel.bytes, channel.last_tick = channel.messages + 1, channel.bytes + len(data), number
            if topic in sums:
                sums[topic].update(data)
        inputs, _ = inputs_of(number, messages)
        now_ns = inputs.now_ns
        if made.ticks:
            made.missing += number - made.last_tick - 1 - (inputs.health.slipped_ticks - slipped)
        else:
            made.first_tick, first_ns = number, now_ns
        made.lean += inputs.record.keeps is RecordedParts.LEAN
        made.ticks, made.last_tick, slipped = made.ticks + 1, number, inputs.health.slipped_ticks
    made.seconds = (now_ns - first_ns) / 1e9
    made.inputs_sha256, made.outputs_sha256 = sums[INPUTS[0]].hexdigest(), sums[OUTPUTS[0]].hexdigest()


def _file(record: Record, k: int) -> dict[str, Any]:
    file = record.files[k]
    return {"path": str(file.path), "bytes": file.size, "closed": file.closed, "library": file.library, **file.part}


def lines(info: Info) -> Iterator[str]:
    """Yield the lines of the table for people."""
    for file in info.files:
        origin = f", a slice of {file['cut_from']}" if "cut_from" in file else ""
        part = f", part {file['number']}" if len(info.files) > 1 else ""
        yield f"file        {file['path']}: {file['bytes']} bytes{part}{origin}"
    yield f"end         {info.cut_off or 'closed'}"
    yield f"ticks       {info.ticks}, {info.first_tick} to {info.last_tick}, {info.seconds:.2f} s"
    if info.missing or info.lean:
        yield f"            {info.missing} missing, {info.lean} without their outputs (the disk refused)"
    yield f"replay      {'from its start' if info.replayable else 'not possible: it has not all from a start on'}"
    yield f"versions    {', '.join(f'{name} {version}' for name, version in info.versions.items())}"
    yield f"inputs      SHA-256 {info.inputs_sha256}"
    yield f"outputs     SHA-256 {info.outputs_sha256}"
    yield ""
    yield f"{'channel':<12}{'messages':>10}{'bytes':>13}{'first tick':>12}{'last tick':>11}"
    for topic, row in info.channels.items():
        yield f"{topic:<12}{row.messages:>10}{row.bytes:>13}{row.first_tick:>12}{row.last_tick:>11}"
    yield ""
    for name, attached in info.attachments.items():
        yield f"attachment  {name:<20}{attached['bytes']:>10} bytes  SHA-256 {attached['sha256'][:16]}..."
