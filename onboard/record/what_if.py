"""`onboard replay --with-config`: run the core with another configuration on a record's inputs and report differences.

The inputs stay those of the record: wheels, scanner and operator do not react to what the core now does. So the report
is valid for what depends on the inputs alone (estimates, monitors, decisions); after the first different wheel command
its validity decreases with every metre. Jobs are taken at the tick at which they are due.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

from onboard.config import Config, load
from onboard.config_text import word
from onboard.core.rover import Rover
from onboard.core.tick import tick
from onboard.drivers.platform.workers import Inline
from onboard.record import registrations
from onboard.record.reader import check_inputs, inputs_of, open_record, reading
from onboard.record.replay import config_of, own_files, start_state
from onboard.record.rows import first_difference
from onboard.record.schema import OUTPUTS, POSE, encode_outputs

SHOWN = 20  # events in the text; JSON has all


class OneSidedEvent(NamedTuple):
    """An event that only one of the two runs has."""

    t_s: float
    name: str
    text: str


@dataclass(slots=True)
class Channel:
    """Differences of one output channel.

    ticks: number of ticks that differ.
    first_tick: the first of them; 0: none.
    first: description of the first difference.
    """

    ticks: int = 0
    first_tick: int = 0
    first: str = ""


@dataclass(slots=True)
class Report:
    """Differences between the recorded run and the run with another configuration.

    settings: name -> (recorded, now).
    ticks: number of ticks.
    channels: differences by output channel.
    worst_pose_m, worst_pose_tick: largest distance between the two estimates, and its tick.
    only_recorded, only_now: events of one run only.
    cut_off: description of the end of a record that was not closed.
    """

    settings: dict[str, tuple[str, str]]
    ticks: int = 0
    channels: dict[str, Channel] = field(default_factory=lambda: {topic: Channel() for topic in OUTPUTS})
    worst_pose_m: float = 0.0
    worst_pose_tick: int = 0
    only_recorded: list[OneSidedEvent] = field(default_factory=list)
    only_now: list[OneSidedEvent] = field(default_factory=list)
    cut_off: str = ""

    def as_json(self) -> dict[str, Any]:
        """Return the report as plain values."""
        return {
            **asdict(self),
            "only_recorded": [row._asdict() for row in self.only_recorded],
            "only_now": [row._asdict() for row in self.only_now],
        }


def changed_config(path: Path, with_config: Path | None, overrides: Mapping[str, Any]) -> Config:
    """Configuration for the run: the file, if one is named, else the record's, with single values changed.

    Raises ConfigError, DamagedRecordError, FileNotFoundError.
    """
    return load(with_config, overrides) if with_config else config_of(open_record(path), overrides)


def fly(path: Path, config: Config) -> Report:
    """Run the whole record with another configuration. Raises DamagedRecordError, FileNotFoundError."""
    record = open_record(path)
    recorded_config, gdem, memory, kept = start_state(record)
    rover, jobs = Rover(config, gdem, memory, kept), Inline(own_files(record))
    report = Report(settings_between(recorded_config, config), cut_off=record.cut_off)
    told: tuple[list[OneSidedEvent], list[OneSidedEvent]] = [], []
    for number, recorded in record.ticks():
        check_inputs(number, recorded)
        inputs, _ = inputs_of(number, recorded)
        done = jobs.take(jobs.due(number))
        with reading(number, "channel /in/registration"):
            known, apart = registrations.taken(done, recorded.get("/in/registration", b""))
        outputs = tick(rover, replace(inputs, jobs=done if apart else known))  # apart: the run has diverged
        jobs.start(outputs.jobs, outputs.cancelled)
        made = encode_outputs(outputs, recorded)
        report.ticks += 1
        with reading(number, "its outputs"):
            _compare(report, number, recorded, made)
            for rows, messages in zip(told, (recorded, made)):
                rows += [
                    OneSidedEvent(row["now_ns"] / 1e9, row["name"], row["text"])
                    for row in json.loads(messages.get("/out/event", b"[]"))
                ]
    report.only_recorded, report.only_now = _without(told[0], told[1]), _without(told[1], told[0])
    return report


def settings_between(recorded: Config, now: Config) -> dict[str, tuple[str, str]]:
    """Settings whose values differ."""
    rows = [(s.name, k.name) for s in dataclasses.fields(Config) for k in dataclasses.fields(getattr(now, s.name))]
    pairs = {
        f"{section}.{key}": (word(getattr(getattr(recorded, section), key)), word(getattr(getattr(now, section), key)))
        for section, key in rows
    }
    return {name: pair for name, pair in pairs.items() if pair[0] != pair[1]}


def _compare(report: Report, number: int, recorded: Mapping[str, bytes], made: Mapping[str, bytes]) -> None:
    for topic, channel in report.channels.items():
        old, new = recorded.get(topic, b""), made.get(topic, b"")
        if old != new:
            channel.ticks += 1
            if not channel.first_tick:
                channel.first_tick, channel.first = number, first_difference(topic, old, new)
    if "/out/pose" in recorded:
        apart_m = math.dist(POSE.unpack(recorded["/out/pose"])[:3], POSE.unpack(made["/out/pose"])[:3])
        if apart_m > report.worst_pose_m:
            report.worst_pose_m, report.worst_pose_tick = apart_m, number


def _without(rows: list[OneSidedEvent], others: list[OneSidedEvent]) -> list[OneSidedEvent]:
    """Rows that the others do not have at any time; each row of the others removes one."""
    left, kept = Counter((row.name, row.text) for row in others), []
    for row in rows:
        if left[row.name, row.text]:
            left[row.name, row.text] -= 1
        else:
            kept.append(row)
    return kept


def lines(report: Report) -> Iterator[str]:
    """Yield the lines of the report for people."""
    for name, (recorded, now) in report.settings.items():
        yield f"setting    {name}: recorded {recorded}, now {now}"
    if not report.settings:
        yield "setting    none differs"
    yield f"ticks      {report.ticks}"
    for topic, channel in report.channels.items():
        same = "the same in every tick"
        first = f"differs in {channel.ticks} ticks, first in tick {channel.first_tick}, {channel.first}"
        yield f"{topic:<11}{first if channel.ticks else same}"
    if report.worst_pose_m:
        yield f"pose       at most {report.worst_pose_m:.3f} m apart, in tick {report.worst_pose_tick}"
    for title, rows in (("recorded", report.only_recorded), ("now", report.only_now)):
        for row in rows[:SHOWN]:
            yield f"event      only {title}: {row.t_s:.2f} s {row.name} {row.text}"
        if len(rows) > SHOWN:
            yield f"event      only {title}: {len(rows) - SHOWN} more; --json has all"
    if report.cut_off:
        yield report.cut_off
