"""A run's folder as plain data: the rover's own record and, if present, the files of the bench.

    onboard.mcap   poses, events and plans: needed     summary.json certificate.json link.json   facts of the bench
    truth.mcap     what really happened: optional      field.npz                                 the true ground

After a reboot, onboard-boot1.mcap, onboard-boot2.mcap ... are the records of the earlier boots. The clock of each boot
begins at zero and bench time stands still between two boots, so the records are joined end to end.
"""

from __future__ import annotations

import io
import json
import re
import struct
import zipfile
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from mcap.exceptions import McapError
from mcap.reader import McapReader, make_reader
from zstandard import ZstdError

from ground.report.telemetry import Collector
from onboard.maps.gdem_file import from_npz
from onboard.maps.npz_arrays import check_size
from onboard.planning import archive
from onboard.planning.archive import PlanPicture
from onboard.record.parts import family
from onboard.records import F64, Gdem, Grid
from onboard.toml_text import parse_toml
from pictures.terrain import Ground
from pictures.timelines import Span, Track

_TOPICS = ("/out/event", "/out/pose", "/plan", "/out/link", "/in/link", "/in/can")
EVERY = 10  # every tenth tick: ten poses a second
MOST_BYTES = 1 << 29  # of the ground, and of all plans, unpacked
# of readers, and of code that meets values of another kind than the programs write; RuntimeError: nested too deep
_DAMAGE = (
    McapError,
    ZstdError,
    EOFError,
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    ArithmeticError,
    RuntimeError,
    MemoryError,
    OSError,
    struct.error,
    zipfile.BadZipFile,
    zlib.error,
)


class NoRunError(ValueError):
    """The folder has no record of a run, or a damaged one. One line that names the file and what to do."""


class RoverEvent(NamedTuple):
    """Event of the rover. name: a row of protocol.tables.modes.EVENTS."""

    time_s: float
    severity: str
    name: str
    text: str


class Contact(NamedTuple):
    """Contact of wheel or body with something it must not touch, from the bench. x_m, y_m: first contact, map frame."""

    begin_s: float
    end_s: float
    what: str
    x_m: float
    y_m: float


@dataclass(frozen=True, slots=True)
class Truth:
    """The bench's truth, ten times a second.

    track: true pose.
    wheel_rates_radps, steer_rad: (k, 4), wheels 1 to 4.
    contacts: None if the file comes from a bench that did not write them.
    """

    track: Track
    wheel_rates_radps: F64
    steer_rad: F64
    contacts: tuple[Contact, ...] | None = None


@dataclass(frozen=True, slots=True)
class Run:
    """Data of a run.

    plans: (time_s, plan) in order.
    heard: telemetry, currents and link of the record.
    boots_s: times at which the boots begin, the first at 0.
    written_utc_s: UTC at which the record was last written.
    facts, certificate, link, rhythm: {} if the file is missing.
    """

    folder: Path
    estimated: Track
    events: tuple[RoverEvent, ...]
    plans: tuple[tuple[float, PlanPicture], ...]
    config: dict[str, Any]
    versions: dict[str, str]
    gdem: Gdem | None
    heard: Collector = field(default_factory=Collector)
    boots_s: tuple[float, ...] = (0.0,)
    written_utc_s: float = 0.0
    truth: Truth | None = None
    ground: Ground | None = None
    facts: dict[str, Any] = field(default_factory=dict)
    certificate: dict[str, Any] = field(default_factory=dict)
    link: dict[str, Any] = field(default_factory=dict)
    rhythm: dict[str, Any] = field(default_factory=dict)

    @property
    def contacts(self) -> tuple[Contact, ...] | None:
        """Contacts from the truth, else from the summary; None if neither has them."""
        if self.truth and self.truth.contacts is not None:
            return self.truth.contacts
        rows = self.facts.get("contacts")
        return None if rows is None or any("x_m" not in row for row in rows) else tuple(map(_contact, rows))

    def spans(self) -> tuple[Span, ...]:
        """Return the phases with their times."""
        return spans_of(self.events, float(self.estimated.times_s[-1]) if len(self.estimated.times_s) else 0.0)


def read_run(folder: Path, with_truth: bool = True) -> Run:
    """Read a run's folder. with_truth False: without the bench's truth about rover and ground. Raises NoRunError."""
    record = folder / "onboard.mcap"
    if not record.is_file():
        raise NoRunError(f"no record {record}; `hil demo --out {folder}` makes one")
    try:
        run, rhythm = _record(_boots(folder, record))
    except _DAMAGE as error:
        raise NoRunError(f"{record} is damaged: {error}") from error
    known = {
        name: _json(folder / f"{file}.json")
        for name, file in (("facts", "summary"), ("certificate", "certificate"), ("link", "link"))
    }
    truth = _truth(folder / "truth.mcap") if with_truth else None
    ground = _ground(folder / "field.npz") if with_truth else None
    written_s = record.stat().st_mtime
    return Run(folder, *run, written_utc_s=written_s, truth=truth, ground=ground, rhythm=rhythm, **known)


def spans_of(events: Sequence[RoverEvent], end_s: float) -> tuple[Span, ...]:
    """Return the phases from their PHASE events; the mode change at a mission's end ends the last one."""
    spans: list[Span] = []
    start: tuple[float, str] | None = None
    for event in events:
        ends = event.name == "MODE" and not event.text.split("->")[-1].strip().startswith("AUTONOMOUS")
        if event.name != "PHASE" and not ends:
            continue
        if start:
            spans.append(Span(start[0], event.time_s, start[1]))
        start = (event.time_s, (event.text.split() or ["?"])[0]) if event.name == "PHASE" else None
    if start:
        spans.append(Span(start[0], end_s, start[1]))
    return tuple(spans)


