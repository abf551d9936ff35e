"""Replay of a lidar record: the same session on the recorded bytes and times; every byte that it sends is compared."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

from onboard.bringup.lidar.core import ORDER, LidarCore, SessionOrder
from onboard.config import Config
from onboard.record import replay as of_runs
from onboard.record.reader import DamagedRecordError, check_inputs, open_record
from onboard.record.replay import Verdict
from onboard.record.rows import first_difference
from onboard.record.schema import OUTPUTS, decode_inputs, encode_outputs
from onboard.records import Inputs

Row = tuple[int, Inputs, dict[str, bytes]]


def config_of(path: Path) -> Config:
    """The configuration with which a record was made. Raises DamagedRecordError, FileNotFoundError."""
    return of_runs.config_of(open_record(path))


def rows_of(path: Path) -> Iterator[Row]:
    """(tick, inputs, all messages) of a record, of the tool or of a run. Raises DamagedRecordError."""
    for number, recorded in open_record(path).ticks():
        check_inputs(number, recorded)
        yield number, decode_inputs(recorded)[0], recorded


def replay(path: Path) -> Verdict:
    """Run this version's session on the record. Raises DamagedRecordError, also if the record is not from this tool."""
    core, verdict, ordered = LidarCore(config_of(path)), Verdict(bytes_compared=dict.fromkeys(OUTPUTS, 0)), False
    for number, inputs, recorded in rows_of(path):
        order = _order(recorded)
        ordered |= order is not SessionOrder.NONE
        made = encode_outputs(core.tick(inputs, order)[0], recorded)
        verdict.ticks += 1
        for topic in OUTPUTS:
            old, new = recorded.get(topic, b""), made.get(topic, b"")
            verdict.bytes_compared[topic] += len(old)
            if old != new:
                if not ordered:
                    raise DamagedRecordError("`onboard lidar record` did not make it; `onboard replay` takes a run's")
                verdict.first_difference = f"tick {number}, channel {topic}, {first_difference(topic, old, new)}"
                return verdict
    return verdict


def _order(recorded: dict[str, bytes]) -> SessionOrder:
    rows = json.loads(recorded.get("/out/event", b"[]"))
    return next((SessionOrder(row["text"]) for row in rows if row["name"] == ORDER), SessionOrder.NONE)
