"""3D scans of a run's record, computed from its bytes: all beams, each with its time and tilt."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from onboard.bringup.lidar.again import rows_of
from onboard.bringup.lidar.listener import Listener
from onboard.config import Config
from onboard.devices.nodes import Nodes
from onboard.perception.scan.scan3d import Scan3d, gather
from onboard.records import Inputs, Scan
from protocol.generated.can_codec import TiltState

BEFORE_NS, AFTER_NS = 100_000_000, 150_000_000  # the axis at rest before; a turn of the scanner and its transfer after
ROLLED_RAD = 0.02  # of a wheel between two sweeps: less (2 mm) counts as standing


class RecordedSweep(NamedTuple):
    """One sweep of a record.

    scan: the 3D scan.
    rises: the axis moved up.
    wheels_rad: encoders of the four wheels, NaN for a wheel without feedback.
    """

    scan: Scan3d
    rises: bool
    wheels_rad: tuple[float, ...]


def sweeps_of(path: Path, config: Config) -> Iterator[Scan3d]:
    """One Scan3d for each sweep of the axis that brought scans, in time order. Raises DamagedRecordError."""
    for sweep in recorded_sweeps(path, config):
        yield sweep.scan


def recorded_sweeps(path: Path, config: Config) -> Iterator[RecordedSweep]:
    """Yield the sweeps like `sweeps_of`, with wheels and axis at the end of each. Raises DamagedRecordError."""
    yield from sweeps_in((inputs for _, inputs, _ in rows_of(path)), config)


def sweeps_in(ticks: Iterable[Inputs], config: Config) -> Iterator[RecordedSweep]:
    """Yield the sweeps in the inputs of successive ticks."""
    listener, nodes = Listener(config.lidar), Nodes(config.rover, config.can)
    scans: list[Scan] = []
    began_ns = ended_ns = 0
    for inputs in ticks:
        nodes.receive(inputs.can_frames, inputs.now_ns)
        for chunk in inputs.lidar_chunks:
            scans += listener.receive(chunk)
        if nodes.tilt.state in (TiltState.SWEEPING, TiltState.GAP):
            began_ns, ended_ns = began_ns or inputs.now_ns, inputs.now_ns
        elif began_ns and inputs.now_ns > ended_ns + AFTER_NS:
            taken = [scan for scan in scans if began_ns - BEFORE_NS <= scan.start_ns <= ended_ns]
            if taken:
                yield _recorded(taken, nodes, began_ns, ended_ns)
            scans, began_ns = [], 0
        elif not began_ns:
            scans = [scan for scan in scans if scan.start_ns > inputs.now_ns - 2 * BEFORE_NS]


def standing(sweeps: Iterator[RecordedSweep]) -> list[Scan3d]:
    """The first sweeps that were taken from one place in both directions; else those of the first place.

    If all sweeps of a record run one way, the result is the first place's, so that the caller can report what is
    missing.
    """
    first: list[RecordedSweep] = []
    place: list[RecordedSweep] = []
    for sweep in sweeps:
        if place and _rolled(place[-1], sweep):
            if _both_ways(place):
                break
            first, place = first or place, []
        place.append(sweep)
    return [sweep.scan for sweep in (place if _both_ways(place) else first or place)]


def _both_ways(place: list[RecordedSweep]) -> bool:
    return len({sweep.rises for sweep in place}) == 2


def _rolled(before: RecordedSweep, after: RecordedSweep) -> bool:
    return any(abs(b - a) > ROLLED_RAD for a, b in zip(before.wheels_rad, after.wheels_rad))  # NaN: not rolled


def _recorded(taken: list[Scan], nodes: Nodes, began_ns: int, ended_ns: int) -> RecordedSweep:
    track = nodes.tilt_track(began_ns - 2 * BEFORE_NS)
    within = (track.times_ns >= began_ns) & (track.times_ns <= ended_ns)
    angles = track.angles_rad[within]
    wheels = tuple(wheel.position_rad if wheel else float("nan") for wheel in nodes.wheels)
    return RecordedSweep(gather(taken, track), len(angles) > 1 and bool(angles[-1] < angles[0]), wheels)
