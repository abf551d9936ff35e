"""`onboard replay`: run the core on a record's inputs and compare every output byte and state digest."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from onboard.config import Config, ConfigError, load
from onboard.core.jobs import JOBS
from onboard.core.rover import Rover
from onboard.core.tick import tick
from onboard.drivers.platform.workers import Inline
from onboard.maps.gdem_file import from_npz
from onboard.perception.map.stop_map import StopMap, recall
from onboard.perception.map.tiles import Tile, decode
from onboard.record import made_by, registrations, state_checks
from onboard.record.reader import DamagedRecordError, Record, check_inputs, inputs_of, open_record, reading
from onboard.record.rows import first_difference
from onboard.record.schema import LEAN, OUTPUTS, encode_outputs
from onboard.record.writer import KEPT, MAP_END, MAP_START
from onboard.records import Gdem, Inputs, RecordedParts

Look = Callable[[int, Rover], None]
Start = tuple[Config, Gdem | None, StopMap | None, dict[str, bytes]]


@dataclass(slots=True)
class Verdict:
    """Result of a replay.

    ticks: number of ticks replayed.
    bytes_compared: by channel.
    first_difference: description; empty: identical.
    cut_off: description of the end of a record that was not closed.
    another_program: text if there is a difference and other sources made the record.
    """

    ticks: int = 0
    bytes_compared: dict[str, int] = field(default_factory=dict)
    first_difference: str = ""
    cut_off: str = ""
    another_program: str = ""

    @property
    def identical(self) -> bool:
        """True if at least one byte was compared and all are the same."""
        return not self.first_difference and self.ticks > 0 and sum(self.bytes_compared.values()) > 0


def replay(path: Path, look: Look = lambda number, rover: None) -> Verdict:
    """Run the core of this version on the record's inputs. Raises DamagedRecordError, FileNotFoundError.

    look: called with the rover after each tick.
    """
    record = open_record(path)
    verdict = Verdict(bytes_compared=dict.fromkeys(OUTPUTS, 0), cut_off=record.cut_off)
    rover, jobs = Rover(*start_state(record)), Inline(own_files(record))
    compared_from = int(record.files[0].part.get("compared_from", "1"))
    before = Inputs(0, 0)
    for number, recorded in record.ticks():
        check_inputs(number, recorded)
        inputs, job_ids = inputs_of(number, recorded)
        check_order(before, inputs)
        before = inputs
        with reading(number, "channel /in/registration"):
            done, apart = registrations.taken(jobs.take(job_ids), recorded.get("/in/registration", b""))
        if apart:
            verdict.first_difference = f"tick {number}, channel /in/registration, {apart}"
            verdict.another_program = made_by.another_program(record.attachments)
            return verdict
        outputs = tick(rover, replace(inputs, jobs=done))
        jobs.start(outputs.jobs, outputs.cancelled)
        look(number, rover)
        made = encode_outputs(outputs, recorded)
        verdict.ticks += 1
        lean = inputs.record.keeps is RecordedParts.LEAN or number < compared_from
        for topic in LEAN if lean else OUTPUTS:
            old, new = recorded.get(topic, b""), made.get(topic, b"")
            verdict.bytes_compared[topic] += len(old)
            if new != old:
                verdict.another_program = made_by.another_program(record.attachments)
                with reading(number, f"channel {topic}"):
                    words = f"tick {number}, channel {topic}, {first_difference(topic, old, new)}"
                with reading(number, "channel /state"):
                    item = state_checks.first_difference(recorded.get("/state", b""), outputs.state)
                verdict.first_difference = f"{words}; {item}" if item else words
                return verdict
    return verdict


def own_files(record: Record) -> Mapping[str, tuple[Any, ...]]:
    """Arguments that a replay's shell adds to jobs: the files of the record that it reads."""
    return {JOBS["product_record"].function: (lambda: [file.path for file in record.files],)}


def check_order(before: Inputs, inputs: Inputs) -> None:
    """Raise DamagedRecordError if ticks between two are missing that the clock had not skipped."""
    slipped = inputs.health.slipped_ticks - before.health.slipped_ticks
    if inputs.tick - before.tick - 1 > slipped:
        lost = f"; {inputs.record.lost_ticks} ticks of the run were not kept" if inputs.record.lost_ticks else ""
        raise DamagedRecordError(f"tick {inputs.tick}: those after {before.tick} are missing{lost}")


def start_state(record: Record) -> Start:
    """Configuration, orbiter's map, own map and other saved state at the start of a run. Raises DamagedRecordError."""
    if record.first_tick != 1:
        raise DamagedRecordError(f"it begins at tick {record.first_tick}: {origin(record)}")
    attachments = record.attachments
    try:
        gdem = from_npz(attachments["gdem.npz"]) if "gdem.npz" in attachments else None
        tiles = [decode(data) for name, data in attachments.items() if name.startswith(MAP_START)]
        memory = recall(tiles)
    except ValueError as error:
        raise DamagedRecordError(f"at its start: {error}") from error
    kept = {name.removeprefix(KEPT): data for name, data in attachments.items() if name.startswith(KEPT)}
    return config_of(record), gdem, memory, kept


def config_of(record: Record, overrides: Mapping[str, Any] | None = None) -> Config:
    """The configuration of the run, with single values changed.

    Raises DamagedRecordError; ConfigError for the changed values.
    """
    if "config.toml" not in record.attachments:
        raise DamagedRecordError("at its start: no config.toml: not a record of this program, or cut off there")
    with TemporaryDirectory() as folder:
        toml = Path(folder) / "config.toml"
        toml.write_bytes(record.attachments["config.toml"])
        try:
            own = load(toml)
        except ConfigError as error:
            raise DamagedRecordError(f"at its start: {error}") from error
        return load(toml, overrides) if overrides else own


def origin(record: Record) -> str:
    """Text for a record that does not begin with its run: the location of the beginning."""
    part: Mapping[str, str] = record.files[0].part
    if "cut_from" in part:
        return f"a slice of {part['cut_from']}, which can be replayed; `cut --replayable` keeps what a replay needs"
    return f"part {part['number']} of a run; replay its first part, if it is still there"


def last_map(path: Path) -> tuple[Tile, ...]:
    """Tiles of the map at the end of a record's run, or, if it has none, at its start.

    Raises DamagedRecordError, FileNotFoundError.
    """
    attachments = open_record(path).attachments
    for prefix in (MAP_END, MAP_START):
        if found := tuple(decode(data) for name, data in attachments.items() if name.startswith(prefix)):
            return found
    return ()