def angles_rad(quaternion_xyzw: F64) -> F64:
    """Convert (k, 4) unit quaternions to (k, 3) roll, pitch, yaw in rad, intrinsic z-y-x."""
    x, y, z, w = quaternion_xyzw.T
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1, 1))
    return np.column_stack([roll, pitch, np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))])


def _boots(folder: Path, record: Path) -> list[list[Path]]:
    """Return the files of each boot, oldest first: the parts of its record."""
    numbers = sorted(
        int(found[1])
        for path in folder.glob("onboard-boot*.mcap")
        if (found := re.fullmatch(r"onboard-boot(\d+)\.mcap", path.name))
    )
    return [
        family(first, whole_folder=False)
        for first in [*(folder / f"onboard-boot{number}.mcap" for number in numbers), record]
    ]


class _Content:
    """Content of the records of all boots, on one axis of time in s."""

    def __init__(self) -> None:
        self.times: list[float] = []
        self.poses: list[F64] = []
        self.events: list[RoverEvent] = []
        self.plans: list[tuple[float, PlanPicture]] = []
        self.attached: dict[str, bytes] = {}
        self.heard = Collector()
        self.end_s = 0.0

    def read(self, path: Path, begin_s: float) -> None:
        """Take one file of the boot that began at `begin_s`."""
        with path.open("rb") as file:
            reader: McapReader = make_reader(file)
            self.attached |= {a.name: a.data for a in reader.iter_attachments()}
            for _, channel, message in reader.iter_messages(topics=list(_TOPICS)):
                time_s = begin_s + message.log_time / 1e9
                self.end_s = max(self.end_s, time_s)
                self._take(channel.topic, time_s, message.sequence, message.data, begin_s)

    def _take(self, topic: str, time_s: float, sequence: int, data: bytes, begin_s: float) -> None:
        if topic == "/out/pose":
            if sequence % EVERY == 0:
                self.times.append(time_s)
                self.poses.append(np.frombuffer(data, "<f8"))
        elif topic == "/plan":
            check_size(data, MOST_BYTES)
            self.plans.append((time_s, archive.from_npz(data)))
        elif topic == "/out/event":
            self.events += [
                RoverEvent(begin_s + row["now_ns"] / 1e9, str(row["severity"]), str(row["name"]), str(row["text"]))
                for row in json.loads(data)
            ]
        elif topic == "/out/link":
            self.heard.out_link(time_s, data)
        elif topic == "/in/link":
            self.heard.in_link(time_s, data)
        else:
            self.heard.in_can(time_s, data)


def _record(boots: Sequence[Sequence[Path]]) -> tuple[tuple[Any, ...], dict[str, Any]]:
    found, begins = _Content(), list[float]()
    for paths in boots:
        begins.append(found.end_s)
        found.heard.next_boot()
        for path in paths:
            found.read(path, begins[-1])
    pose = np.array(found.poses, dtype=np.float64).reshape(-1, 6)
    track = Track(np.array(found.times), pose[:, :3], pose[:, 3:])
    attached = found.attached
    config = parse_toml(attached["config.toml"].decode())
    known = from_npz(attached["gdem.npz"]) if "gdem.npz" in attached else None
    versions, rhythm = (json.loads(attached.get(f"{name}.json", b"{}")) for name in ("versions", "rhythm"))
    return (track, tuple(found.events), tuple(found.plans), config, versions, known, found.heard, tuple(begins)), rhythm


def _truth(path: Path) -> Truth | None:
    if not path.is_file():
        return None
    try:
        with path.open("rb") as file:
            reader = make_reader(file)
            rows = [(m.log_time / 1e9, json.loads(m.data)) for _, _, m in reader.iter_messages(["/truth"])]
            contacts = _contacts(reader)

        def column(name: str, width: int) -> F64:
            return np.array([row[name] for _, row in rows], dtype=np.float64).reshape(-1, width)

        angles = angles_rad(column("quaternion_xyzw", 4))
        track = Track(np.array([time_s for time_s, _ in rows]), column("position_m", 3), angles)
        return Truth(track, column("wheel_rate_radps", 4), column("steer_rad", 4), contacts)
    except _DAMAGE as error:
        raise NoRunError(f"{path} is damaged: {error}; --no-truth leaves it out") from error


def _contacts(reader: McapReader) -> tuple[Contact, ...] | None:
    """Return the last message of each contact number: one is written when a contact begins, one when it ends."""
    summary = reader.get_summary()
    if summary and "/contact" not in {channel.topic for channel in summary.channels.values()}:
        return None
    rows = [json.loads(message.data) for _, _, message in reader.iter_messages(["/contact"])]
    return tuple(map(_contact, {row["number"]: row for row in rows}.values()))


def _contact(row: dict[str, Any]) -> Contact:
    return Contact(*(row[name] for name in Contact._fields))


def _ground(path: Path) -> Ground | None:
    if not path.is_file():
        return None
    try:
        data = path.read_bytes()
        check_size(data, MOST_BYTES)
        with np.load(io.BytesIO(data)) as file:
            heights = file["truth_heights_m"]
            grid = Grid(float(file["x0_m"]), float(file["y0_m"]), float(file["cell_m"]), *heights.shape)
            return Ground(grid, heights, file["rocks"], "the true ground")
    except _DAMAGE as error:
        raise NoRunError(f"{path} is no field file: {error}; --no-truth leaves it out") from error


def _json(path: Path) -> dict[str, Any]:
    if not path.is_file():
        return {}
    try:
        return dict(json.loads(path.read_text()))
    except _DAMAGE as error:
        raise NoRunError(f"{path} is damaged: {error}") from error
